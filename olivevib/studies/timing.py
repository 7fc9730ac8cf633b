"""How far the whole chain tells frequency, motion and timing above the frame rate, on pictures.

Each cell is a trial that is rendered (rolling shutters, distortion, compressed MJPEG), calibrated
from its own rendered board and measured like any other; nothing of the truth is told but what a
technician would know. Frequencies, offsets and amplitudes are drawn outside the zones in which
nothing is claimed, beside some inside. A cell costs a minute or more and is kept (studies.cells).
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from olivevib import pipeline
from olivevib.pipeline.simulated import plan_of, truth_folder
from olivevib.planning import Setup, outlook
from olivevib.progress import Tick
from olivevib.simulation import Clock, Optics, Phases, scenario, simulate
from olivevib.simulation.scenarios import BoardPlan, CameraPlan, MarkerPlan, Scenario, Shaking
from olivevib.studies import cells
from olivevib.studies.study import Cell, Chart, Curve, Effort, Goal, Study, Table
from olivevib.trial import Trial

TRIALS = 60
SECONDS = 9.0
ROWS = 720
LEAST_MM = {10: 1.3, 20: 0.7, 30: 0.5}


@dataclass(frozen=True)
class Draw:
    """One trial: frequency, readout and offset in ms, amplitude of the trunk, exposure in ms."""

    seed: int
    f_hz: float
    readout_ms: int
    offset_ms: float
    amplitude_mm: float
    exposure_ms: float


@dataclass(frozen=True)
class Outcome:
    """What came of it; errors are medians of magnitudes over the markers, NaN: not given."""

    status: str
    f_error_hz: float
    wrong: bool
    amplitude_percent: float
    amplitude_mm: float
    depth_percent: float
    depth_mm: float
    phase_deg: float
    offset_us: float
    row_time_percent: float
    z_amplitude: float
    naive_depth_mm: float
    seconds: float
    reason: str


def run(effort: Effort, tick: Tick) -> Study:
    """Measure the cells that are not kept yet, then table them."""
    count = effort.count(TRIALS)
    draws = [draw(effort, k) for k in range(count)]
    rows = []
    for k, one in enumerate(draws):
        tick(k, count, f"{one.f_hz:.2f} Hz, {one.readout_ms} ms, {one.offset_ms:.1f} ms apart")
        rows.append((one, kept(one, tick)))
    tick(count, count, "timing")
    return _study(rows)


def draw(effort: Effort, number: int) -> Draw:
    """Trial ``number``: readouts in turn; half with the cameras 8–13 ms apart, half in step."""
    rng = effort.draws(63, number)
    readout = (10, 20, 30)[number % 3]
    offset = float(rng.uniform(8.0, 13.0)) if number % 2 else 0.0
    setup = Setup(readout_s=readout * 1e-3, offset_s=offset * 1e-3)
    while True:
        f = float(rng.uniform(5.0, 40.0))
        if outlook(setup, f).zone is None:
            break
    amplitude = float(rng.uniform(LEAST_MM[readout], 4.0))
    exposure = 6.0 if number % 10 == 9 and f < 40 else min(2.0, 50.0 / f)
    return Draw(
        1000 + number, round(f, 3), readout, round(offset, 2), round(amplitude, 2), exposure
    )


def kept(one: Draw, tick: Tick) -> Outcome:
    """The cell from the folder of cells, else measured now and kept."""
    name = f"{one.seed}-{one.f_hz:g}-{one.readout_ms}-{one.offset_ms:g}-{one.exposure_ms:.2f}"
    found = cells.kept("timing", name, asdict(one), lambda: asdict(measured(one, tick)))
    return Outcome(**found)


def scene_of(one: Draw) -> Scenario:
    """The scenario of a draw: four markers of 60 mm, board in stills, two seconds of rest."""
    row = one.readout_ms * 1e-3 / ROWS
    shaking = Shaking(
        one.f_hz, Phases(1.5, 0.8, SECONDS - 0.4, 0.3), one.amplitude_mm, 0.1, sway_mm=3.0
    )
    return replace(
        scenario("beyond"),
        name="timing",
        seconds=SECONDS,
        what=shaking,
        markers=MarkerPlan(ids=(1, 2, 3, 4), size_mm=(58.0, 62.0), tilt_deg=(0.0, 30.0)),
        board=BoardPlan(views=24, video_fps=None),
        cameras=CameraPlan(
            optics=Optics(exposure_s=one.exposure_ms * 1e-3),
            right=Clock(offset_s=one.offset_ms * 1e-3),
            row_time_s=(row, row),
        ),
        sensor=None,
    )


def measured(one: Draw, tick: Tick) -> Outcome:
    """Render, calibrate, track, reconstruct, analyse one trial, and compare with its truth."""
    with TemporaryDirectory() as place:
        folder = Path(place) / "trial"
        recorded = simulate(Path(place) / "made", scene_of(one), one.seed, tick)
        trial = pipeline.new_trial(folder, plan_of(recorded), tick)
        recorded.truth.rename(truth_folder(folder))
        rng = np.random.default_rng([one.seed, 1])
        row_us = one.readout_ms * 1e3 / ROWS
        told = {}
        for side in ("left", "right"):
            told[f"cameras.{side}.row_time_us"] = row_us * (1 + 0.02 * float(rng.standard_normal()))
            told[f"cameras.{side}.row_time_sigma_us"] = 0.02 * row_us
        trial = trial.changed(told)
        for stage in (pipeline.calibrate, pipeline.track):
            stage(trial.reopen(), tick)
        naive = _naive_depth(trial, one, tick)
        start = time.process_time()
        pipeline.reconstruct(trial.reopen(), tick)
        seconds = time.process_time() - start
        pipeline.analyse(trial.reopen(), tick)
        return _outcome(trial.reopen(), recorded.stage, one, naive, seconds)


def _naive_depth(trial: Trial, one: Draw, tick: Tick) -> float:
    """Largest depth amplitude, mm, of the paper's synchronous pairs minus the truth's, median."""
    paper = trial.reopen().changed({"reconstruction.paper": True})
    pipeline.reconstruct(paper, tick)
    path = paper.reopen().trajectory
    trial.reopen().changed({"reconstruction.paper": False})
    if path is None:
        return float("nan")
    steady = (path.t_s > 2.5) & (path.t_s < SECONDS - 0.5)
    spread = np.nanstd(path.xyz_mm[steady, :, 2], axis=0) * np.sqrt(2)
    return float(np.median(spread))


def _outcome(trial: Trial, stage: object, one: Draw, naive: float, seconds: float) -> Outcome:
    from olivevib.simulation.motion import Shake

    result, reconstruction = trial.vibration, trial.reconstruction
    nan = float("nan")
    table: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    status, f, reason = "none", nan, ""
    for marker in stage.markers:  # type: ignore[attr-defined]
        row = result.row(marker.id) if result else None
        shake = next(t for t in marker.body.motion.terms if isinstance(t, Shake))
        if row is not None:
            status, f = row.line.status.value, row.line.f_hz
            reason = row.line.reasons[0] if row.line.reasons else ""
            phasor = row.line.amplitude * np.exp(1j * row.line.phase_rad)
            true = shake.cos[:3] - 1j * shake.sin[:3]
            table.append((phasor, true, row.line.amplitude_sigma))
    decided = status in ("confirmed", "supported", "direct")
    error = abs(f - one.f_hz) if decided else nan
    wrong = bool(decided and error > 0.5)
    fit = reconstruction.motion if reconstruction else None
    if not decided or wrong or fit is None or not fit.markers or not table:
        return Outcome(
            *(status, error, wrong, *(nan,) * 8, naive, seconds, reason)
        )  # fmt: skip
    timing, true_row = fit.timing, one.readout_ms * 1e-3 / ROWS
    return Outcome(
        status,
        error,
        wrong,
        *_motion_errors(table),
        offset_us=1e6 * (timing.right_offset_s - one.offset_ms * 1e-3),
        row_time_percent=100 * (timing.left_row_time_s / true_row - 1),
        z_amplitude=_z(table),
        naive_depth_mm=naive,
        seconds=seconds,
        reason=reason,
    )


def _motion_errors(
    table: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]],
) -> tuple[float, float, float, float, float]:
    """Amplitude (%, mm) on the largest axis across, depth (%, mm), phase between markers (deg)."""
    across, depth, turn = [], [], []
    for phasor, true, _ in table:
        k = int(np.argmax(np.abs(true[:2])))
        d = abs(phasor[k]) - abs(true[k])
        across.append((100 * d / abs(true[k]), d))
        d = abs(phasor[2]) - abs(true[2])
        depth.append((100 * d / abs(true[2]), d))
        turn.append(np.angle(phasor[k] / true[k]))
    a, z = np.median(np.abs(across), axis=0), np.median(np.abs(depth), axis=0)
    relative = np.degrees(np.abs(np.angle(np.exp(1j * (np.array(turn) - turn[0])))))
    phase = float(relative[1:].max()) if len(turn) > 1 else 0.0
    return float(a[0]), float(a[1]), float(z[0]), float(z[1]), phase


def _z(table: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> float:
    z = [(np.abs(p) - np.abs(t)) / s for p, t, s in table]
    return float(np.sqrt(np.nanmean(np.square(z))))


def _study(rows: list[tuple[Draw, Outcome]]) -> Study:
    columns = (
        *("Hz", "readout ms", "apart ms", "mm", "exposure ms", "status", "error mHz"),
        *("amplitude %", "depth %", "depth mm", "phase deg", "offset us", "row time %", "z"),
        *("naive depth mm", "s"),
    )
    table = tuple(_row(d, o) for d, o in rows)
    return Study(
        name="timing",
        title="Above the frame rate: rendered trials through the whole chain, 30 frames/s",
        tables=(Table("Trials", columns, table), _verdicts(rows)),
        charts=(_chart(rows),),
        goals=_goals(rows),
        facts=(
            ("trials", str(len(rows))),
            ("row time told", "drawn from its sigma of 2 %"),
            ("offset told", "nothing"),
        ),
    )


def _row(d: Draw, o: Outcome) -> tuple[Cell, ...]:
    return (
        *(d.f_hz, d.readout_ms, d.offset_ms, d.amplitude_mm, d.exposure_ms, o.status),
        *(1e3 * o.f_error_hz, o.amplitude_percent, o.depth_percent, o.depth_mm, o.phase_deg),
        *(o.offset_us, o.row_time_percent, o.z_amplitude, o.naive_depth_mm, o.seconds),
    )


def _verdicts(rows: list[tuple[Draw, Outcome]]) -> Table:
    words = sorted({o.status for _, o in rows})
    table = tuple(
        (w, sum(o.status == w for _, o in rows), sum(o.status == w and o.wrong for _, o in rows))
        for w in words
    )
    return Table("Verdict against the truth", ("status", "trials", "wrong branch"), table)


def _chart(rows: list[tuple[Draw, Outcome]]) -> Chart:
    order = np.argsort([d.f_hz for d, _ in rows])
    f = np.array([rows[k][0].f_hz for k in order])
    curves = (
        Curve("amplitude, %", f, np.array([rows[k][1].amplitude_percent for k in order])),
        Curve("depth, %", f, np.array([rows[k][1].depth_percent for k in order])),
    )
    return Chart("error", "Error of amplitudes", "frequency, Hz", "error, %", curves, log_y=True)


def _goals(rows: list[tuple[Draw, Outcome]]) -> tuple[Goal, ...]:
    sharp = [(d, o) for d, o in rows if d.f_hz * d.exposure_ms * 1e-3 <= 0.0501]
    blurred = [o for d, o in rows if d.f_hz * d.exposure_ms * 1e-3 > 0.0501]
    confirmed = [o for _, o in rows if o.status == "confirmed"]
    shares = [o.status == "confirmed" for _, o in rows]
    across = [o for d, o in sharp if d.amplitude_mm >= 1]
    return (
        Goal(
            "wrong branch among confirmed, rendered",
            "0 in >= 60",
            f"{sum(o.wrong for o in confirmed)} in {len(confirmed)}",
            False if any(o.wrong for o in confirmed) else (True if len(confirmed) >= 60 else None),
        ),
        _at_least("confirmed where permitted", 80.0, 100 * float(np.mean(shares)), "%"),
        _worst("frequency, steady", [1e3 * o.f_error_hz for _, o in sharp], 5.0, "mHz"),
        _either(
            "amplitude, >= 1 mm",
            [(o.amplitude_percent, 1e3 * o.amplitude_mm) for o in across],
            (2.0, 30.0),
        ),
        _either("depth", [(o.depth_percent, 1e3 * o.depth_mm) for o in across], (5.0, 60.0)),
        _worst("phase between markers", [o.phase_deg for o in across], 2.0, "deg"),
        _worst("offset at the mean row", [abs(o.offset_us) for _, o in sharp], 50.0, "us"),
        _worst("row time", [abs(o.row_time_percent) for _, o in sharp], 2.0, "%"),
        _worst("amplitude at 6 ms exposure", [o.amplitude_percent for o in blurred], 5.0, "%"),
    )


def _worst(what: str, values: Sequence[float], most: float, unit: str) -> Goal:
    """The 90th percentile and the worst of what was given."""
    known = np.array([v for v in values if math.isfinite(v)])
    if not known.size:
        return Goal(what, f"{most:g} {unit}", "no decided trial", None)
    typical = float(np.percentile(known, 90))
    words = f"{typical:.3g} {unit} (90 %), worst {known.max():.3g}, {known.size} trials"
    return Goal(what, f"{most:g} {unit}", words, bool(typical <= most))


def _either(what: str, pairs: Sequence[tuple[float, float]], most: tuple[float, float]) -> Goal:
    known = [(p, u) for p, u in pairs if math.isfinite(p)]
    asked = f"{most[0]:g} % or {most[1]:g} um"
    if not known:
        return Goal(what, asked, "no decided trial", None)
    good = [p <= most[0] or u <= most[1] for p, u in known]
    median = float(np.median([p for p, _ in known]))
    words = f"{sum(good)} of {len(good)} trials, median {median:.2f} %"
    return Goal(what, asked, words, bool(np.mean(good) >= 0.9))


def _at_least(what: str, least: float, value: float, unit: str) -> Goal:
    return Goal(what, f">= {least:g} {unit}", f"{value:.0f} {unit}", value >= least)
