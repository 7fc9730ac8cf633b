"""The paper that every figure is drawn on: size, palette, fonts, and how it becomes an SVG string.

Colours are drawn as fixed tokens and leave as CSS variables with a fallback, so that one figure
serves light and dark pages and stands alone as a file. Axes differ by line style as well as by
colour. The bytes depend on nothing but the values: no date, no random ids.
"""

from __future__ import annotations

import gc
import hashlib
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from html import escape
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.transforms import ScaledTranslation

from olivevib.arrays import Bools, Floats, Ints
from olivevib.report.clean import clean
from olivevib.report.figures.panel import Panel
from olivevib.report.figures.svg import svg_of

WIDTH_IN = 8.6  # every figure has the width of the page
TICK_LEFT, TICK_DOWN = 0, 3  # matplotlib's markers
INK, QUIET, GRID, SHADE = "#1c2127", "#5b6570", "#d4dae1", "#eaeef3"
AXIS_COLOURS = ("#0072b1", "#d45e01", "#009e72")  # x, y, z: told apart by colour-blind readers
AXIS_STYLES: tuple[Any, ...] = ("-", (0, (4, 1.4)), (0, (1.2, 1.2)))
MARK, LEFT, RIGHT, SECOND = "#a8337f", "#33659c", "#b3541f", "#8a949f"
_VARIABLES = {
    INK: "--ink",
    QUIET: "--quiet",
    GRID: "--grid",
    SHADE: "--shade",
    AXIS_COLOURS[0]: "--x",
    AXIS_COLOURS[1]: "--y",
    AXIS_COLOURS[2]: "--z",
    MARK: "--mark",
    LEFT: "--left",
    RIGHT: "--right",
    SECOND: "--second",
}
_JOINS = 'stroke-linejoin="round" stroke-linecap="butt"'  # matplotlib's style sheet
_FONTS = ["DejaVu Sans", "Verdana", "Bitstream Vera Sans", "Arial", "sans-serif"]
_STYLE: Any = {
    "svg.fonttype": "none",
    "svg.hashsalt": "olivevib",
    "text.parse_math": False,
    "text.usetex": False,
    "axes.formatter.use_mathtext": False,
    "font.family": "sans-serif",
    "font.sans-serif": _FONTS,
    "font.size": 8,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": QUIET,
    "axes.linewidth": 0.6,
    "axes.facecolor": "none",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.labelsize": 8,
    "axes.titlesize": 8,
    "axes.titley": 1.0,  # else every title asks all tick labels where they end
    "axes.labelpad": 2.5,
    "xtick.color": QUIET,
    "ytick.color": QUIET,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "grid.color": GRID,
    "grid.linewidth": 0.5,
    "lines.linewidth": 0.9,
    "hatch.linewidth": 0.5,
    "figure.facecolor": "none",
    "savefig.facecolor": "none",
    "path.simplify": True,
    "path.simplify_threshold": 0.05,
}


@contextmanager
def style() -> Iterator[None]:
    """The one style of all figures, for as long as they are drawn; within itself it costs nothing.

    Setting matplotlib's three hundred settings takes as long as a small figure.
    """
    if mpl.rcParams["svg.hashsalt"] == _STYLE["svg.hashsalt"]:
        yield
        return
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)
        yield


@contextmanager
def _uncollected() -> Iterator[None]:
    """Without the garbage collector while one figure grows.

    A figure is one large ring of objects, and looking for what can be freed costs a fifth of the
    time.
    """
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()


def draw(name: str, title: str, height_in: float, paint: Callable[[Figure], None]) -> str:
    """One figure as an SVG string: ``paint`` draws on an empty Figure of the page's width.

    ``name`` prefixes every id in it, so that many figures share one page; ``title`` is read aloud
    by screen readers.
    """
    with style(), _uncollected():
        figure = Figure(figsize=(WIDTH_IN, height_in))
        paint(figure)
        text = svg_of(figure)
    return _tidy(text, name, title)


def _tidy(svg: str, name: str, title: str) -> str:
    """Strip the prologue, shorten numbers, make ids unique and colours themable."""
    body = svg[svg.index("<svg") :]
    body = re.sub(r"<metadata>.*?</metadata>|<style.*?</style>|<!--.*?-->", "", body, flags=re.S)
    body = _shorten_ids(body, name)
    body = re.sub(r' d="([^"]*)"', lambda m: f' d="{_short_path(m[1])}"', body)
    body = re.sub(r' (x|y|width|height)="(-?\d+\.\d{3,})"', _short_attribute, body)
    for colour, variable in _VARIABLES.items():
        body = body.replace(colour, f"var({variable},{colour})")
    body = re.sub(r">\s+<", "><", body)
    box = re.search(r'viewBox="[^"]*"', body)
    start = body.index(">") + 1
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
        f'{box[0] if box else ""} role="img" class="figure" {_JOINS} '
        f'aria-label="{escape(clean(title))}">'
    )
    return head + body[start:].rstrip()


def _shorten_ids(body: str, name: str) -> str:
    """Keep only ids that something refers to, numbered in order behind the figure's name."""
    used = list(dict.fromkeys(re.findall(r'(?:url\(#|href="#)([^")]+)', body)))
    short = {old: f"{name}-{i}" for i, old in enumerate(used)}

    def of_id(match: re.Match[str]) -> str:
        return f' id="{short[match[1]]}"' if match[1] in short else ""

    body = re.sub(r' id="([^"]*)"', of_id, body)
    return re.sub(r'(url\(#|href="#)([^")]+)', lambda m: m[1] + short[m[2]], body)


def _short_path(path: str) -> str:
    """A path without the letters that SVG lets one leave out."""
    if not re.search("[CQSA]", path):
        path = path.replace("L", " ")
    path = re.sub(r"\s+", " ", path).strip()
    return re.sub(r" ?([A-Za-z]) ?", r"\1", path)


def _short_attribute(match: re.Match[str]) -> str:
    return f' {match[1]}="{float(match[2]):.2f}"'


def rows_and_columns(
    figure: Figure,
    rows: int,
    columns: int,
    *,
    margins_in: Sequence[float],
    gaps_in: Sequence[float],
    light: bool = False,
) -> list[list[Axes]]:
    """A grid of axes with margins (left, right, top, bottom) and gaps (across, down) in inches.

    light: the axes have no ticks until ``light_ticks`` draws them.
    """
    kind = Panel if light else Axes
    width, height = figure.get_size_inches()
    left, right, top, bottom = margins_in
    across, down = gaps_in
    w = (width - left - right - across * (columns - 1)) / columns
    h = (height - top - bottom - down * (rows - 1)) / rows
    grid: list[list[Axes]] = []
    for r in range(rows):
        y = height - top - h * (r + 1) - down * r
        boxes = (
            ((left + (w + across) * c) / width, y / height, w / width, h / height)
            for c in range(columns)
        )
        grid.append([figure.add_axes(kind(figure, box)) for box in boxes])
    return grid


def note(figure: Figure, x_in: float, y_in: float, text: str, **how: Any) -> None:
    """Text at inches from the left and from the top of the figure."""
    width, height = figure.get_size_inches()
    figure.text(x_in / width, 1 - y_in / height, clean(text), **how)


def key(
    figure: Figure, x_in: float, y_in: float, entries: Sequence[tuple[str, dict[str, Any]]]
) -> None:
    """A legend in one line: each entry is a short line in its own style, then its word."""
    width, height = figure.get_size_inches()
    y = 1 - y_in / height
    for word, how in entries:
        line = Line2D(
            [(x_in + d) / width for d in (0, 0.15, 0.3)],
            [y, y, y],
            markevery=[1],
            transform=figure.transFigure,
            **how,
        )
        figure.add_artist(line)
        figure.text((x_in + 0.36) / width, y, word, va="center", fontsize=7, color=QUIET)
        x_in += 0.6 + 0.056 * len(word)


def light_ticks(
    ax: Axes, x: Sequence[float], y: Sequence[float], *, left: bool, bottom: bool
) -> None:
    """Ticks, their numbers and the grid of a light panel; its limits must stand.

    Numbers stand only at the left and at the bottom where asked for.
    """
    at_x = np.array([v for v in x if min(ax.get_xlim()) <= v <= max(ax.get_xlim())])
    at_y = np.array([v for v in y if min(ax.get_ylim()) <= v <= max(ax.get_ylim())])
    across, up = ax.get_yaxis_transform(), ax.get_xaxis_transform()
    ax.hlines(at_y, 0, 1, transform=across, color=GRID, lw=0.5, zorder=0.5)
    how: dict[str, Any] = {"ls": "", "color": QUIET, "ms": 2.5, "mew": 0.6, "clip_on": False}
    words: dict[str, Any] = {"fontsize": 7, "color": QUIET}
    inch = ax.figure.dpi_scale_trans
    if left:
        ax.yaxis.labelpad = 18
        ax.plot(np.zeros(at_y.size), at_y, marker=TICK_LEFT, transform=across, **how)
        beside = across + ScaledTranslation(-4.5 / 72, 0, inch)
        for value, word in zip(at_y, _numbers(at_y), strict=True):
            ax.text(0, value, word, transform=beside, ha="right", va="center_baseline", **words)
    if bottom:
        ax.plot(at_x, np.zeros(at_x.size), marker=TICK_DOWN, transform=up, **how)
        below = up + ScaledTranslation(0, -4.5 / 72, inch)
        for value, word in zip(at_x, _numbers(at_x), strict=True):
            ax.text(value, 0, word, transform=below, ha="center", va="top", **words)
        ax.xaxis.labelpad = 12


def _numbers(values: Floats) -> list[str]:
    """Tick values as short numbers of equal decimals, where they are evenly spaced."""
    steps = np.diff(values)
    if values.size > 1 and np.allclose(steps, steps[0]):
        decimals = next((d for d in range(6) if np.allclose(values, np.round(values, d))), 6)
        return [
            f"{v:.{decimals}f}".replace("-", "\u2212") for v in np.round(values, decimals) + 0.0
        ]
    return [f"{v:g}".replace("-", "\u2212") for v in values]


def dots(ax: Axes, x: Floats, y: Floats, size_pt: float, colour: str) -> None:
    """Small round dots as one path: a tenth of the bytes that markers take in an SVG."""
    good = np.isfinite(x) & np.isfinite(y)
    n = int(good.sum())
    if n == 0:
        return
    ends = np.repeat(np.column_stack([x[good], y[good]]), 2, axis=0)
    codes = np.tile(np.array([Path.MOVETO, Path.LINETO], dtype=np.uint8), n)
    path = Path(ends, codes)
    path.should_simplify = False  # it would drop lines without length
    patch = PathPatch(path, fill=False, edgecolor=colour, lw=size_pt, capstyle="round")
    patch.set_clip_path(ax.patch)
    ax.add_artist(
        patch
    )  # not add_patch: the limits are the caller's, and this is five times faster


def row_names(figure: Figure, grid: Sequence[Sequence[Axes]], names: Sequence[str]) -> None:
    """A bold name above the first panel of each row."""
    height = figure.get_size_inches()[1]
    for row, name in zip(grid, names, strict=True):
        box = row[0].get_position()
        y = box.y1 + 0.04 / height
        figure.text(box.x0, y, clean(name), fontsize=7.5, fontweight="bold", va="bottom")


def column_heads(figure: Figure, grid: Sequence[Sequence[Axes]], heads: Sequence[str]) -> None:
    """x, y, z with their unit above the three columns, each in its colour."""
    height = figure.get_size_inches()[1]
    for ax, head, colour in zip(grid[0], heads, AXIS_COLOURS, strict=True):
        box = ax.get_position()
        middle = box.x0 + box.width / 2
        figure.text(middle, 1 - 0.1 / height, head, ha="center", va="center", color=colour,
                    fontsize=8, fontweight="bold")  # fmt: skip


def log_ticks(ax: Axes, low: float, high: float) -> None:
    """Ticks of a logarithmic x axis: 1, 2, 5, 10, …, over three decades or more 1, 10, … alone."""
    steps = (1, 2, 5) if high < 1e3 * low else (1,)
    ticks = [s * 10.0**d for d in range(-9, 10) for s in steps if low <= s * 10.0**d <= high]
    ax.set_xticks(ticks, [f"{t:g}" for t in ticks], minor=False)
    ax.minorticks_off()


def thin(t: Floats, values: Floats, most: int = 900) -> tuple[Floats, Floats]:
    """A long trace as the smallest and largest value of each of ``most``/2 stretches.

    What is drawn covers the same area; NaN stays a gap where a whole stretch is NaN.
    """
    n = t.size
    if n <= most:
        return t, values
    edges = np.linspace(0, n, most // 2 + 1).astype(int)
    part = np.repeat(np.arange(edges.size - 1), np.diff(edges))
    lowest = _first_of_each(np.lexsort((np.nan_to_num(values, nan=np.inf), part)), edges)
    highest = _first_of_each(np.lexsort((np.nan_to_num(-values, nan=np.inf), part)), edges)
    empty = np.isnan(values[lowest])
    lowest, highest = np.where(empty, edges[:-1], lowest), np.where(empty, edges[1:] - 1, highest)
    at = np.sort(np.stack([lowest, highest], axis=1), axis=1).ravel()
    return t[at], values[at]


def _first_of_each(order: Ints, edges: Ints) -> Ints:
    """Of indices sorted by stretch, then by value, the first of each stretch."""
    return np.asarray(order[edges[:-1]])


def stride(n: int, most: int) -> int:
    """Every how many of ``n`` samples to draw so that at most ``most`` are drawn."""
    return max(1, -(-n // most))


def runs(flags: Bools) -> list[tuple[int, int]]:
    """Stretches [first, last) where ``flags`` (N,) is True."""
    padded = np.concatenate([[False], flags, [False]]).astype(np.int8)
    steps = np.diff(padded)
    starts, ends = np.flatnonzero(steps == 1), np.flatnonzero(steps == -1)
    return [(int(a), int(b)) for a, b in zip(starts, ends, strict=True)]


def digest(text: str) -> str:
    """A short fingerprint of a figure, for provenance and tests."""
    return hashlib.sha256(text.encode()).hexdigest()[:12]
