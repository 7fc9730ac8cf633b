"""The cameras' own motion taken out of a fitted motion, as the paths have it taken out."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from olivevib.arrays import Floats, Ints
from olivevib.reconstruction.motion import MarkerMotion, MotionFit


def without_cameras(fit: MotionFit, fixed: Collection[int]) -> MotionFit:
    """The fit less the mean harmonics of the markers that stand still; shifts only, as in paths.

    The covariance of that mean is added to each marker's. A marker that stands still has no
    amplitude of its own left: its harmonics are called blind.
    """
    still = [m for m in fit.markers if m.id in fixed]
    if not still:
        return fit
    cosine = np.mean([m.cosine[:, :3] for m in still], axis=0)
    sine = np.mean([m.sine[:, :3] for m in still], axis=0)
    more = [np.mean([_block(m, k) for m in still], axis=0) / len(still) for k in range(len(cosine))]
    markers = tuple(_less(m, cosine, sine, more, m.id in fixed) for m in fit.markers)
    return replace(fit, markers=markers)


def _rows(marker: MarkerMotion, harmonic: int) -> Ints:
    """Where the shifts of a harmonic stand among the parameters: three cosines, three sines."""
    return marker.sway.size + 12 * harmonic + np.array([0, 1, 2, 6, 7, 8])


def _block(marker: MarkerMotion, harmonic: int) -> Floats:
    rows = _rows(marker, harmonic)
    return marker.covariance[np.ix_(rows, rows)]


def _less(
    marker: MarkerMotion, cosine: Floats, sine: Floats, more: list[Floats], still: bool
) -> MarkerMotion:
    own_cosine, own_sine = marker.cosine.copy(), marker.sine.copy()
    own_cosine[:, :3] -= cosine
    own_sine[:, :3] -= sine
    covariance = marker.covariance.copy()
    for k, part in enumerate(more):
        rows = _rows(marker, k)
        covariance[np.ix_(rows, rows)] += part
    blind = (True,) * len(marker.blind) if still else marker.blind
    return replace(marker, cosine=own_cosine, sine=own_sine, covariance=covariance, blind=blind)
