"""The model behind a fit: priors from the anchor, knots, gains of the blur."""

from __future__ import annotations

import numpy as np

from olivevib.arrays import Bools, Floats
from olivevib.reconstruction.motion.problem import Problem, Times
from olivevib.reconstruction.motion.sightings import Observations
from olivevib.reconstruction.motion.solve import SHARED, Model
from olivevib.reconstruction.motion.spline import Knots, knots_over
from olivevib.reconstruction.motion.types import Anchor, MotionSettings

ROW_TIME_GUESS_S = 4e-5  # sigma of a row time of which nothing is known


def offset_sigma(anchor: Anchor, settings: MotionSettings) -> float:
    """Sigma of the offset at the markers' rows, never wider than the search."""
    return min(anchor.right_offset_sigma_s, settings.offset_search_s)


def time_prior(
    anchor: Anchor, reference_row: float, sigma_offset_s: float
) -> tuple[Floats, Floats, Bools]:
    """theta0 (5,), precision (5, 5), active (5,): offset at reference_row from the anchor's row.

    A sigma of zero fixes its value.
    """
    rows = reference_row - anchor.reference_row
    left, right = anchor.left_row_time_s, anchor.right_row_time_s
    theta0 = np.array([0.0, anchor.right_offset_s + rows * (right - left), 0.0, left, right])
    sigma = np.array([sigma_offset_s, anchor.drift_sigma, 0.0, 0.0])
    sigma[2] = min(anchor.left_row_time_sigma_s, ROW_TIME_GUESS_S)
    sigma[3] = min(anchor.right_row_time_sigma_s, ROW_TIME_GUESS_S)
    active = np.array([True, *(sigma > 0)])
    weight = np.where(sigma > 0, 1 / np.maximum(sigma, 1e-30) ** 2, 0.0)
    by_offset = np.array([0.0, 1.0, 0.0, rows, -rows])
    by_offset = by_offset * active
    precision = np.diag([0.0, 0.0, weight[1], weight[2], weight[3]])
    precision = precision + weight[0] * np.outer(by_offset, by_offset)
    return theta0, precision, active


def span_of(observations: Observations, theta0: Floats) -> tuple[float, float]:
    """First and last instant of all points on the fit's clock, a little widened."""
    starts, ends = [], []
    for m in observations.markers:
        for view, offset, row in ((m.left, 0.0, theta0[3]), (m.right, theta0[1], theta0[4])):
            lag = (view.row - observations.reference_row) * row
            t = view.row_zero_s + offset
            starts.append(float(t[0] + lag.min()))
            ends.append(float(t[-1] + lag.max()))
    return min(starts) - 2e-3, max(ends) + 2e-3


def sway_precision(settings: MotionSettings) -> Floats:
    """(6,) of each sway coefficient."""
    sigma = [settings.sway_sigma_mm] * 3 + [settings.sway_sigma_rad] * 3
    return np.asarray(1 / np.array(sigma) ** 2)


def harmonic_precision(settings: MotionSettings) -> Floats:
    """(6,) of each cosine or sine."""
    sigma = [settings.harmonic_sigma_mm] * 3 + [settings.harmonic_sigma_rad] * 3
    return np.asarray(1 / np.array(sigma) ** 2)


def layout(
    observations: Observations, anchor: Anchor, settings: MotionSettings, knot_s: float
) -> tuple[Times, Knots, float, float]:
    """Times of the anchor, knots, start and end on the fit's clock."""
    theta0, _, _ = time_prior(anchor, observations.reference_row, offset_sigma(anchor, settings))
    start, end = span_of(observations, theta0)
    offset, drift, left, right = (float(v) for v in theta0[1:SHARED])
    clock = Times(offset, drift, left, right, 0.5 * (start + end))
    return clock, knots_over(start, end, knot_s), start, end


def model_of(
    problems: tuple[Problem, ...],
    observations: Observations,
    anchor: Anchor,
    settings: MotionSettings,
    knots: Knots,
    mid_s: float,
) -> Model:
    """The steady model, before any frequency."""
    theta0, precision, active = time_prior(
        anchor, observations.reference_row, offset_sigma(anchor, settings)
    )
    return Model(
        problems,
        knots,
        mid_s,
        theta0,
        precision,
        active,
        sway_precision(settings),
        harmonic_precision(settings),
        np.ones((2, settings.harmonics)),
    )
