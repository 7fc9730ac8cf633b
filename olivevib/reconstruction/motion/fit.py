"""The door: observations of both cameras to the motion of all markers and its verdict."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from olivevib.arrays import Floats
from olivevib.geometry import StereoRig
from olivevib.progress import Tick, silent
from olivevib.reconstruction.motion import branches as br
from olivevib.reconstruction.motion.decide import Decision, Facts, decide, keeps_branch
from olivevib.reconstruction.motion.exposure import blur_gains, gain_shares
from olivevib.reconstruction.motion.finish import (
    degrees_of_freedom,
    markers_of,
    relinearise,
    timing_of,
    with_gain_sigma,
)
from olivevib.reconstruction.motion.free import fit_free
from olivevib.reconstruction.motion.growth import growth_of, told_growth, with_growth_sigma
from olivevib.reconstruction.motion.offset import WEAK_S
from olivevib.reconstruction.motion.prepare import (
    time_prior,
)
from olivevib.reconstruction.motion.prepared import (
    Prepared,
    band_of,
    candidate_frequencies,
    growing,
    prepare,
)
from olivevib.reconstruction.motion.sightings import Observations
from olivevib.reconstruction.motion.solve import SHARED, Branch, Model, settle, with_frequency
from olivevib.reconstruction.motion.strays import Seen, stray_of
from olivevib.reconstruction.motion.types import (
    Anchor,
    BranchTable,
    MarkerMotion,
    MotionFit,
    MotionSettings,
)
from olivevib.reconstruction.motion.wander import pace_of, weigh_paces

DRAWING_SHARE = 1e-3  # of a row time: so well, down to 32 px, a fitted drawing tells a slant
NEAR_S = 4e-3  # sigma of an offset that a fit found a valley away from its start
WORSE = 1.3  # noise or chi2 above which a wandering speed is looked for


def fit_motion(
    observations: Observations,
    rig: StereoRig,
    clock: Anchor,
    settings: MotionSettings | None = None,
    tick: Tick = silent,
) -> MotionFit:
    """Fit sway and harmonics of every marker to the pixels of both cameras at their own times.

    clock: what is known of row times and offset from elsewhere. Nothing here looks at an
    accelerometer. Raises ValueError where no marker can be fitted.
    """
    settings = settings or MotionSettings()
    if not settings.periodic:
        return fit_free(observations, rig, clock, settings)
    return _fit_periodic(prepare(observations, rig, clock, settings), tick)


def _fit_periodic(ready: Prepared, tick: Tick, lost: bool = False) -> MotionFit:
    """lost: the offset was searched for before, and sway did not show it."""
    observations, rig = ready.observations, ready.rig
    clock, settings = ready.anchor, ready.settings
    lost = lost or not ready.offset_found
    candidates = candidate_frequencies(ready)
    weighed = br.weigh(ready.model, candidates, ready.offset_sigma_s, tick)
    model, best = refine(ready, ready.model, weighed.branches[0])
    kind, pace = "steady", None
    if chi2_of(model, best) > WORSE or ready.pixels.scale > WORSE:
        span, knot = (ready.start_s, ready.end_s), ready.pixels.knot_s
        peak = ready.pixels.peaks_hz[0]
        pace = pace_of(observations, knot, span, peak)
        grown = growth_of(observations, knot, span, peak)
        if pace is not None and pace.gain > max(WORSE, grown.gain):
            again = prepare(observations, rig, clock, settings, pace.phase)
            rate, sigma = observations.frame_rate_hz, again.offset_sigma_s
            followed = weigh_paces(again.model, pace, rate, band_of(ready), sigma, tick)
            if followed is not None:
                trial = refine(again, followed[0], followed[1].branches[0])
                if misfit(again, *trial) < misfit(ready, model, best):
                    ready, kind, weighed, (model, best) = again, "wandering", followed[1], trial
        elif grown.gain > WORSE:
            ready = growing(ready, grown)
            weighed = br.weigh(ready.model, candidates, ready.offset_sigma_s, tick)
            model, best = refine(ready, ready.model, weighed.branches[0])
    if clock.right_offset_sigma_s > WEAK_S:
        before = float(best.theta[1])
        best, slips = br.unslipped(with_open_offset(ready, model), best)
        ready = replace(ready, offset_found=ready.offset_found and not slips)
        if abs(best.theta[1] - before) > 0.25 / best.theta[0]:  # all was weighed at other times
            return _from_offset(ready, best, tick, lost)
        model, best = refine(ready, model, best)
    fast, stray = 0.0 if pace is None else pace.ridge.fastest_hz_s, ""
    if pace is not None and kind == "wandering":
        stray = stray_of(model, best, pace.ridge, pace.span, observations.frame_rate_hz)
    return finished(ready, (model, best), weighed, kind, Seen(fast, lost, stray))


def _from_offset(ready: Prepared, best: Branch, tick: Tick, lost: bool) -> MotionFit:
    """Everything anew from the offset of a branch."""
    rows = ready.observations.reference_row - ready.anchor.reference_row
    offset = float(best.theta[1] - rows * (best.theta[4] - best.theta[3]))
    near = replace(ready.anchor, right_offset_s=offset, right_offset_sigma_s=NEAR_S)
    again = prepare(ready.observations, ready.rig, near, ready.settings)
    fit = _fit_periodic(again, tick, lost)
    timing = replace(fit.timing, offset_slip=not ready.offset_found)
    return replace(fit, anchor=ready.anchor, timing=timing)


def with_open_offset(ready: Prepared, model: Model) -> Model:
    """The model that takes any offset of the search for equally likely."""
    row = ready.observations.reference_row
    loose = time_prior(ready.anchor, row, ready.settings.offset_search_s)[1]
    precision = model.precision.copy()
    precision[:SHARED, :SHARED] = loose
    return replace(model, precision=precision)


def refine(ready: Prepared, model: Model, branch: Branch) -> tuple[Model, Branch]:
    """Linearise about the branch's own motion and settle again."""
    largest = max(
        float(np.linalg.norm(np.hypot(*c.harmonic[0, :, :3]))) for c in branch.coefficients
    )
    f, size_px = float(branch.theta[0]), largest * _px_per_mm(ready)
    gain = blur_gains(ready.observations, ready.settings, f, size_px)[0]
    again = relinearise(model, branch, ready.observations, ready.rig, ready.poses, ready.whites)
    again = replace(with_frequency(again, float(branch.theta[0])), gain=gain)
    return again, settle(again, branch.theta)


def chi2_of(model: Model, branch: Branch) -> float:
    """Of the fit over the measured noise."""
    return branch.chi2 / degrees_of_freedom(model)


def misfit(ready: Prepared, model: Model, branch: Branch) -> float:
    """Chi2 over the localiser's own noise: comparable between models that measured theirs."""
    return chi2_of(model, branch) * ready.pixels.scale**2


def table_of(ready: Prepared, weighed: br.Weighed, chi2: float, f_hz: float) -> BranchTable:
    """The branch table, log evidence divided by chi2 where that is above 1; f_hz: of the best."""
    rows = weighed.branches
    evidence = np.array([b.evidence for b in rows]) / max(1.0, chi2)
    evidence = evidence - evidence[0]
    share = np.exp(evidence - evidence.max())
    scale = np.array([b.theta[3] for b in rows]) / (ready.anchor.left_row_time_s or np.nan)
    return BranchTable(
        np.array([f_hz, *(b.theta[0] for b in rows[1:])]),
        evidence,
        share / share.sum(),
        np.array([b.theta[1] for b in rows]),
        scale,
    )


def finished(
    ready: Prepared,
    fitted: tuple[Model, Branch],
    weighed: br.Weighed,
    kind: str,
    seen: Seen,
) -> MotionFit:
    """Motions, covariance, verdict."""
    model, best = fitted
    chi2 = chi2_of(model, best)
    scale = max(1.0, chi2) * ready.pixels.learned
    plain = (False,) * ready.settings.harmonics
    markers, timing = markers_of(model, best, ready.observations, ready.poses, plain, scale)
    strongest = max(markers, key=lambda m: float(np.abs(m.cosine[0] + 1j * m.sine[0])[:3].max()))
    amplitude = np.abs(strongest.cosine[0] + 1j * strongest.sine[0])[:3]
    grown = told_growth(model, best, scale) if kind == "steady" else None
    f_hz = float((best if grown is None else grown.branch).theta[0])
    facts = Facts(  # as weighed, but for the frequency: a growth that is told may hide a misfit
        table=table_of(ready, weighed, chi2, f_hz),
        rate_hz=ready.observations.frame_rate_hz,
        span_s=ready.end_s - ready.start_s,
        offset_s=float(best.theta[1]),
        knot_s=model.knots.step_s,
        chi2=chi2,
        noise_scale=ready.pixels.scale,
        strength=br.strength(model, best) / max(1.0, chi2),
        amplitude_mm=amplitude,
        sigma_mm=strongest.amplitude_sigma()[0, :3],
        fast_hz_s=seen.fast_hz_s,
        beside=ready.pixels.beside if kind == "steady" else 0.0,
        offset_lost=seen.offset_lost,
        stray=seen.stray,
        row_sigmas=_row_sigmas(ready.anchor, best.theta[3:5]),
    )
    decision = decide(facts, ready.anchor, ready.settings)
    if grown is not None:
        model, best = grown.model, grown.branch
        parts = markers_of(model, best, ready.observations, ready.poses, plain, scale)
        markers, timing = with_growth_sigma(parts, grown)
    return _result(ready, model, best, facts, decision, (markers, timing, kind))


def _row_sigmas(anchor: Anchor, rows_s: Floats) -> float:
    """How far the row times (2,) lie from the anchor's, both together, in its sigmas."""
    told = np.array([anchor.left_row_time_s, anchor.right_row_time_s])
    sigma = np.array([anchor.left_row_time_sigma_s, anchor.right_row_time_sigma_s])
    known = np.isfinite(sigma) & (sigma > 0)
    return float(np.linalg.norm((rows_s - told)[known] / sigma[known]))


def _result(
    ready: Prepared,
    model: Model,
    best: Branch,
    facts: Facts,
    decision: Decision,
    parts: tuple[tuple[MarkerMotion, ...], Floats, str],
) -> MotionFit:
    markers, covariance, kind = parts
    theta, row = best.theta, ready.observations.reference_row
    f = float(theta[0])
    timing = timing_of(theta, row, _with_drawing(ready, covariance, theta))
    timing = replace(
        timing, row_time_keeps=keeps_branch(f, facts.rate_hz), offset_slip=not ready.offset_found
    )
    pixel_amplitude = float(np.linalg.norm(facts.amplitude_mm)) * _px_per_mm(ready)
    _, refused = blur_gains(ready.observations, ready.settings, f, pixel_amplitude)
    share = gain_shares(ready.observations, ready.settings, f, pixel_amplitude)
    psi = model.psi
    return MotionFit(
        kind=kind,
        markers=tuple(with_gain_sigma(replace(m, blind=decision.blind), share) for m in markers),
        timing=timing,
        branches=facts.table,
        status=decision.status,
        reasons=decision.reasons,
        next_time=decision.next_time,
        anchor=ready.anchor,
        noise_scale=ready.pixels.scale,
        noise_source="pixels" if ready.pixels.noise[0][1] > 0 else "localiser",
        chi2=facts.chi2,
        first_knot_s=model.knots.first_s,
        knot_s=model.knots.step_s,
        start_s=ready.start_s,
        end_s=ready.end_s,
        shift_s=row * float(theta[3]),
        psi=theta[5:] if psi is not None else np.empty(0),
        psi_first_s=psi.first_s if psi is not None else 0.0,
        psi_knot_s=psi.step_s if psi is not None else 0.5,
        growth=model.growth,
        amplitude_refused=refused,
    )


def _with_drawing(ready: Prepared, covariance: Floats, theta: Floats) -> Floats:
    """The covariance (5, 5) of TIMING with what fitted drawings may add to the row times."""
    drawn = any(m.left.drawn is not None for m in ready.observations.markers)
    share = DRAWING_SHARE if drawn else 0.0
    more = np.concatenate(
        [np.zeros(3), (share * theta[3:5]) ** 2 * (covariance[[3, 4], [3, 4]] > 0)]
    )
    return covariance + np.diag(more)


def _px_per_mm(ready: Prepared) -> float:
    return float(ready.rig.left.K[0, 0] / ready.poses[0].t0_mm[2])
