"""How well the axis of a black/white bar is known, and what that means for the cornerstones.

A pixel's edge is known to one pixel: along a bar that lies at an angle to the rows the error is a
saw-tooth which averages out over the rows it crosses; a bar along the rows keeps it whole. The
variance of centroid and direction follows from the Fourier series of the saw-tooth; two edges,
independent, make an axis, and the stepped ends add to its direction. What is not pixels (noise, a
threshold that sees the code on one side and white on the other) is EDGE_PX an edge point, FLOOR_PX
a bar, and OUTWARD_PX for all four bars alike; these three were set on rendered markers.

The principal axis of a sheared bar is not parallel to its side: a bias that the paper's method has
by its nature. It is not corrected here but enters the covariance with the size it has.
"""

from __future__ import annotations

import numpy as np

from olivevib.arrays import Floats
from olivevib.detection.domains import Bars, principal_axes
from olivevib.detection.loops import Candidates
from olivevib.marker import MarkerLayout

TERMS = 8  # of the Fourier series
EDGE_PX = 0.15  # scatter of one edge point beyond its pixel
FLOOR_PX = 0.025  # sigma of a whole bar across its axis
OUTWARD_PX = 0.045  # sigma of what moves all four bars away from the marker's centre


def axis_variances(bars: Bars) -> tuple[Floats, Floats]:
    """Variance of the centroid across the axis, px², and of the direction, rad², each (N,)."""
    steep = np.abs(bars.axis).max(axis=1)  # cosine to the nearer pixel axis
    columns = np.maximum(bars.length * steep, 1.0)
    crossed = bars.length * np.abs(bars.axis).min(axis=1)  # pixel rows that the axis crosses
    k = np.arange(1, TERMS + 1)
    z = np.maximum(np.pi * k * crossed[:, None], 1e-6)
    power = 1 / (2 * np.pi**2 * k**2)
    mean = (power * (np.sin(z) / z) ** 2).sum(axis=1)
    tilt = (power * ((np.sin(z) - z * np.cos(z)) / z**2) ** 2).sum(axis=1)
    point = EDGE_PX**2 / columns
    across = 0.5 * steep**2 * (mean + point) + FLOOR_PX**2
    sides = 0.5 * steep**4 * (36 * tilt + 12 * point) / columns**2
    ends = 0.5 * bars.width / bars.length**4
    return across, sides + ends + 12 * (FLOOR_PX / bars.length) ** 2


def cornerstone_covariances(
    bars: Bars, candidates: Candidates, H: Floats, layout: MarkerLayout
) -> Floats:
    """Covariances (M, 8, 8) px² of the cornerstones of each candidate, x1 y1 … x4 y4.

    Cornerstone k is where the axes of bars k - 1 and k meet; errors of different bars are
    independent, so neighbouring cornerstones are not. H (M, 3, 3): centred modules to px.
    """
    mine = candidates.bars
    jacobian = _by_axes(bars, candidates)
    across, turn = axis_variances(bars)
    spread = np.stack([across[mine], turn[mine]], axis=-1).reshape(len(mine), 8)
    outward = np.zeros((len(mine), 4, 2))
    normals = np.stack([-bars.axis[:, 1], bars.axis[:, 0]], axis=-1)[mine]
    from_centre = bars.centre[mine] - candidates.corners.mean(axis=1, keepdims=True)
    outward[..., 0] = OUTWARD_PX * np.sign((normals * from_centre).sum(axis=-1))
    sheared = np.zeros_like(outward)
    sheared[..., 1] = shear_turns(H, layout)
    common = np.stack([outward, sheared], axis=-1).reshape(len(mine), 8, 2)
    moved = jacobian @ common
    scattered = (jacobian * spread[:, None]) @ np.swapaxes(jacobian, 1, 2)
    out: Floats = scattered + moved @ np.swapaxes(moved, 1, 2)
    return out


def _by_axes(bars: Bars, candidates: Candidates) -> Floats:
    """Derivative (M, 8, 8) of the cornerstones by (offset across, turn) of the bars 0…3."""
    jacobian = np.zeros((len(candidates.bars), 8, 8))
    normals = np.stack([-bars.axis[:, 1], bars.axis[:, 0]], axis=-1)
    for k in range(4):
        pair = candidates.bars[:, [k - 1, k]]
        inverse = np.linalg.inv(normals[pair])
        t = (bars.axis[pair] * (candidates.corners[:, None, k] - bars.centre[pair])).sum(axis=-1)
        for place, bar in enumerate(((k - 1) % 4, k)):
            jacobian[:, 2 * k : 2 * k + 2, 2 * bar] = inverse[:, :, place]
            jacobian[:, 2 * k : 2 * k + 2, 2 * bar + 1] = inverse[:, :, place] * t[:, place, None]
    return jacobian


def shear_turns(H: Floats, layout: MarkerLayout) -> Floats:
    """Angle (M, 4), rad, from each bar's long side to its principal axis, as H (M, 3, 3) shears it.

    Both bars of a pair turn nearly alike, so the centre suffers only from the perspective between
    them (0.05 px at 96 px and 60°), the cornerstones far more (0.5 px).
    """
    half = float(layout.cornerstones[2, 0])
    middles = np.array([[0, -half, 1], [half, 0, 1], [0, half, 1], [-half, 0, 1]])
    w = H @ middles.T
    image = w[:, :2] / w[:, 2:]
    by_uv = (H[:, None, :2, :2] - image.transpose(0, 2, 1)[..., None] * H[:, None, 2:, :2]) / w[
        :, 2, :, None, None
    ]
    along = np.where((np.arange(4) % 2 == 0)[:, None], by_uv[..., 0], by_uv[..., 1])
    short = np.where((np.arange(4) % 2 == 0)[:, None], by_uv[..., 1], by_uv[..., 0])
    long = layout.bar * along
    moments = np.stack([long[..., 0] ** 2, long[..., 1] ** 2, long[..., 0] * long[..., 1]], axis=-1)
    moments += np.stack([short[..., 0] ** 2, short[..., 1] ** 2, short[..., 0] * short[..., 1]], -1)
    axis = principal_axes(moments.reshape(-1, 3))[2].reshape(long.shape)
    sine = long[..., 0] * axis[..., 1] - long[..., 1] * axis[..., 0]
    cosine = (long * axis).sum(axis=-1)
    out: Floats = np.arctan(sine / np.where(np.abs(cosine) < 1e-9, 1e-9, cosine))
    return out
