"""A figure as SVG text, its paths written to two decimals from the start."""

from __future__ import annotations

import io
from typing import Any

from matplotlib import _path
from matplotlib.backends.backend_svg import RendererSVG
from matplotlib.figure import Figure

_DECIMALS = 2  # of a point: 0.004 mm on paper
_LETTERS = [b"M", b"L", b"Q", b"C", b"z"]
_NOTHING = {"Date": None, "Creator": None, "Format": None, "Type": None}


class _ShortPaths(RendererSVG):
    """Matplotlib's own writer, which would write six decimals that somebody must cut again."""

    def _convert_path(
        self,
        path: Any,
        transform: Any = None,
        clip: Any = None,
        simplify: Any = None,
        sketch: Any = None,
    ) -> str:
        box = (0.0, 0.0, self.width, self.height) if clip else None
        text: bytes = _path.convert_to_string(  # type: ignore[attr-defined]
            path, transform, box, simplify, sketch, _DECIMALS, _LETTERS, False
        )
        return text.decode("ascii")


def svg_of(figure: Figure) -> str:
    """What ``savefig`` writes as SVG, without date and maker; the figure is 72 points an inch."""
    image_dpi = figure.dpi
    figure.set_dpi(72)
    width, height = (72 * v for v in figure.get_size_inches())
    buffer = io.StringIO()
    renderer: Any = _ShortPaths(  # type: ignore[no-untyped-call]
        width, height, buffer, image_dpi=image_dpi, metadata=_NOTHING
    )
    figure.draw(renderer)
    renderer.finalize()
    return buffer.getvalue()
