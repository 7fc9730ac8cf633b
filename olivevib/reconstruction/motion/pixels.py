"""What the pixels say without any model of time: noise, apparent frequency, pace of the sway.

Each coordinate of each corner is a sum of a spline and a sine on the frames' own times; a marker
that is lower in the picture is seen later, so the sine's phase may go with its row, by any amount.
An alias and its original fit alike, so nothing here favours a branch, a row time or an offset.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats
from olivevib.reconstruction.motion.sightings import Observations, Sightings
from olivevib.reconstruction.motion.spline import knots_over

SPACINGS_S = (0.4, 0.3, 0.2, 0.15, 0.1)  # of knots, longest first
RISE = 1.05  # of the noise variance that a longer spacing may cost
SLOW_HZ = 2.7  # a line that appears slower is left to the spline when its spacing is chosen
OWN_FRAMES = 12.0  # frames that the localiser's own covariance counts for
NEAR_HZ = 1.5  # of a line that is taken as steady: what stands beside it is its wandering
LEAST_BESIDE = 1e-3  # of the first line's power that counts
SHARP = {"xatol": 1e-6}  # Hz: a cycle's phase over a minute to 0.4 mrad
LEAST_FREE = 24  # degrees of freedom below which no noise is measured


@dataclass(frozen=True)
class Pixels:
    """knot_s chosen; f_hz (F,) apparent frequencies with power (F,) log evidence; noise: for each
    view (markers x 2) the covariance (2P, 2P) px² of a frame and its degrees of freedom. beside: in
    standard deviations of noise, the power of a second line near a first that was taken as steady.
    """

    knot_s: float
    f_hz: Floats
    power: Floats
    peaks_hz: tuple[float, ...]
    noise: tuple[tuple[Floats, float], ...]
    scale: float
    beside: float = 0.0

    @property
    def learned(self) -> float:
        """What variances grow by because the noise was measured from finitely many frames.

        (n / (n - p))^2 for n degrees of freedom and p pixels a frame: once because the inverse of
        a measured covariance is too large, once because it weighs amiss.
        """
        factors = [
            ((free + OWN_FRAMES) / (free + OWN_FRAMES - len(c))) ** 2 if free else 1.0
            for c, free in self.noise
        ]
        return float(np.mean(factors))


def views_of(observations: Observations) -> list[Sightings]:
    """Left and right of each marker in turn."""
    return [v for m in observations.markers for v in (m.left, m.right)]


def look(
    observations: Observations,
    knot_s: float | None,
    harmonics: int,
    phase: Callable[[Floats], Floats] | None = None,
    size: Callable[[Floats], Floats] | None = None,
) -> Pixels:
    """Choose the knots, scan the apparent frequency, measure the noise.

    Raises ValueError where the frames are too far apart for any knots, or too few to tell noise.
    phase: of a line whose speed wanders, else the strongest steady line is taken out; size: its
    slowly changing amplitude, else even.
    """
    views = views_of(observations)
    span = max(float(np.ptp(v.row_zero_s)) for v in views)
    rate = observations.frame_rate_hz
    f = np.arange(0.3 / span, rate / 2, 0.3 / span)
    spacings = (knot_s,) if knot_s else tuple(s for s in SPACINGS_S if s >= 2.5 / rate)
    trials = []
    for step in spacings:
        lines = [_without_sway(v, step) for v in views]
        power = np.sum([line_power(*line, f) for line in lines], axis=0)
        peaks = tuple(_sharpened(lines, peak, f[1] - f[0]) for peak in _peaks(f, power, 2.0 / span))
        left = [
            _left(v, Q, _phase(v, peaks, phase), harmonics, size)
            for v, (_, Q, _) in zip(views, lines, strict=True)
        ]
        noise = tuple(_noise(v, *one) for v, one in zip(views, left, strict=True))
        first = (peaks[0], float(power.max())) if peaks and phase is None else (0.0, 0.0)
        near = _beside(views, left, noise, f, first)
        trials.append((step, power, peaks, noise, near))
    sizes = [_size(views, t[3]) for t in trials]
    if not sizes or not np.isfinite(sizes).any():
        raise ValueError(
            f"{rate:.1f} frames/s for {span:.1f} s are too few for a fit of the motion"
        )
    pick = next(k for k, s in enumerate(sizes) if s <= RISE * np.nanmin(sizes))
    step, power, peaks, noise, near = trials[pick]
    return Pixels(step, f, power, peaks, noise, float(np.sqrt(sizes[pick])), near)


def _without_sway(v: Sightings, step: float) -> tuple[Floats, Floats, Floats]:
    """Times, orthonormal spline basis, and whitened pixels (N, d) with the spline taken out."""
    t = v.row_zero_s
    Q = np.linalg.qr(knots_over(t[0], t[-1], step).matrix(t))[0]
    y = v.px.reshape(t.size, -1)
    W = np.linalg.inv(np.linalg.cholesky(v.covariance_px2.mean(axis=0)))
    return t, Q, np.asarray((y - Q @ (Q.T @ y)) @ W.T)


def line_power(t: Floats, Q: Floats, r: Floats, f: Floats) -> Floats:
    """Half the drop of the squares of r (N, d) by a sine at each f, beside the spline Q."""
    angle = 2 * np.pi * np.outer(t - t.mean(), f)
    c, s = np.cos(angle), np.sin(angle)
    qc, qs = Q.T @ c, Q.T @ s
    cc = (c * c).sum(0) - (qc * qc).sum(0)
    ss = (s * s).sum(0) - (qs * qs).sum(0)
    cs = (c * s).sum(0) - (qc * qs).sum(0)
    gc, gs = c.T @ r, s.T @ r
    cc, ss = cc + 1e-3 * t.size, ss + 1e-3 * t.size
    det = np.maximum(cc * ss - cs * cs, 1e-9 * cc * ss)
    drop = ss[:, None] * gc**2 - 2 * cs[:, None] * gc * gs + cc[:, None] * gs**2
    return np.asarray(0.5 * drop.sum(axis=1) / det)


def _peaks(f: Floats, power: Floats, apart_hz: float, most: int = 2) -> tuple[float, ...]:
    """The strongest maxima, best first, each with the vertex of its parabola."""
    left = power.copy()
    found: list[float] = []
    for _ in range(most):
        k = int(np.argmax(left))
        if left[k] <= 0:
            break
        shift = 0.0
        if 0 < k < f.size - 1:
            a, b, c = power[k - 1 : k + 2]
            bend = a - 2 * b + c
            shift = float(np.clip(0.5 * (a - c) / bend, -0.5, 0.5)) if bend < 0 else 0.0
        found.append(float(f[k] + shift * (f[1] - f[0])))
        left[np.abs(f - f[k]) < apart_hz] = 0.0
    return tuple(found)


def _sharpened(
    lines: list[tuple[Floats, Floats, Floats]], peak_hz: float, reach_hz: float
) -> float:
    """The frequency of most power near a peak of the grid."""
    from scipy.optimize import minimize_scalar  # heavy: a report needs none

    def lost(f_hz: float) -> float:
        return -sum(float(line_power(*line, np.array([f_hz]))[0]) for line in lines)

    bounds = (max(peak_hz - reach_hz, 0.5 * peak_hz), peak_hz + reach_hz)
    return float(minimize_scalar(lost, bounds=bounds, method="bounded", options=SHARP).x)


def _phase(
    v: Sightings, peaks: tuple[float, ...], phase: Callable[[Floats], Floats] | None
) -> Floats | None:
    """Apparent phase of the line in a view; None: too slow to be told from sway."""
    t = v.row_zero_s
    if phase is not None:
        return phase(t)
    if not peaks or peaks[0] < SLOW_HZ:
        return None
    return np.asarray(2 * np.pi * peaks[0] * (t - t.mean()))


def _left(
    v: Sightings,
    Q: Floats,
    phase: Floats | None,
    harmonics: int,
    size: Callable[[Floats], Floats] | None,
) -> tuple[Floats, Floats]:
    """What spline and lines leave of a view's pixels (N, 2P), and their orthonormal basis."""
    n = v.row_zero_s.size
    columns = [Q]
    even = np.ones(n) if size is None else size(v.row_zero_s)
    lower = v.row.mean(axis=1) - v.row.mean()
    lower = lower / max(float(np.abs(lower).max()), 1e-9)
    if phase is not None:
        for h in range(1, harmonics + 1):
            line = even[:, None] * np.column_stack([np.cos(h * phase), np.sin(h * phase)])
            columns += [line, lower[:, None] * line]
    basis = np.linalg.qr(np.column_stack(columns))[0]
    y = v.px.reshape(n, -1)
    return np.asarray(y - basis @ (basis.T @ y)), basis


def _noise(v: Sightings, r: Floats, basis: Floats) -> tuple[Floats, float]:
    """Covariance of a frame's pixels left by spline and lines, blended with the localiser's."""
    free = float(len(r) - basis.shape[1])
    own = v.covariance_px2.mean(axis=0)
    if free < LEAST_FREE:
        return own, 0.0
    seen = r.T @ r / free
    scale = float(np.trace(np.linalg.solve(own, seen)) / own.shape[0])
    share = OWN_FRAMES / (OWN_FRAMES + free)
    return share * scale * own + (1 - share) * seen, free


def _beside(
    views: list[Sightings],
    left: list[tuple[Floats, Floats]],
    noise: tuple[tuple[Floats, float], ...],
    f: Floats,
    first: tuple[float, float],
) -> float:
    """The strongest line near the first (Hz, power) in what it leaves, in sigmas of pure noise.

    0 where it has less than a thousandth of the first one's power: sway and turns of a marker that
    is seen very sharply leave as much.
    """
    peak_hz, peak_power = first
    if peak_hz < SLOW_HZ:
        return 0.0
    near = f[np.abs(f - peak_hz) < NEAR_HZ]
    power, freedom = np.zeros((2, near.size)), 0
    for v, (r, basis), (covariance, _) in zip(views, left, noise, strict=True):
        t = v.row_zero_s
        for k, of in enumerate((covariance, v.covariance_px2.mean(axis=0))):
            W = np.linalg.inv(np.linalg.cholesky(of))
            power[k] += line_power(t, basis, r @ W.T, near)
        freedom += 2 * r.shape[1]
    if power[1].max() < LEAST_BESIDE * peak_power:
        return 0.0
    return float((power[0].max() - freedom / 2) / np.sqrt(freedom / 2))


def _size(views: list[Sightings], noise: tuple[tuple[Floats, float], ...]) -> float:
    """Mean noise variance over the localiser's."""
    ratios = [
        np.trace(np.linalg.solve(v.covariance_px2.mean(axis=0), c)) / c.shape[0]
        for v, (c, _) in zip(views, noise, strict=True)
    ]
    return float(np.mean(ratios))


def whitenings(view: Sightings, noise: Floats) -> Floats:
    """(N, 2P, 2P) inverse roots of the measured covariance, larger where the localiser says so."""
    trace = np.trace(view.covariance_px2, axis1=1, axis2=2)
    factor = np.sqrt(trace / trace.mean())
    return np.asarray(np.linalg.inv(np.linalg.cholesky(noise))[None] / factor[:, None, None])
