"""How many markers a full scan finds, by frontal size and tilt: ours, aruco 4 x 4, AprilTag 3."""

from __future__ import annotations

import numpy as np

from olivevib.progress import Tick
from olivevib.studies.detection.readers import apriltag, aruco, facts, ours
from olivevib.studies.detection.scenes import Cell, Score, full_pictures
from olivevib.studies.study import Cell as Entry
from olivevib.studies.study import Chart, Curve, Effort, Goal, Study, Table

SIZES_PX = (24, 32, 48, 64, 96)
TILTS_DEG = tuple(range(0, 90, 5))
REACH_DEG = {24: 50, 32: 60, 48: 70, 64: 75, 96: 80}  # asked
LOWER = 0.985
MARKERS = 312
MODULE_PX = 1.0  # at which half are to be found


def run(effort: Effort, tick: Tick) -> Study:
    """Rates with their lower 95 % limits over size and tilt."""
    peers = [ours(), aruco("none"), apriltag()]
    markers = effort.count(MARKERS, 15)
    cells = [(s, t) for s in SIZES_PX for t in TILTS_DEG]
    scores: dict[tuple[str, int, int], Score] = {}
    for k, (size, tilt) in enumerate(cells):
        for peer in peers:
            tick(k, len(cells), f"{size} px, {tilt} deg: {peer.name}")
            cell = Cell(size, (tilt, tilt))
            scores[peer.name, size, tilt] = full_pictures(
                peer,
                cell,
                markers,
                lambda n, k=k: effort.draws(1, k, n),  # type: ignore[misc]
            )
    tick(1, 1, "rates")
    names = [peer.name for peer in peers]
    return Study(
        name="detection-rates",
        title="Markers found by a full scan, by size and tilt",
        tables=(*(_table(name, scores) for name in names), _half_table(names, scores)),
        charts=tuple(_chart(size, names, scores) for size in SIZES_PX),
        goals=_goals(scores),
        facts=(*facts(), ("markers a cell, at least", str(markers))),
    )


def _table(name: str, scores: dict[tuple[str, int, int], Score]) -> Table:
    rows: list[tuple[Entry, ...]] = [
        (tilt, *(_cell(scores[name, size, tilt]) for size in SIZES_PX)) for tilt in TILTS_DEG
    ]
    columns = ("tilt, deg", *(f"{s} px" for s in SIZES_PX))
    return Table(f"{name}: found, % (lower 95 % limit)", columns, tuple(rows))


def _cell(score: Score) -> str:
    wrong = f", {score.wrong} wrong" if score.wrong else ""
    return f"{100 * score.share:.1f} ({100 * score.lower:.1f}){wrong}"


def reach_deg(name: str, size: int, scores: dict[tuple[str, int, int], Score]) -> int | None:
    """The tilt up to which every cell's lower limit holds."""
    reached = None
    for tilt in TILTS_DEG:
        if scores[name, size, tilt].lower < LOWER:
            break
        reached = tilt
    return reached


def half_module_px(name: str, size: int, scores: dict[tuple[str, int, int], Score]) -> float:
    """Length of a foreshortened module at which half the markers are found, px."""
    share = np.array([scores[name, size, t].share for t in TILTS_DEG])
    below = np.flatnonzero(share < 0.5)
    if not below.size or below[0] == 0:
        return float("nan")
    k = int(below[0])
    part = (share[k - 1] - 0.5) / (share[k - 1] - share[k])
    tilt = np.radians(TILTS_DEG[k - 1] + 5 * part)
    modules = {"olivevib": 11, "AprilTag 3": 8}.get(name, 6)
    return float(size * np.cos(tilt) / modules)


def _half_table(names: list[str], scores: dict[tuple[str, int, int], Score]) -> Table:
    rows = tuple(
        (
            name,
            size,
            "-" if (up := reach_deg(name, size, scores)) is None else str(up),
            round(half_module_px(name, size, scores), 3),
        )
        for name in names
        for size in SIZES_PX
    )
    columns = (
        "detector",
        "size, px",
        f">= {100 * LOWER:g} % up to, deg",
        "half found at, px a module",
    )
    return Table("Reach", columns, rows)


def _chart(size: int, names: list[str], scores: dict[tuple[str, int, int], Score]) -> Chart:
    tilts = np.array(TILTS_DEG, dtype=np.float64)
    curves = tuple(
        Curve(name, tilts, np.array([scores[name, size, t].share for t in TILTS_DEG]))
        for name in names
    )
    return Chart(f"{size}px", f"Found, {size} px", "tilt, deg", "share found", curves)


def _goals(scores: dict[tuple[str, int, int], Score]) -> tuple[Goal, ...]:
    goals = []
    for size, asked in REACH_DEG.items():
        up = reach_deg("olivevib", size, scores)
        enough = scores["olivevib", size, 0].drawn >= 300
        part = [scores["olivevib", size, t] for t in TILTS_DEG if t <= asked]
        missed = sum(s.drawn - int(s.found.sum()) for s in part)
        measured = f"{up} deg; {missed} of {sum(s.drawn for s in part)} missed up to {asked} deg"
        reached = (up is not None and up >= asked) if enough else None
        goals.append(
            Goal(
                f"full scan, {size} px, lower limit >= 98.5 %",
                f"up to {asked} deg",
                measured if enough else f"too few markers for the limit; {measured}",
                reached,
            )
        )
    halves = [half_module_px("olivevib", s, scores) for s in SIZES_PX]
    goals.append(
        Goal(
            "half found at, px a module",
            f"<= {MODULE_PX}",
            ", ".join(f"{h:.2f}" for h in halves),
            bool(np.nanmax(halves) <= MODULE_PX),
        )
    )
    wrong = sum(s.wrong for (name, _, _), s in scores.items() if name == "olivevib")
    total = sum(s.drawn for (name, _, _), s in scores.items() if name == "olivevib")
    goals.append(Goal("wrong ids", "0", f"{wrong} in {total} markers", wrong == 0))
    return tuple(goals)
