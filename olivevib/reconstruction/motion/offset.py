"""Where the offset between the cameras is not known: a first value from the sway alone.

The picture coordinate across the epipolar lines must agree in both cameras at every instant. Its
slow part, with the shaker's line taken out of each camera apart, is compared over the offset. A
harmonic of the line whose alias is itself slow cannot be told from sway in one camera: its
apparent frequency is left out of the comparison.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Floats
from olivevib.geometry import StereoRig
from olivevib.reconstruction.motion.pixels import Pixels
from olivevib.reconstruction.motion.sightings import MarkerSightings, Observations, Sightings
from olivevib.reconstruction.motion.spline import Knots, knots_over
from olivevib.reconstruction.motion.start import mean_pose
from olivevib.reconstruction.motion.types import Anchor, MotionSettings
from olivevib.vibration.verdict import fold

WEAK_S = 5e-3  # sigma of an offset above which it is searched for
STEP_S = 2e-3
FLOOR_S = 3e-3  # sigma of what the search finds, at least
SLOW_KNOT_S = 0.3
CLEAR = 30.0  # drop of the squares over the noise that a minimum must show
AGREE = 40.0  # squares over the noise, a marker, with which two slow curves still agree;
AGREE_SHARE = 0.1  # or this share of the usual ones: turning and depth are left out here


@dataclass(frozen=True)
class Lines:
    """Apparent frequencies of a line and its second harmonic: above the sway, and among it."""

    fast_hz: tuple[float, ...]
    slow_hz: tuple[float, ...]

    @classmethod
    def of(cls, peak_hz: float, rate_hz: float) -> Lines:
        """From the line's apparent frequency; what a slow curve can follow counts as slow."""
        seen = [fold(h * peak_hz, rate_hz) for h in (1, 2)]
        limit = 1 / SLOW_KNOT_S
        return cls(tuple(f for f in seen if f >= limit), tuple(f for f in seen if f < limit))


def waves(frequencies_hz: tuple[float, ...], t_s: Floats) -> list[Floats]:
    """Cosine and sine (N, 2) of each frequency at t_s."""
    angles = (2 * np.pi * f * (t_s - t_s.mean()) for f in frequencies_hz)
    return [np.column_stack([np.cos(a), np.sin(a)]) for a in angles]


def with_offset(
    observations: Observations,
    rig: StereoRig,
    anchor: Anchor,
    settings: MotionSettings,
    pixels: Pixels,
) -> tuple[Anchor, bool]:
    """The anchor with a searched offset where its own is weak, and whether it was found clearly.

    An offset that the sway does not show stays at the anchor's value, slips of whole periods
    possible.
    """
    if anchor.right_offset_sigma_s <= WEAK_S:
        return anchor, True
    reach = min(settings.offset_search_s, 3 * anchor.right_offset_sigma_s)
    lags = anchor.right_offset_s + np.arange(-reach, reach + STEP_S / 2, STEP_S)
    lines = Lines.of(pixels.peaks_hz[0], observations.frame_rate_hz)
    cost = np.zeros(lags.size)
    for m, marker in enumerate(observations.markers):
        noise = (pixels.noise[2 * m][0], pixels.noise[2 * m + 1][0])
        cost += _cost(marker, rig, lines, lags, noise)
    k = int(np.argmin(cost))
    inside = 0 < k < lags.size - 1
    usual = float(np.median(cost))
    agree = cost[k] < max(AGREE_SHARE * usual, AGREE * len(observations.markers))
    clear = bool(usual - cost[k] > CLEAR and agree and inside)
    found = float(lags[k]) if clear else anchor.right_offset_s
    sigma = FLOOR_S if clear else WEAK_S
    return replace(anchor, right_offset_s=found, right_offset_sigma_s=sigma), clear


def _cost(
    marker: MarkerSightings,
    rig: StereoRig,
    lines: Lines,
    lags: Floats,
    noise: tuple[Floats, Floats],
) -> Floats:
    """Squares over noise by which the two slow curves differ at each lag (mean left out)."""
    pose = mean_pose(marker, rig)
    _, left, _ = rig.left.project_jacobian(pose.t0_mm)
    _, right, _ = rig.right.project_jacobian(rig.to_right(pose.t0_mm[None]))
    stacked = np.vstack([left[0], right[0] @ rig.R_right_left])  # (4, 3)
    null = np.linalg.svd(stacked.T)[2][-1]
    curves = [
        _slow(marker.left, null[:2], lines.fast_hz),
        _slow(marker.right, -null[2:], lines.fast_hz),
    ]
    spread = sum(float(n @ c[:2, :2] @ n) for n, c in zip((null[:2], null[2:]), noise, strict=True))
    (knots_l, c_l, t_l), (knots_r, c_r, t_r) = curves
    mine = knots_r.values(c_r[:, None], t_r)[:, 0]
    out = np.empty(lags.size)
    for k, lag in enumerate(lags):
        at = t_r + lag
        inside = (at > t_l[0]) & (at < t_l[-1])
        other = knots_l.values(c_l[:, None], at)[:, 0]
        if inside.sum() <= 20:
            out[k] = 1e30
            continue
        alike = np.column_stack([np.ones(inside.sum()), *waves(lines.slow_hz, t_r[inside])])
        unlike = (mine - other)[inside]
        unlike = unlike - alike @ np.linalg.lstsq(alike, unlike, rcond=None)[0]
        out[k] = np.mean(unlike**2) * t_r.size / spread
    return out


def _slow(
    view: Sightings, direction: Floats, fast_hz: tuple[float, ...]
) -> tuple[Knots, Floats, Floats]:
    """Knots, coefficients of the slow part along ``direction``, and the times."""
    t = view.row_zero_s
    knots = knots_over(float(t[0]), float(t[-1]), SLOW_KNOT_S)
    columns = [knots.matrix(t), *waves(fast_hz, t)]
    value = view.px.mean(axis=1) @ direction
    c = np.linalg.lstsq(np.column_stack(columns), value, rcond=None)[0]
    return knots, np.asarray(c[: knots.count]), t
