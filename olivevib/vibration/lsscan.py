"""How much of a motion a sine of each frequency explains: a least-squares scan on true times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import fft
from scipy.special import gammaincc, gammaln

from olivevib.arrays import Floats
from olivevib.vibration.sums import Complexes, fourier_sums

OVERSAMPLING = 4  # scan points per 1/T
_MANY = 2000  # samples from which an even record goes through the FFT
_EVEN = 1e-6  # of a period
_FAR = 64  # bins of 1/T from a fold: from there on cosine and sine are orthogonal to 1e-5
_WELL_POSED = 1e-3  # determinant of cosine and sine after the mean, of its value far from folds


@dataclass(frozen=True)
class Scan:
    """Power that a sine of each frequency takes out of each axis, with a floating mean.

    f_hz (F,); explained (F, C): drop of the residual sum of squares; total (C,): that sum around
    the mean; freedom: degrees of freedom of the residual; spread_s: rms span sqrt(4 pi var t).
    """

    f_hz: Floats
    explained: Floats
    total: Floats
    freedom: int
    spread_s: float

    @property
    def power(self) -> Floats:
        """(F,) explained power, axes added."""
        return np.asarray(self.explained.sum(axis=1))

    @property
    def evidence(self) -> Floats:
        """(F,) sum over axes of -(nu/2) ln(1 - share explained).

        In white noise each term is exponential with mean 1 whatever the axis's noise level, so
        the sum is a Gamma(C) variable: what the false-alarm probability is computed from.
        """
        safe = np.where(self.total > 0, self.total, 1.0)
        share = np.clip(self.explained / safe, 0.0, 1.0 - 1e-15)
        return np.asarray(-0.5 * self.freedom * np.log1p(-share).sum(axis=1))

    def false_alarm(self, evidence: float, width_hz: float) -> float:
        """Probability that white noise alone reaches ``evidence`` somewhere in ``width_hz``.

        Rice's rate of upcrossings of a chi-square process, after Baluev, MNRAS 385 (2008) 1279,
        doi 10.1111/j.1365-2966.2008.12689.x, for C axes added.
        """
        axes = self.total.size
        if evidence <= 0:
            return 1.0
        single = float(gammaincc(axes, evidence))
        log_rate = (axes - 0.5) * np.log(evidence) - evidence - gammaln(axes)
        crossings = width_hz * self.spread_s * float(np.exp(log_rate))
        return min(1.0, single + crossings)


def scan(
    t_s: Floats, values: Floats, top_hz: float, lost_freedom: int = 0, span_s: float | None = None
) -> Scan:
    """Scan t_s (N,), values (N, C) from 1/T to top_hz in steps of 1/(4T); T: span_s where given.

    Floating mean, closed 2 x 2 normal equations (Zechmeister, Kürster, A&A 496 (2009) 577, doi
    10.1051/0004-6361:200811296). lost_freedom: columns already projected out of the values.
    Frequencies where cosine and sine coincide on these times (multiples of half an even rate)
    explain nothing here.
    """
    n = t_s.size
    centred = values - values.mean(axis=0)
    span = span_s or float(t_s[-1] - t_s[0]) * n / max(1, n - 1)
    step = 1.0 / (OVERSAMPLING * span)
    period = float(t_s[-1] - t_s[0]) / max(1, n - 1)
    even = n > _MANY and bool((np.abs(t_s - t_s[0] - period * np.arange(n)) < _EVEN * period).all())
    if even:
        step = 1.0 / (period * fft.next_fast_len(int(np.ceil(1.0 / (step * period))), real=True))
    count = max(OVERSAMPLING + 1, int(np.floor(top_hz / step)) + 1)
    f_hz = np.asarray(np.arange(count) * step, dtype=np.float64)
    if even:
        explained = _even_explained(centred, period, f_hz)
    else:
        explained = _explained(n, *_sums(t_s - t_s.mean(), centred, f_hz))
    keep = slice(OVERSAMPLING, None)
    return Scan(
        f_hz=f_hz[keep],
        explained=explained[keep],
        total=np.sum(centred**2, axis=0),
        freedom=max(1, n - 3 - lost_freedom),
        spread_s=float(np.sqrt(4 * np.pi * np.var(t_s))),
    )


def _sums(since: Floats, centred: Floats, f_hz: Floats) -> tuple[Complexes, Complexes, Complexes]:
    """Sums of values exp(-iwt) (F, C), of exp(-iwt) and of exp(-2iwt) (F,), t from its mean."""
    step, count = float(f_hz[1]), f_hz.size
    ones = np.ones((since.size, 1))
    both = fourier_sums(since, np.hstack([centred, ones]), step, count)
    return both[:, :-1], both[:, -1], fourier_sums(since, ones, 2 * step, count)[:, 0]


def _even_explained(centred: Floats, period: float, f_hz: Floats) -> Floats:
    """The same of a long even record: one padded FFT; two Dirichlet kernels next to the folds.

    Elsewhere cosine and sine are orthogonal to some 1/(pi f T), and 2|y|^2/n to its square.
    """
    n = centred.shape[0]
    padded = round(1.0 / (period * float(f_hz[1])))
    y = fft.rfft(centred, padded, axis=0)[: f_hz.size]
    out = (y.real**2 + y.imag**2) * (2.0 / n)
    bins = _FAR * OVERSAMPLING
    half = padded // 2
    near = np.r_[: min(bins, f_hz.size), max(bins, min(half - bins, f_hz.size)) : f_hz.size]
    turns = f_hz[near] * period
    kernels = [_dirichlet(k * turns, n).astype(np.complex128) for k in (1, 2)]
    turned = y[near] * np.exp(1j * np.pi * turns * (n - 1))[:, None]
    out[near] = _explained(n, turned, kernels[0], kernels[1])
    return np.asarray(out)


def _dirichlet(turns: Floats, n: int) -> Floats:
    """Sum of exp(-2 pi i turns k) over k centred on zero, n terms: real for symmetry."""
    below = np.sin(np.pi * turns)
    near = np.abs(below) < 1e-12
    sign = np.where(np.rint(turns) % 2 == 0, 1.0, (-1.0) ** (n - 1))
    kernel = np.sin(np.pi * turns * n) / np.where(near, 1.0, below)
    return np.asarray(np.where(near, n * sign, kernel))


def _explained(n: int, y: Complexes, e1: Complexes, e2: Complexes) -> Floats:
    c, s = e1.real, -e1.imag
    cc = (n + e2.real) / 2 - c * c / n
    ss = (n - e2.real) / 2 - s * s / n
    cs = -e2.imag / 2 - c * s / n
    determinant = cc * ss - cs * cs
    posed = determinant > _WELL_POSED * n * n / 4
    safe = np.where(posed, determinant, 1.0)[:, None]
    yc, ys = y.real, -y.imag
    drop = ss[:, None] * yc**2 - 2 * cs[:, None] * yc * ys + cc[:, None] * ys**2
    return np.asarray(np.where(posed[:, None], np.maximum(drop, 0.0) / safe, 0.0))
