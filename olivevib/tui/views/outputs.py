"""What can leave a trial: the report and the exports, what each holds, where it goes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rich.text import Text

from olivevib.tui.harmless import harmless
from olivevib.tui.views.folder import bytes_words
from olivevib.tui.views.palette import Palette

if TYPE_CHECKING:
    from olivevib.pipeline.export_preview import ExportPreview

REPORTS = ("report", "pdf", "figures")
HOLDS = {
    "report": "one self-contained page: verdict, figures, tables, warnings; opens in any browser",
    "pdf": "the page and its figures for paper, fonts inside",
    "figures": "the page, and each figure as an SVG file",
    "csv": "one row a marker and time: x, y, z, sigmas, state",
    "txt": "one row a time, in blocks a marker, for spreadsheets and CAD",
    "h5": "paths, spectra and rig in one HDF5 file, for Python and MATLAB",
    "dxf": "each path as a polyline in mm, for CAD",
    "step": "each path as a curve in mm, for CAD",
    "iges": "each path as a curve in mm, for CAD",
    "ply": "points with their time, for mesh viewers",
    "uff": "displacement per marker and axis (UFF58), for modal software",
    "c3d": "marker paths, for motion-capture software",
    "trc": "marker paths, for OpenSim",
    "mat": "paths and spectra, for MATLAB",
    "parquet": "the rows of csv as columns, for pandas and R",
}
COLUMNS = {
    "csv": "time_s, marker, x_mm, y_mm, z_mm, sigma_x_mm, sigma_y_mm, sigma_z_mm, state",
    "parquet": "time_s, marker, x_mm, y_mm, z_mm, sigma_x_mm, sigma_y_mm, sigma_z_mm, state",
    "txt": "x y z in mm, t in s; a block a marker",
    "h5": "positions and sigmas in mm, times in s, spectra in mm, mm/s, m/s²; a unit on each",
    "dxf": "x, y, z in mm; a layer a marker",
    "step": "x, y, z in mm; a curve a marker",
    "iges": "x, y, z in mm; a curve a marker",
    "ply": "x, y, z in mm, marker, time in s",
    "uff": "displacement over time in s, a function a marker and axis, units in its header",
    "c3d": "x, y, z in mm, a point a marker and frame",
    "trc": "time in s, x, y, z in mm a marker",
    "mat": "t_s, xyz_mm, sigma_mm, state of each marker; spectra with their units",
}


@dataclass(frozen=True)
class Output:
    """One thing that can be written: its kind, its place, whether it is there and newer results."""

    kind: str
    place: str
    state: str  # "not made", "made", "older than the results"


def output_rows(outputs: Sequence[Output], palette: Palette) -> list[tuple[Text, Text, Text]]:
    """Cells: kind, state, what it holds."""
    styles = {"made": palette.good, "not made": palette.muted}
    return [
        (
            Text(o.kind),
            Text(o.state, styles.get(o.state, palette.warn)),
            Text(HOLDS.get(o.kind, "the 3-D paths"), palette.muted),
        )
        for o in outputs
    ]


def preview_text(output: Output, found: ExportPreview | None, palette: Palette) -> Text:
    """What will be written, and where; ``found`` None: it is a report, or not known (yet)."""
    out = Text()
    made = output.state != "not made"
    out.append("Made: " if made else "Enter writes ", palette.accent)
    out.append(f"{harmless(output.place, 300)}")
    out.append(f" · {bytes_words(found.size)}\n" if found else "\n")
    if found is None:
        out.append(f"{HOLDS.get(output.kind, 'the 3-D paths')}\n", palette.muted)
    else:
        _contents(out, output.kind, found, palette)
    if made:
        out.append("Enter writes it again; nothing else is touched.", palette.muted)
    return out


def _contents(out: Text, kind: str, found: ExportPreview, palette: Palette) -> None:
    rows = (
        ("holds", f"{id_words(found.markers)}; {found.times} times over {found.span_s:.2f} s"),
        ("columns", COLUMNS.get(kind, HOLDS.get(kind, ""))),
        ("axes", f"of the {found.frame}"),
        ("gaps", gap_words(found)),
    )
    for name, words in rows:
        out.append(f"{name:<9}", palette.muted)
        out.append(f"{harmless(words, 400)}\n")
    for line in found.head:
        out.append(f"  {harmless(line, 110)}\n", palette.muted)


def id_words(ids: Sequence[int]) -> str:
    """Markers by their ids, cut where they are many."""
    return harmless(f"marker{'s' * (len(ids) != 1)} {', '.join(map(str, ids))}", 60)


def gap_words(found: ExportPreview) -> str:
    """Which markers have gaps, how many and how long."""
    if not found.gaps:
        return "none: every marker is there at every time"
    parts = [
        f"marker {g.marker} {g.times} times in {g.stretches} stretch{'es' * (g.stretches != 1)} "
        f"(longest {g.longest_s:.2f} s)"
        for g in found.gaps
    ]
    rest = "; the others have none" if len(found.gaps) < len(found.markers) else ""
    return f"{'; '.join(parts)}{rest}. Gaps stay gaps"
