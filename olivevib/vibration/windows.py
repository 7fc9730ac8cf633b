"""Windows: how a record is faded in and out before its spectrum is taken."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from olivevib.arrays import Floats
from olivevib.errors import UsageError

_COSINES = MappingProxyType(
    {
        "rectangular": (1.0,),
        "hann": (0.5, 0.5),
        "hamming": (0.54, 0.46),
        "blackman": (0.42, 0.5, 0.08),
        "blackman-harris": (0.35875, 0.48829, 0.14128, 0.01168),
        "flat-top": (0.21557895, 0.41663158, 0.277263158, 0.083578947, 0.006947368),
    }
)

NAMES = tuple(_COSINES)


@dataclass(frozen=True)
class Window:
    """A sum of cosines over the record, periodic: w(u) = sum (-1)^j a_j cos(2 pi j u), 0 <= u < 1.

    coherent_gain: mean of the window (a line is read that much too small before correction);
    enbw_bins: equivalent noise bandwidth in bins of 1/T.
    """

    name: str
    cosines: tuple[float, ...]

    @property
    def coherent_gain(self) -> float:
        """Mean of the window, S1/N."""
        return self.cosines[0]

    @property
    def enbw_bins(self) -> float:
        """Equivalent noise bandwidth N S2 / S1^2, bins."""
        a = self.cosines
        return 1.0 + 0.5 * sum(c * c for c in a[1:]) / a[0] ** 2

    def at(self, u: Floats) -> Floats:
        """The window at phases u (N,) of the record, 0 at its start, 1 just past its end."""
        w = np.zeros_like(u)
        for j, a in enumerate(self.cosines):
            w += (-1) ** j * a * np.cos(2 * np.pi * j * u)
        return w


def window(name: str) -> Window:
    """The window of that name; raises UsageError listing the names there are."""
    if name not in _COSINES:
        raise UsageError(
            f"there is no window {name!r}",
            remedy=f"Use one of: {', '.join(NAMES)}.",
        )
    return Window(name, _COSINES[name])
