"""Are the sigmas true, and as small as they can be: parameters, points in space, the latency."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from olivevib.arrays import Bools, Floats
from olivevib.calibration import BoardView, CalibrationSettings, calibrate, point_sigma
from olivevib.calibration.calibrate import fit_all, make_pair_checked
from olivevib.calibration.choice import choose
from olivevib.calibration.gather import published_rig
from olivevib.calibration.rigid import triangulate
from olivevib.calibration.solve import grams, reduce
from olivevib.calibration.uncertainty import firm_inverse, uncertainty
from olivevib.geometry import StereoRig
from olivevib.progress import Tick
from olivevib.studies.calibration import lens_alone, scenes
from olivevib.studies.study import Cell, Effort, Goal, Study, Table

NOISE_PX = (0.05, 0.1, 0.2)
VIEWS, TRIALS, PAIRS, LAGS = 10, 150, 300, 12
WORST_OF = 2.0  # sigmas by which the worst of twelve departs by chance
PARAMETERS = ("fx", "fy", "cx", "cy", "k1", "k2")


def run(effort: Effort, tick: Tick) -> Study:
    """Draws of noise on fixed views (bound), of whole recordings (points, latency)."""
    lenses, goals = _lenses(effort, tick)
    points, more = _points(effort, tick)
    lags, last = _lags(effort, tick)
    return Study(
        name="calibration-honesty",
        title="Sigmas of the calibration against what is observed, and against the bound",
        tables=(lenses, points, lags),
        goals=(*goals, *more, *last),
    )


def _lenses(effort: Effort, tick: Tick) -> tuple[Table, list[Goal]]:
    """Sd over the information bound, bias, and the share within two published sigma."""
    trials = effort.count(TRIALS, 4)
    rows: list[tuple[Cell, ...]] = []
    inside: list[Bools] = []
    ratios, biases = [], []  # by lens and noise, of the four parameters in px
    for n, (name, (k1, k2)) in enumerate(scenes.LENSES.items()):
        true = scenes.camera(990.0, k1, k2, (645.0, 352.0))
        for noise in NOISE_PX:
            tick(n, len(scenes.LENSES), f"lens {name}, {noise} px")
            rng = effort.draws(90, n, round(100 * noise))
            clean = scenes.tilted(true, scenes.grid(), VIEWS, 1e-9, rng)
            found, z, bound = [], [], np.zeros(6)
            for _ in range(trials):
                views = [
                    replace(v, px=v.px + noise * rng.standard_normal(v.px.shape),
                            sigma_px=np.full(v.ids.size, noise))
                    for v in clean
                ]  # fmt: skip
                lens, cov = lens_alone.with_sigma(views, scenes.SIZE)
                found.append(lens)
                z.append((lens - true.lens) / np.sqrt(np.diag(cov)))
                if not bound.any():
                    bound = information_bound(views)
            values = np.array(found)
            sd, bias = values.std(axis=0, ddof=1), values.mean(axis=0) - true.lens
            ratio, off = sd / bound, np.abs(bias) / sd
            inside.append(np.asarray(np.abs(np.array(z)) < 2))
            ratios.append(ratio[:4])
            biases.append(bias[:4] / sd[:4])
            rows.append((name, noise, round(float(sd[0]), 2), round(float(bound[0]), 2),
                         *(round(float(v), 2) for v in ratio), round(float(off[:4].max()), 2),
                         round(100 * float(inside[-1].mean()), 1)))  # fmt: skip
    share, draws = 100 * float(np.mean(np.concatenate(inside))), sum(i.size for i in inside)
    held = f"{share:.1f} % of {draws}"
    columns = (
        *("lens", "noise px", "sd fx", "bound fx", *(f"{p} sd/bound" for p in PARAMETERS)),
        *("largest bias/sd", "within 2 sigma %"),
    )
    note = f"25 points, {VIEWS} views, {trials} draws of noise; the bound holds our priors"
    shape, each = (len(scenes.LENSES), len(NOISE_PX), 4), len(NOISE_PX) * trials
    worst_sd = float(np.sqrt((np.reshape(ratios, shape) ** 2).mean(axis=1)).max())
    worst_bias = float(np.abs(np.reshape(biases, shape).mean(axis=1)).max())
    goals = [
        Goal("parameters within 2 sigma", "93-97 %", held, 93 <= share <= 97),
        Goal("sd over the bound, worst of a lens and parameter over the noises", "<= 1.1",
             f"{worst_sd:.2f} (chance: {1 + WORST_OF / np.sqrt(2 * each):.2f})", worst_sd <= 1.1),
        Goal("bias over sd, worst of a lens and parameter over the noises", "< 0.15",
             f"{worst_bias:.2f} (chance: {WORST_OF / np.sqrt(each):.2f})", worst_bias < 0.15),
    ]  # fmt: skip
    return Table("One lens", columns, tuple(rows), note), goals


def information_bound(views: Sequence[BoardView]) -> Floats:
    """Smallest sd (6,) of the lens that these views and the weak priors allow (Cramer-Rao)."""
    fit = lens_alone.fit(views, scenes.SIZE)
    claimed = replace(
        fit.problem,
        observations=replace(
            fit.problem.observations, sigma_px=fit.problem.observations.sigma_px / fit.scale
        ),
        huber=1e9,
    )
    state = fit.solution.state
    reduced = reduce(claimed, state, grams(claimed, state)[0])
    sd = np.sqrt(np.diag(firm_inverse(reduced.total_H)))
    return np.asarray(sd[:6], dtype=np.float64)


def _points(effort: Effort, tick: Tick) -> tuple[Table, list[Goal]]:
    """Predicted and observed errors of points 1.2 m away, the rig's part alone."""
    rig = scenes.converging("0.10/-0.20")
    points = np.array([[x, y, 1200.0] for x in (-150, 0, 150) for y in (-80, 80)])
    trials = effort.count(PAIRS, 3)
    errors, predicted = [], []
    for trial in range(trials):
        tick(trial, trials, "points in space")
        left, right = scenes.waved(rig, scenes.Waving(15.0, 4.0), effort.draws(91, trial))
        found = _solved(left, right)
        xyz, _, _ = triangulate(
            found, rig.left.project(points), rig.right.project(rig.to_right(points))
        )
        errors.append(xyz - points)
        predicted.append(point_sigma(found, points, (0.1, 0.1)).common_mm)
    observed = np.sqrt(np.mean(np.square(errors), axis=(0, 1)))
    told = np.sqrt(np.mean(np.square(predicted), axis=(0, 1)))
    ratio = told / observed
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (axis, round(float(o), 3), round(float(p), 3), round(float(r), 3))
        for axis, o, p, r in zip("xyz", observed, told, ratio, strict=True)
    )
    words = "/".join(f"{r:.2f}" for r in ratio)
    chance = 1 / np.sqrt(2 * trials)
    goal = Goal("predicted over observed 3-D sigma, x/y/z", "0.9-1.1",
                f"{words} (chance: ± {chance:.2f})",
                bool((np.abs(ratio - 1) <= 0.1).all()))  # fmt: skip
    columns = ("axis", "observed rms mm", "predicted mm", "ratio")
    note = f"{trials} recordings of 60 frames, 0.1 px, base 420 mm"
    return Table("Points 1.2 m away", columns, rows, note), [goal]


def _solved(left: Sequence[BoardView], right: Sequence[BoardView]) -> StereoRig:
    """The pair of ``calibrate`` for cameras in step, without its tests on unused frames."""
    settings = CalibrationSettings(estimate_lag=False)
    pair = make_pair_checked(left, right, (scenes.SIZE, scenes.SIZE), settings)
    fit = fit_all(choose(pair, settings).pair, settings).fit
    return published_rig(fit, uncertainty(fit.problem, fit.solution))


def _lags(effort: Effort, tick: Tick) -> tuple[Table, list[Goal]]:
    """Error of the latency at 30 frames/s: global shutter, and an unknown read-out of 25 ms."""
    rig = scenes.converging("0.10/-0.20")
    trials = effort.count(LAGS, 1)
    rows: list[tuple[Cell, ...]] = []
    goals = []
    for name, readout, most in (("global shutter", 0.0, 0.05), ("unknown 25 ms", 0.025, 0.3)):
        off, claimed = [], []
        for trial in range(trials):
            tick(trial, trials, f"latency, {name}")
            how = scenes.Waving(20.0, 30.0, 0.1, 0.0123, readout)
            left, right = scenes.waved(rig, how, effort.draws(92, trial))
            result = calibrate(left, right, scenes.SIZE, scenes.SIZE)
            off.append(1e3 * (-result.right_offset_s - 0.0123))
            claimed.append(1e3 * result.right_offset_sigma_s)
        rms = float(np.sqrt(np.mean(np.square(off))))
        rows.append((name, trials, round(rms, 4), round(float(np.mean(off)), 4),
                     round(float(np.mean(claimed)), 4)))  # fmt: skip
        goals.append(Goal(f"latency, 30 frames/s, {name}", f"<= {most} ms", f"{rms:.3f} ms",
                          rms <= most))  # fmt: skip
    columns = ("shutter", "recordings", "rms error ms", "bias ms", "claimed ms")
    return Table("Latency between the cameras", columns, tuple(rows)), goals
