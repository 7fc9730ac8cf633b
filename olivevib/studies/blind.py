"""Blind trials of the frequency above the frame rate: verdict against truth, on projected points.

Nothing of the truth is given to the solver: row times and offset are drawn about it with the sigma
that the solver is told, or it is told nothing of the offset. Half of the trials' seeds show what
lead is safe, the others check it. Trials are kept by the hundred (studies.cells).
"""

from __future__ import annotations

import itertools
import time
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from olivevib.arrays import Bools, Floats
from olivevib.progress import Tick, silent
from olivevib.reconstruction.motion import Anchor, MotionFit, fit_motion
from olivevib.reconstruction.motion.decide import CONFIRMED_LEAD, in_step
from olivevib.studies import cells
from olivevib.studies.blind_scenes import (
    HALF_MM,
    RATE_HZ,
    ROWS,
    Scene,
    draw_anchor,
    draw_scene,
    rig,
    sight,
)
from olivevib.studies.study import Effort, Goal, Study, Table
from olivevib.vibration.types import LineStatus

TRIALS = 5000  # of which at least 3000 confirmed, at full effort
SILENT_TRIALS = 100  # nothing to tell with: global shutters in step
TOGETHER = 100  # trials of one cell
SECONDS = 4.5
RIGHT_HZ = 0.1
CONTRAST_PX = 0.08  # below which no confirmation is asked for


@dataclass(frozen=True)
class Outcome:
    """One trial. z, error: over sigma and plain, in the order of NAMES, where the branch is right;
    true_mm: the amplitude of the first marker on its larger axis across, and in depth.
    """

    status: LineStatus
    right: bool
    lead: float
    asked: bool  # amplitude, anchor and zone permit
    ratio: float  # found frequency over true
    amplitude_mm: float
    true_mm: tuple[float, ...]
    z: tuple[float, ...]
    error: tuple[float, ...]
    seconds: float
    markers: int


NAMES = ("frequency, Hz", "offset, s", "row time, share", "amplitude, mm", "depth amplitude, mm")


def run(effort: Effort, tick: Tick = silent) -> Study:
    """Verdict x truth, lead x truth, errors over sigma, cost."""
    count, quiet = effort.count(TRIALS, 4), effort.count(SILENT_TRIALS, 1)
    found: list[Outcome] = []
    for first in range(0, count, TOGETHER):
        found += together(effort, range(first, min(first + TOGETHER, count)), count + quiet, tick)
    claims = 0
    for k in range(quiet):
        tick(count + k, count + quiet, "trials with nothing to tell by")
        claims += mute(effort.draws(k, 1))
    even, odd = found[0::2], found[1::2]
    safe = max((o.lead for o in even if not o.right and np.isfinite(o.lead)), default=0.0)
    return Study(
        name="blind",
        title="Frequency above the frame rate: blind trials on projected points",
        tables=(matrix(found), by_lead(found), errors(found)),
        goals=goals(found, claims, quiet),
        facts=(
            ("trials", f"{count} of {TRIALS} with an anchor, {quiet} of {SILENT_TRIALS} without"),
            ("record", f"{SECONDS:g} s at {RATE_HZ:g} frames/s, 1-3 markers, 60 mm, 1.2-1.6 m"),
            ("largest lead of a wrong branch, first half", f"{safe:.1f}"),
            (
                f"wrong with a lead above {max(safe, CONFIRMED_LEAD):.1f}, second half",
                str(sum(not o.right and o.lead > max(safe, CONFIRMED_LEAD) for o in odd)),
            ),
        ),
    )


def together(effort: Effort, which: range, total: int, tick: Tick) -> list[Outcome]:
    """Some trials by their numbers, measured now or kept from before."""

    def measure() -> list[dict[str, Any]]:
        out = []
        for k in which:
            tick(k, total, f"trial {k}")
            out.append(asdict(one(effort.draws(k))))
        return out

    name = f"{effort.seed}-{which.start}-{which.stop}"
    rows = cells.kept("blind", name, [effort.seed, which.start, which.stop, SECONDS], measure)
    return [outcome_of(row) for row in rows]


def outcome_of(row: dict[str, Any]) -> Outcome:
    """One trial from its cell."""
    more = {
        "status": LineStatus(row["status"]), "z": tuple(row["z"]), "error": tuple(row["error"]),
        "true_mm": tuple(row["true_mm"]),
    }  # fmt: skip
    return Outcome(**{**row, **more})


def one(draws: np.random.Generator) -> Outcome:
    """Draw, see, fit, compare."""
    scene = draw_scene(draws, SECONDS)
    anchor = draw_anchor(scene, draws)
    pair = rig()
    seen = sight(scene, pair, draws)
    start = time.process_time()
    fit = fit_motion(seen, pair, anchor)
    seconds = time.process_time() - start
    ratio = fit.f_hz / scene.f_hz
    right = bool(abs(fit.f_hz - scene.f_hz) < RIGHT_HZ)
    z, error = _errors(scene, fit) if right else ((), ())
    if scene.kind == "wandering" and right:  # whose mean is a matter of definition
        z = (float("nan"), *z[1:])
    size = float(np.linalg.norm(np.abs(scene.amplitude[:, 0, :3]), axis=1).max())
    asked = permitted(scene, anchor, size)
    return Outcome(
        fit.status,
        right,
        float(fit.branches.lead),
        asked,
        float(ratio),
        size,
        true_mm(scene),
        z,
        error,
        seconds,
        len(fit.markers),
    )


def true_mm(scene: Scene) -> tuple[float, float]:
    """Amplitudes of the first marker: the larger across, and in depth."""
    true = np.abs(scene.amplitude[0, 0, :3])
    return float(true[:2].max()), float(true[2])


def mute(draws: np.random.Generator) -> bool:
    """Whether anything is claimed where global shutters in step leave nothing to tell by."""
    scene = replace(
        draw_scene(draws, SECONDS), readout_s=(0.0, 0.0), offset_s=0.0, drift=0.0, drops=0.0
    )
    anchor = Anchor(0.0, 0.0, 0.0, 0.0, "global", 0.0, 2e-5, 0.0, "calibration", drift_sigma=1e-6)
    pair = rig()
    fit = fit_motion(sight(scene, pair, draws), pair, anchor)
    return fit.status in (LineStatus.CONFIRMED, LineStatus.SUPPORTED)


def permitted(scene: Scene, anchor: Anchor, size_mm: float) -> bool:
    """Whether a confirmation is asked for: contrast, anchor and zone (timing, 5.3 and 8.3)."""
    px_mm = 950.0 / 1400.0
    readout = float(np.mean(np.abs(scene.readout_s))) / ROWS
    contrast = 2 * np.pi * RATE_HZ * size_mm * px_mm * 2 * HALF_MM * px_mm * readout
    at_middle = scene.offset_s + (scene.readout_s[1] - scene.readout_s[0]) / 2
    step = in_step(at_middle, RATE_HZ)
    f = scene.f_hz
    near = abs(f - 30.0) < (2.7 if step else 0.3)
    marks = (7.5, 10.0, 15.0, 20.0, 22.5, 37.5, 40.0) if step else ()
    narrow = any(abs(f - m) < 0.3 for m in marks)
    known = anchor.left_row_time_sigma_s <= 0.05 * anchor.left_row_time_s
    return bool(contrast >= CONTRAST_PX and known and not near and not narrow)


def _errors(scene: Scene, fit: MotionFit) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Errors over their sigma, and errors, in the order of NAMES; NaN: an offset that may slip."""
    t, row = fit.timing, fit.timing.reference_row
    left, right = (r / ROWS for r in scene.readout_s)
    offset = scene.offset_s + row * (right - left)
    marker = fit.markers[0]
    true = scene.amplitude[0, 0, :3]
    got = np.hypot(marker.cosine[0], marker.sine[0])[:3]
    sigma = marker.amplitude_sigma()[0, :3]
    axis = int(np.argmax(np.abs(true[:2])))
    error = (
        t.frequency_hz - scene.mean_hz,
        t.right_offset_s - offset if not t.offset_slip else float("nan"),
        t.left_row_time_s / left - 1,
        float(got[axis] - np.abs(true[axis])),
        float(got[2] - np.abs(true[2])),
    )
    sigmas = (
        t.sigma("frequency_hz"),
        t.sigma("right_offset_s"),
        t.sigma("left_row_time_s") / left,
        float(sigma[axis]),
        float(sigma[2]),
    )
    return tuple(e / s for e, s in zip(error, sigmas, strict=True)), error


def matrix(found: list[Outcome]) -> Table:
    """Status against truth."""
    rows = []
    for status in LineStatus:
        mine = [o for o in found if o.status is status]
        if mine:
            double = sum(abs(o.ratio - 2) < 0.02 or abs(o.ratio - 0.5) < 0.005 for o in mine)
            wrong = sum(not o.right for o in mine)
            rows.append((status.value, len(mine), len(mine) - wrong, wrong, double))
    columns = ("status", "trials", "right branch", "wrong branch", "of these f/2 or 2f")
    return Table("Verdict against truth", columns, tuple(rows))


def by_lead(found: list[Outcome]) -> Table:
    """How often the best branch is wrong, by its lead."""
    edges = (-np.inf, 2, 5, 10, 25, 50, 100, np.inf)
    rows = []
    for low, high in itertools.pairwise(edges):
        mine = [o for o in found if low <= o.lead < high]
        rows.append((f"{low:g} ... {high:g}", len(mine), sum(not o.right for o in mine)))
    return Table("Lead of the best branch", ("lead", "trials", "wrong"), tuple(rows))


def _either(error: Floats, true_mm: Floats, share: float, mm: float) -> Bools:
    """Whether each error is within a share of the true amplitude or so many mm."""
    return np.asarray(np.abs(error) <= np.maximum(share * true_mm, mm))


def _within(what: str, asked: str, good: Bools) -> Goal:
    """The share of confirmed trials of 1 mm and more that meet a goal; 95 % are asked for."""
    share = 100 * float(np.mean(good)) if good.size else float("nan")
    return Goal(what, f"{asked} in 95 %", f"{share:.0f} % of {good.size}", bool(share >= 95))


def _sound(found: list[Outcome]) -> list[Outcome]:
    """Confirmed and right, 1 mm or more."""
    confirmed = LineStatus.CONFIRMED
    return [o for o in found if o.status is confirmed and o.right and o.amplitude_mm >= 1.0]


def errors(found: list[Outcome]) -> Table:
    """Errors and errors over sigma of the confirmed trials of 1 mm or more."""
    mine = _sound(found)
    rows = []
    for k, name in enumerate(NAMES):
        e = np.array([o.error[k] for o in mine])
        z = np.array([o.z[k] for o in mine])
        if e.size:
            rows.append((name, rms(e), float(np.nanquantile(np.abs(e), 0.95)), rms(z), robust(z)))
    columns = ("quantity", "error, rms", "95 % of |error|", "error over sigma, rms", "robust")
    return Table("Errors of confirmed trials of at least 1 mm", columns, tuple(rows))


def rms(values: Floats) -> float:
    """Root mean square of what is known, NaN of nothing."""
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if known.size else float("nan")


def robust(values: Floats) -> float:
    """1.4826 times the median size of what is known."""
    known = values[np.isfinite(values)]
    return 1.4826 * float(np.median(np.abs(known))) if known.size else float("nan")


def goals(found: list[Outcome], claims: int, quiet: int) -> tuple[Goal, ...]:
    """The rows of the goals that projected points can measure."""
    confirmed = [o for o in found if o.status is LineStatus.CONFIRMED]
    wrong = sum(not o.right for o in confirmed)
    asked = [o for o in found if o.asked]
    share = np.mean([o.status is LineStatus.CONFIRMED for o in asked]) if asked else np.nan
    mine = _sound(found)
    e = np.array([o.error for o in mine]).reshape(-1, len(NAMES))
    z = np.array([o.z for o in mine]).reshape(-1, len(NAMES))
    true = np.array([o.true_mm for o in mine]).reshape(-1, 2)
    seconds = np.array([o.seconds / o.markers * 10.0 / SECONDS for o in found])
    worst = [rms(z[:, k]) for k in range(len(NAMES))]
    enough = len(confirmed) >= 3000
    return (
        Goal(
            "wrong branch among confirmed",
            "0 of >= 3000",
            f"{wrong} of {len(confirmed)}",
            False if wrong else (True if enough else None),
        ),
        Goal(
            "confirmed where amplitude, anchor and zone permit",
            ">= 80 %",
            f"{100 * share:.0f} % of {len(asked)}",
            bool(share >= 0.8),
        ),
        Goal(
            "claimed with nothing to tell by",
            "0",
            f"{claims} of {quiet}",
            claims == 0,
        ),
        Goal("frequency, rms", "5 mHz", f"{1e3 * rms(e[:, 0]):.2f} mHz", rms(e[:, 0]) <= 5e-3),
        _within("offset", "50 us", np.abs(e[:, 1]) <= 50e-6),
        Goal("row time, rms", "2 %", f"{100 * rms(e[:, 2]):.2f} %", rms(e[:, 2]) <= 0.02),
        _within("amplitude", "2 % or 30 um", _either(e[:, 3], true[:, 0], 0.02, 0.03)),
        _within("depth", "5 % or 60 um", _either(e[:, 4], true[:, 1], 0.05, 0.06)),
        Goal(
            "error over sigma, rms",
            "0.8-1.3",
            ", ".join(f"{w:.2f}" for w in worst),
            all(0.8 <= w <= 1.3 for w in worst),
        ),
        Goal(
            "seconds per marker and 10 s, blind (processor time)",
            "<= 5 s",
            f"median {np.median(seconds):.1f}, 95 % {np.quantile(seconds, 0.95):.1f}",
            bool(np.quantile(seconds, 0.95) <= 5.0),
        ),
    )
