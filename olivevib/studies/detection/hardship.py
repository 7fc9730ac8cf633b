"""Covers, motion blur and uneven light: what is found, how far off, and whether it is flagged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from olivevib.progress import Tick
from olivevib.studies.detection.canvas import Look
from olivevib.studies.detection.readers import Peer, apriltag, aruco, facts, ours
from olivevib.studies.detection.scenes import Cell, Score, full_pictures, pooled
from olivevib.studies.detection.weather import (
    DARK_COVER,
    WHITE_COVER,
    covered,
    dappled,
    gradient,
    shadow_edge,
)
from olivevib.studies.study import Cell as Entry
from olivevib.studies.study import Effort, Goal, Study, Table

MARKERS = 312
SIZES_PX = (48, 64)
TILT_DEG = (0.0, 50.0)
SHARES = (0.05, 0.10, 0.15, 0.25)
PATHS_PX = (0.0, 3.0, 6.0, 9.0, 12.0, 18.0)
COLUMNS = (
    *("detector", "case", "size, px", "found, %", "lower limit, %", "rmse, px", "worst, px"),
    *("flagged, %", "inside 95 %, %", "silent > 0.1 px", "worst silent, px", "wrong ids"),
)


@dataclass(frozen=True)
class Case:
    """A named hardship on markers of one size."""

    name: str
    cell: Cell


Results = dict[tuple[str, str, float], Score]  # detector, case, size


def occlusion(effort: Effort, tick: Tick) -> Study:
    """A corner or a strip of 5 to 25 % covered, dark or white."""
    cases = [
        Case(
            f"{100 * share:g} % {'corner' if corner else 'strip'}, {word}",
            Cell(size, TILT_DEG, weather=covered(share, level, corner)),
        )
        for share in SHARES
        for corner in (True, False)
        for word, level in (("dark", DARK_COVER), ("white", WHITE_COVER))
        for size in SIZES_PX
    ]
    results = _measure(cases, effort, tick, 4)
    small = [s for (d, c, _), s in results.items() if d == "olivevib" and not c.startswith("25")]
    large = [s for (d, c, _), s in results.items() if d == "olivevib" and c.startswith("25")]
    goals = (
        *_limits("cover up to 15 %", small, 0.95, 0.03),
        _flagged("cover of 25 %", large),
        _no_wrong([*small, *large]),
    )
    return _study("detection-occlusion", "Covered markers", results, goals, effort)


def blur(effort: Effort, tick: Tick) -> Study:
    """Steady motion during the exposure, up to 18 px on markers of 48 px, in a full scan."""
    cases = [
        Case(f"{path:g} px", Cell(48, TILT_DEG, replace(Look(), motion_px=(path, 0.0))))
        for path in PATHS_PX
    ]
    results = _measure(cases, effort, tick, 5)
    nine = results["olivevib", "9 px", 48]
    mine = [s for (d, _, _), s in results.items() if d == "olivevib"]
    goals = (
        Goal(
            "found at 9 px of motion, 48 px, lower limit",
            ">= 95 %",
            f"{100 * nine.lower:.1f} % ({100 * nine.share:.1f} % found)",
            nine.lower >= 0.95 if nine.drawn >= 300 else None,
        ),
        _flagged("motion blur", mine),
        _no_wrong(mine),
    )
    return _study("detection-blur", "Motion blur in a full scan", results, goals, effort)


def light(effort: Effort, tick: Tick) -> Study:
    """A hard shadow edge, a gradient of 4:1, dappled sun without and with leaves on the marker."""
    kinds = {
        "shadow edge": shadow_edge,
        "gradient": gradient,
        "dappled": dappled(covers=False),
        "dappled, leaves": dappled(covers=True),
    }
    cases = [
        Case(name, Cell(size, TILT_DEG, weather=kind))
        for name, kind in kinds.items()
        for size in SIZES_PX
    ]
    results = _measure(cases, effort, tick, 6)

    def of(case: str) -> list[Score]:
        return [s for (d, c, _), s in results.items() if d == "olivevib" and c == case]

    sunny = [*of("dappled"), *of("dappled, leaves")]
    goals = (
        *_limits("shadow edge x 0.35", of("shadow edge"), 0.95, 0.03),
        *_limits("gradient 4:1", of("gradient"), 1.0, 0.015),
        *_limits("dappled sun, leaves over < 15 %", sunny, 0.95, 0.05),
        _flagged("dappled sun", sunny),
        _no_wrong([s for (d, _, _), s in results.items() if d == "olivevib"]),
    )
    return _study("detection-light", "Uneven light", results, goals, effort)


def _measure(cases: Sequence[Case], effort: Effort, tick: Tick, where: int) -> Results:
    peers: list[Peer] = [ours(), aruco("contour"), apriltag()]
    markers = effort.count(MARKERS, 24)
    results: Results = {}
    for k, case in enumerate(cases):
        for peer in peers:
            tick(k, len(cases), f"{case.name}, {case.cell.size_px:g} px: {peer.name}")
            results[peer.name, case.name, case.cell.size_px] = full_pictures(
                peer,
                case.cell,
                markers,
                lambda n, k=k: effort.draws(where, k, n),  # type: ignore[misc]
            )
    tick(1, 1, "all read")
    return results


def _study(
    name: str, title: str, results: Results, goals: tuple[Goal, ...], effort: Effort
) -> Study:
    detectors = list(dict.fromkeys(detector for detector, _, _ in results))
    tables = tuple(
        Table(
            f"{detector}",
            COLUMNS,
            tuple(_row(key, score) for key, score in results.items() if key[0] == detector),
        )
        for detector in detectors
    )
    drawn = str(effort.count(MARKERS, 24))
    return Study(name, title, tables, (), goals, (*facts(), ("markers a cell, at least", drawn)))


def _row(key: tuple[str, str, float], score: Score) -> tuple[Entry, ...]:
    flagged = score.flagged[score.found]
    return (
        *key,
        round(100 * score.share, 1),
        round(100 * score.lower, 1),
        round(score.rmse_px, 4),
        round(score.worst_px, 3),
        round(100 * float(flagged.mean()), 1) if len(flagged) else float("nan"),
        round(100 * score.inside, 1),
        score.silent,
        round(score.silent_px, 3),
        score.wrong,
    )


def _limits(name: str, scores: list[Score], found: float, rmse_px: float) -> tuple[Goal, Goal]:
    share = min(score.share if found == 1 else score.lower for score in scores)
    worst = max(score.rmse_px for score in scores)
    enough = scores[0].drawn >= 300
    word = "found" if found == 1 else "lower limit"
    least = min(score.share for score in scores)
    return (
        Goal(
            f"{name}: found, worst cell",
            f">= {100 * found:g} %",
            f"{word} {100 * share:.1f} % ({100 * least:.1f} % found)",
            share >= found if enough else None,
        ),
        Goal(f"{name}: rmse, worst cell", f"<= {rmse_px} px", f"{worst:.4f} px", worst <= rmse_px),
    )


def _flagged(name: str, scores: list[Score]) -> Goal:
    both = pooled(scores)
    far = int((both.distance > 0.1).sum())
    measured = f"{far - both.silent} of {far} flagged; worst silent {both.silent_px:.3f} px"
    return Goal(f"{name}: errors > 0.1 px flagged", "all", measured, both.silent == 0)


def _no_wrong(scores: list[Score]) -> Goal:
    both = pooled(scores)
    return Goal("wrong ids", "0", f"{both.wrong} in {both.drawn} markers", both.wrong == 0)
