"""What can leave a trial: the report and the exports, what each holds, where it goes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rich.text import Text

from olivevib.tui.harmless import harmless
from olivevib.tui.views.palette import Palette

HOLDS = {
    "report": "one self-contained page: verdict, figures, tables, warnings; opens in any browser",
    "csv": "one row a marker and time: x, y, z, sigmas, state",
    "txt": "one row a time, tabs between columns, for spreadsheets",
    "h5": "paths, spectra and rig in one HDF5 file, for Python and MATLAB",
    "dxf": "each path as a polyline in mm, for CAD",
    "step": "each path as a curve in mm, for CAD",
    "iges": "each path as a curve in mm, for CAD",
    "ply": "points with their time, for mesh viewers",
    "uff": "displacement per marker and axis (UFF58), for modal software",
    "c3d": "marker paths, for motion-capture software",
    "trc": "marker paths, for OpenSim",
    "mat": "paths and spectra, for MATLAB",
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


def preview_text(output: Output, extent: str, palette: Palette) -> Text:
    """What will be written, and where."""
    out = Text()
    made = output.state != "not made"
    out.append("Made: " if made else "Enter writes ", palette.accent)
    out.append(f"{harmless(output.place, 300)}\n")
    out.append(f"{HOLDS.get(output.kind, 'the 3-D paths')}. {extent}", palette.muted)
    if made:
        out.append("\nEnter writes it again; nothing else is touched.", palette.muted)
    return out


def extent_words(times: int, markers: int, seconds: float, frame: str) -> str:
    """How much goes into an export."""
    if not times:
        return "There are no 3-D paths yet: only the report can be made."
    return f"{markers} markers, {times} times over {seconds:.1f} s, mm in the frame of the {frame}."
