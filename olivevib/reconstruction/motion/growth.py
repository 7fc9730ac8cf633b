"""Amplitudes that grow evenly: seen in the pixels, or told by the fit of the chosen branch.

Near a multiple of the frame rate a line appears slow, and its growth looks like sway and like a
frequency a few mHz off: a steady fit scatters no more there, and is many sigmas wrong.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Floats
from olivevib.reconstruction.motion.pixels import views_of
from olivevib.reconstruction.motion.sightings import Observations
from olivevib.reconstruction.motion.solve import SHARED, Branch, Coefficients, Model, settle
from olivevib.reconstruction.motion.types import MarkerMotion
from olivevib.reconstruction.motion.wander import PixelLine

STEPS = 6
MOST = 0.8  # of the mean amplitude, from the middle to the end
TRIED = 0.02  # growth on either side by which the fit's slope and bend are taken
FAR = 0.05  # largest move: what is slow enough to be taken for sway bends chi2 unevenly
NEAR = 0.1  # sigmas: no nearer
MOST_MOVES = 12
TOLD = 3.0  # sigmas from which a growth counts as told


@dataclass(frozen=True)
class Growth:
    """Share by which the amplitude grows from mid_s to its end, half_s later; gain as in Pace."""

    share: float
    mid_s: float
    half_s: float
    gain: float

    def size(self, t_s: Floats) -> Floats:
        """Amplitude over the mean one."""
        return np.asarray(1.0 + self.share * (t_s - self.mid_s) / self.half_s)


def growth_of(
    observations: Observations, knot_s: float, span: tuple[float, float], steady_hz: float
) -> Growth:
    """How evenly growing the amplitude is, from the pixels alone (no branch yet)."""
    mid, half = 0.5 * (span[0] + span[1]), 0.5 * (span[1] - span[0])
    lines = [PixelLine.of(v, knot_s) for v in views_of(observations)]
    share, steady, left = 0.0, 0.0, 0.0
    for k in range(STEPS):
        top = bottom = left = 0.0
        for line in lines:
            phase = 2 * np.pi * steady_hz * (line.t_s - mid)
            u = (line.t_s - mid) / half
            slope, rest = line.growing(phase, u, share)
            top, bottom = top + float(np.sum(slope * rest)), bottom + float(np.sum(slope**2))
            left += float(np.sum(rest**2))
        steady = left if k == 0 else steady
        share = float(np.clip(share + top / max(bottom, 1e-12), -MOST, MOST))
    return Growth(share, mid, half, steady / max(left, 1e-12))


@dataclass(frozen=True)
class Grown:
    """A fit with the growth that its pixels told.

    by_theta (Q,), by_coefficients (each marker's sway and harmonics in one row): what one sigma of
    the growth moves.
    """

    model: Model
    branch: Branch
    by_theta: Floats
    by_coefficients: tuple[Floats, ...]


def told_growth(model: Model, best: Branch, scale: float) -> Grown | None:
    """The branch with its amplitudes growing evenly, where that is told by three sigmas.

    A growth that the pixels showed already (``model.growth``) is refined. scale: of the fit's
    variances. Newton's method on chi2 with all else settled at each growth.
    """

    def at(growth: float, near: Branch) -> Branch:
        return settle(replace(model, growth=growth), near.theta)

    growth, now = model.growth, at(model.growth, best)
    even = now.chi2 if growth == 0 else np.inf
    for _ in range(MOST_MOVES):
        less, more = at(growth - TRIED, now), at(growth + TRIED, now)
        slope = (more.chi2 - less.chi2) / (2 * TRIED)
        bend = (more.chi2 + less.chi2 - 2 * now.chi2) / TRIED**2
        if bend > 0 and growth == 0 and slope**2 / (2 * bend) < TOLD**2 * scale:
            return None
        move = -slope / bend if bend > 0 else -np.sign(slope)
        if bend > 0 and abs(move) < NEAR * np.sqrt(2 / bend):
            break
        growth = float(np.clip(growth + np.clip(move, -FAR, FAR), -MOST, MOST))
        now = at(growth, now)
    else:
        return None
    if even - now.chi2 < TOLD**2 * scale:
        return None
    share = float(np.sqrt(2 * scale / bend)) / (2 * TRIED)
    return Grown(
        replace(model, growth=growth),
        now,
        share * (more.theta - less.theta),
        tuple(
            share * (_row(b) - _row(a))
            for a, b in zip(less.coefficients, more.coefficients, strict=True)
        ),
    )


def _row(own: Coefficients) -> Floats:
    return np.concatenate([own.sway.ravel(), own.harmonic.ravel()])


def with_growth_sigma(
    parts: tuple[tuple[MarkerMotion, ...], Floats], grown: Grown
) -> tuple[tuple[MarkerMotion, ...], Floats]:
    """Motions and covariance of TIMING (5, 5) as unsure as the growth leaves them."""
    markers, timing = parts
    shared = grown.by_theta[:SHARED]
    wider = []
    for marker, own in zip(markers, grown.by_coefficients, strict=True):
        moved = np.concatenate([own, shared])
        wider.append(replace(marker, covariance=marker.covariance + np.outer(moved, moved)))
    return tuple(wider), timing + np.outer(shared, shared)
