"""The motion of one fitted marker over another's, at the lines of their common fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Floats
from olivevib.reconstruction.motion.types import TIMING, MarkerMotion

_TOLD = 3.0  # sigmas that an amplitude of the reference must have to be divided by


@dataclass(frozen=True)
class FittedRatio:
    """Response over reference at each harmonic, axis by axis, with what the fit knows of it.

    ratio (H, 3) complex; size_sigma, phase_sigma (H, 3): of ln |ratio| and of its angle in rad;
    total_sigma (H,): of the logarithm of the ratio of the resultants. NaN where the reference lies
    within its noise or where either harmonic may be something else.
    """

    ratio: NDArray[np.complex128]
    size_sigma: Floats
    phase_sigma: Floats
    total_sigma: Floats


def fitted_ratio(response: MarkerMotion, reference: MarkerMotion) -> FittedRatio:
    """The quotient of two markers' complex amplitudes, P = cosine - i sine.

    First order: d ln(P1/P2) = dP1/P1 - dP2/P2, its real part the size's, its imaginary part the
    phase's. Given the times and the frequency that both share, the markers err independently; what
    they share is in the joint covariance of each (Cov(1, 2) = C1t Ct^-1 Ct2).
    """
    count = min(len(response.cosine), len(reference.cosine))
    ratio = np.full((count, 3), np.nan + 0j)
    size, phase, total = (np.full(shape, np.nan) for shape in ((count, 3), (count, 3), count))
    for k in range(count):
        if response.blind[k] or reference.blind[k]:
            continue
        above, below = (m.cosine[k, :3] - 1j * m.sine[k, :3] for m in (response, reference))
        known = np.abs(below) > _TOLD * reference.amplitude_sigma()[k, :3]
        known &= np.abs(above) > 0
        C = _joint(response, reference, k)
        for a in np.flatnonzero(known):
            at = [a, 3 + a, 6 + a, 9 + a]
            g = np.array([1 / above[a], -1j / above[a], -1 / below[a], 1j / below[a]])
            part = C[np.ix_(at, at)]
            ratio[k, a] = above[a] / below[a]
            size[k, a] = _root(g.real @ part @ g.real)
            phase[k, a] = _root(g.imag @ part @ g.imag)
        both = [np.concatenate([p.real, -p.imag]) for p in (above, below)]  # cosines, sines
        squares = [float(v @ v) for v in both]
        if known.any() and min(squares) > 0:
            g = np.concatenate([both[0] / squares[0], -both[1] / squares[1]])
            total[k] = _root(g @ C @ g)
    return FittedRatio(ratio, size, phase, total)


def _root(variance: float) -> float:
    return float(np.sqrt(max(variance, 0.0)))


def _joint(first: MarkerMotion, second: MarkerMotion, harmonic: int) -> Floats:
    """(12, 12) covariance of [cosines, sines] of x, y, z of the first marker, then the second."""
    own, cross = [], []
    for m in (first, second):
        base = m.sway.size + 12 * harmonic
        at = base + np.array([0, 1, 2, 6, 7, 8])
        times = m.covariance.shape[0] - len(TIMING) + np.arange(len(TIMING))
        own.append(m.covariance[np.ix_(at, at)])
        cross.append(m.covariance[np.ix_(at, times)])
    shared = first.covariance[-len(TIMING) :, -len(TIMING) :]
    free = np.flatnonzero(np.diag(shared) > 0)  # times that were not fitted have zero rows
    scale = np.sqrt(np.diag(shared)[free])
    R = shared[np.ix_(free, free)] / np.outer(scale, scale)
    left, right = (c[:, free] / scale for c in cross)
    between = left @ np.linalg.pinv(R, hermitian=True) @ right.T
    return np.block([[own[0], between], [between.T, own[1]]])
