"""The frequencies that look alike at this frame rate, each fitted, and weighed."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Floats
from olivevib.progress import Tick
from olivevib.reconstruction.motion.solve import (
    Branch,
    Model,
    at_theta,
    settle,
    sways_at,
    with_frequency,
)
from olivevib.vibration.verdict import fold

WIDE_SIGMA = 3.0  # how far the offset may lie from its anchor, in sigmas
HOPELESS = 150.0  # log evidence behind the best after the first steps at which a branch is left
NEAR_BEST = 25.0  # lead below which twice the frequency is preferred
ZONE = 0.45  # over the knot spacing: half width of the sway's zone, Hz


@dataclass(frozen=True)
class Weighed:
    """All branches fitted, best first (after the rule of the double frequency)."""

    branches: tuple[Branch, ...]
    preferred_double: bool


def families(peaks_hz: tuple[float, ...], rate_hz: float, band_hz: tuple[float, float]) -> Floats:
    """Every f in the band whose first or second harmonic appears at one of the peaks."""
    low, high = band_hz
    found: list[float] = []
    for peak in peaks_hz:
        for h in (1, 2):
            for k in range(-1, int(np.ceil(h * high / rate_hz)) + 2):
                found += [(k * rate_hz + sign * peak) / h for sign in (-1, 1)]
    return np.array(sorted(f for f in found if low <= f <= high))


def merged(f_hz: Floats, apart_hz: float) -> Floats:
    """Frequencies no nearer than apart_hz, the first of each crowd."""
    out: list[float] = []
    for f in np.sort(f_hz):
        if not out or f - out[-1] > apart_hz:
            out.append(float(f))
    return np.array(out)


def zone_peak(
    model: Model, rate_hz: float, band_hz: tuple[float, float], span_s: float
) -> tuple[float, ...]:
    """The best apparent frequency within the sway's zones by the joint evidence, H = 1."""
    half = ZONE / model.knots.step_s
    single = replace(model, gain=model.gain[:, :1])
    best: list[tuple[float, float]] = []
    sways = sways_at(model, model.theta0)
    for k in range(1, int(np.ceil(band_hz[1] / rate_hz)) + 1):
        f = np.arange(k * rate_hz - half, k * rate_hz + half, 0.35 / span_s)
        f = f[(f >= band_hz[0]) & (f <= band_hz[1])]
        for trial in f:
            theta = with_frequency(single, float(trial)).theta0
            best.append((at_theta(single, theta, sways).evidence, float(trial)))
    return (fold(max(best)[1], rate_hz),) if best else ()


def offset_starts(model: Model, f_hz: float, sigma_s: float) -> list[Floats]:
    """Thetas to start from: one, or the best offsets of a search where the anchor is weak."""
    theta = with_frequency(model, f_hz).theta0
    reach = WIDE_SIGMA * sigma_s
    if not model.active[1] or not _is_wide(reach, f_hz):
        return [theta]
    count = 2 * int(np.ceil(reach * 6 * f_hz)) + 1
    offsets = theta[1] + np.linspace(-reach, reach, count)
    trials = []
    sways = sways_at(model, theta)  # slow enough to stay; only the harmonics are timed anew
    for offset in offsets:
        trial = theta.copy()
        trial[1] = offset
        trials.append((at_theta(model, trial, sways).evidence, trial))
    order = sorted(range(count), key=lambda k: -trials[k][0])
    peaks = [
        k
        for k in order
        if all(trials[k][0] >= trials[j][0] for j in (k - 1, k + 1) if 0 <= j < count)
    ]
    return [trials[k][1] for k in peaks[:2]]


def weigh(
    model: Model, candidates_hz: Floats, offset_sigma_s: float, tick: Tick, scale: float = 1.0
) -> Weighed:
    """Fit every candidate; drop the hopeless after two steps; rank the others."""
    first: list[Branch] = []
    total = 2 * candidates_hz.size
    for k, f in enumerate(candidates_hz):
        tick(k, total, f"{f:.2f} Hz")
        near = with_frequency(model, float(f))
        starts = offset_starts(near, float(f), offset_sigma_s)
        first += [settle(near, start, 2) for start in starts]
    best = max(b.evidence for b in first)
    kept = [b for b in first if b.evidence > best - HOPELESS * scale]
    fitted = []
    for k, b in enumerate(kept):
        tick(total // 2 + k, total, f"{b.theta[0]:.3f} Hz")
        fitted.append(settle(with_frequency(model, float(b.theta[0])), b.theta))
    dropped = [b for b in first if b.evidence <= best - HOPELESS * scale]
    span = float(np.ptp(model.problems[0].zero_s))
    if _is_wide(WIDE_SIGMA * offset_sigma_s, float(candidates_hz.max())):
        fitted += _at_times_of_best(model, max(fitted, key=lambda b: b.evidence), candidates_hz)
    fitted += _doubled(model, max(fitted, key=lambda b: b.evidence), candidates_hz)
    ranked = distinct(fitted + dropped, 0.5 / span)
    return prefer_double(ranked, NEAR_BEST * scale, 0.1 / span)


def _is_wide(reach_s: float, f_hz: float) -> bool:
    """Whether the offset may be so far off that a line's phase starts in another valley."""
    return reach_s >= 0.17 / f_hz


def _at_times_of_best(model: Model, best: Branch, candidates_hz: Floats) -> list[Branch]:
    """The other candidates started at the best one's offset and row times.

    Each found its own offset before; one that missed it would lose for that alone.
    """
    out = []
    for f in candidates_hz:
        start = best.theta.copy()
        start[0] = f
        near = with_frequency(model, float(f))
        first = settle(near, start, 2)
        if first.evidence > best.evidence - HOPELESS:
            out.append(settle(with_frequency(model, float(first.theta[0])), first.theta))
    return out


def _doubled(model: Model, best: Branch, candidates_hz: Floats) -> list[Branch]:
    """Twice the best one's frequency, from its times: what it shows with its second harmonic."""
    start = best.theta.copy()
    start[0] *= 2
    if start[0] > candidates_hz.max() + 1.0:
        return []
    return [settle(with_frequency(model, float(start[0])), start)]


def unslipped(model: Model, best: Branch) -> tuple[Branch, bool]:
    """The branch at the offset that fits best among those whole periods apart.

    Also whether another of them is nearly as good: then slow motion does not tell the period.
    """
    found = [best]
    for k in (-2, -1, 1, 2):
        start = best.theta.copy()
        start[1] += k / start[0]
        found.append(settle(with_frequency(model, float(start[0])), start))
    found.sort(key=lambda b: -b.evidence)
    apart = [b for b in found if abs(b.theta[1] - found[0].theta[1]) > 0.5 / best.theta[0]]
    near = bool(apart) and found[0].evidence - apart[0].evidence < NEAR_BEST
    return found[0], near


def distinct(branches: list[Branch], apart_hz: float) -> list[Branch]:
    """Best first, one a frequency."""
    out: list[Branch] = []
    for b in sorted(branches, key=lambda b: -b.evidence):
        if all(abs(b.theta[0] - o.theta[0]) > apart_hz for o in out):
            out.append(b)
    return out


def prefer_double(ranked: list[Branch], near: float, same_hz: float) -> Weighed:
    """A pure tone fits half its frequency as well: where both are near, take the double."""
    best = ranked[0]
    for other in ranked[1:]:
        double = abs(other.theta[0] - 2 * best.theta[0]) < same_hz
        if double and best.evidence - other.evidence < near:
            rest = [b for b in ranked if b is not other and b is not best]
            return Weighed((other, *rest), True)
    halves = [b for b in ranked if abs(2 * b.theta[0] - best.theta[0]) < same_hz]
    return Weighed(tuple(b for b in ranked if all(b is not half for half in halves)), False)


def strength(model: Model, branch: Branch) -> float:
    """Log evidence of the branch's harmonics over sway alone, at the branch's own times."""
    bare = replace(model, gain=np.full_like(model.gain, 1e-9))
    return at_theta(model, branch.theta).evidence - at_theta(bare, branch.theta).evidence
