"""Axes without matplotlib's own ticks: for grids of many panels, whose ticks ``light_ticks`` draws.

A tick of matplotlib is five artists with their own texts and transforms; made and thrown away for
each panel they take a third of the time of a page.
"""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.axis import Tick, XAxis, YAxis


class _Untick:
    """An axis that has its label and its scale, and no tick."""

    majorTicks: tuple[Tick, ...] = ()  # noqa: N815 (matplotlib's name)
    minorTicks: tuple[Tick, ...] = ()  # noqa: N815

    def _update_ticks(self) -> list[Tick]:
        return []

    def set_tick_params(self, *_: Any, **__: Any) -> None:
        """Nothing: there are no ticks."""

    def reset_ticks(self) -> None:
        """Nothing: there are no ticks."""

    def get_ticks_position(self) -> str:
        """Where ticks would stand: matplotlib asks when it places a title."""
        return "default"


class _AcrossAxis(_Untick, XAxis):  # type: ignore[misc]
    """The axis below a panel."""


class _UpAxis(_Untick, YAxis):  # type: ignore[misc]
    """The axis beside a panel."""


class Panel(Axes):
    """Axes whose ticks, numbers and grid are drawn by whoever fills it."""

    xaxis: Any
    yaxis: Any

    def __init__(self, *where: Any, **how: Any) -> None:
        super().__init__(*where, **how)
        for spine in self.spines.values():
            spine.get_spine_transform()  # a side finds its place when first asked, else by a tick

    def _init_axis(self) -> None:
        self.xaxis = _AcrossAxis(self, clear=False)
        self.yaxis = _UpAxis(self, clear=False)
        for side, axis in (("bottom", self.xaxis), ("top", self.xaxis), ("left", self.yaxis),
                           ("right", self.yaxis)):  # fmt: skip
            self.spines[side].register_axis(axis)
