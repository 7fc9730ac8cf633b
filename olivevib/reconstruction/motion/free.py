"""Motion that is not periodic (release tests, start-up): the spline alone, with its own limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from olivevib.geometry import StereoRig
from olivevib.reconstruction.motion.decide import in_step
from olivevib.reconstruction.motion.finish import (
    degrees_of_freedom,
    markers_of,
    relinearise,
    timing_of,
)
from olivevib.reconstruction.motion.pixels import look
from olivevib.reconstruction.motion.prepare import layout, model_of, sway_precision
from olivevib.reconstruction.motion.sightings import Observations
from olivevib.reconstruction.motion.solve import settle
from olivevib.reconstruction.motion.start import about_sway
from olivevib.reconstruction.motion.types import Anchor, BranchTable, MotionFit, MotionSettings
from olivevib.vibration.types import LineStatus

KNOTS_A_CYCLE = 2.4
FREE_SIGMA = (4.0, 4e-3)  # mm and rad, at least: strong priors keep what no frame tells small
NO_HARMONIC = 1e18  # precision that leaves the harmonics at zero


def fit_free(
    observations: Observations, rig: StereoRig, anchor: Anchor, settings: MotionSettings
) -> MotionFit:
    """Spline with 2.4 knots a cycle of ``settings.free_band_hz``; no frequency is claimed.

    In step, half the frame rate bounds x and y to 10 Hz at some 3 %; cameras half a frame apart
    carry them to 25 Hz at 6-10 %, depth to 10 Hz only.
    """
    knot_s = 1 / (KNOTS_A_CYCLE * settings.free_band_hz)
    pixels = look(observations, max(knot_s, 2.6 / observations.frame_rate_hz), 1)
    size = max(FREE_SIGMA[0], _spread_mm(observations, rig))
    settings = replace(
        settings,
        harmonics=1,
        sway_sigma_mm=size,
        sway_sigma_rad=max(FREE_SIGMA[1], size * FREE_SIGMA[1] / FREE_SIGMA[0]),
    )
    clock, knots, start, end = layout(observations, anchor, settings, knot_s)
    poses, problems, whites = about_sway(
        observations, rig, pixels, clock, knots, sway_precision(settings)
    )
    model = model_of(problems, observations, anchor, settings, knots, clock.mid_s)
    active = model.active.copy()
    active[0] = False
    model = replace(model, active=active, precision_harmonic=np.full(6, NO_HARMONIC))
    branch = settle(model, model.theta0)
    model = relinearise(model, branch, observations, rig, poses, whites)
    branch = settle(model, branch.theta)
    chi2 = branch.chi2 / degrees_of_freedom(model)
    markers, covariance = markers_of(model, branch, observations, poses, (False,), max(1.0, chi2))
    theta = [float(v) for v in branch.theta]
    row = observations.reference_row
    none = np.empty(0)
    return MotionFit(
        kind="free",
        markers=markers,
        timing=timing_of(np.array([np.nan, *theta[1:]]), row, covariance),
        branches=BranchTable(none, none, none, none, none),
        status=LineStatus.NONE,
        reasons=(_limits(settings.free_band_hz, theta[1], observations.frame_rate_hz),),
        next_time=(),
        anchor=anchor,
        noise_scale=pixels.scale,
        noise_source="pixels" if pixels.noise[0][1] > 0 else "localiser",
        chi2=chi2,
        first_knot_s=knots.first_s,
        knot_s=knots.step_s,
        start_s=start,
        end_s=end,
        shift_s=row * theta[3],
    )


def _spread_mm(observations: Observations, rig: StereoRig) -> float:
    """Largest deviation of a marker's centre in the picture, in mm at two baselines' distance."""
    spreads = [
        float(np.abs(v.px.mean(axis=1) - v.px.mean(axis=(0, 1))).max())
        for m in observations.markers
        for v in (m.left, m.right)
    ]
    return max(spreads) * 3.0 * rig.baseline_mm / float(rig.left.K[0, 0])


def _limits(band_hz: float, offset_s: float, rate_hz: float) -> str:
    plain = 10.0 if in_step(offset_s, rate_hz) else 25.0
    return (
        f"Free motion up to {band_hz:g} Hz, no frequency assumed: at {rate_hz:.0f} frames/s x and "
        f"y hold to about {min(plain, band_hz):g} Hz, depth to {min(10.0, band_hz):g} Hz; faster "
        "parts appear as slower ones."
    )
