"""Quintic B-splines on even knots: the six that live at an instant, and their derivatives."""

from __future__ import annotations

from dataclasses import dataclass
from math import comb, factorial

import numpy as np

from olivevib.arrays import Floats, Ints

ORDER = 6  # coefficients that live at an instant


def _pieces() -> Floats:
    """(6, 6): coefficient of u^p of the b-th living spline, u in 0 ... 1 from the knot before."""
    out = np.zeros((ORDER, ORDER))
    n = ORDER - 1
    for b in range(ORDER):
        x0 = n - b  # the spline's own argument at u = 0
        for k in range(x0 + 1):
            for p in range(ORDER):
                out[b, p] += (-1) ** k * comb(ORDER, k) * comb(n, p) * (x0 - k) ** (n - p)
    out /= factorial(n)
    out.flags.writeable = False
    return out


PIECES = _pieces()


@dataclass(frozen=True)
class Knots:
    """Even knots: the first living interval starts at first_s; count: number of coefficients."""

    first_s: float
    step_s: float
    count: int

    def interval(self, t_s: Floats) -> Ints:
        """Number of the interval of each instant, the ends continued."""
        i = np.floor((t_s - self.first_s) / self.step_s).astype(np.int64)
        return np.clip(i, 0, self.count - ORDER)

    def weights(self, t_s: Floats, interval: Ints, derivative: int = 0) -> Floats:
        """(..., 6) values of the living splines of ``interval`` at t_s (its polynomials)."""
        u = (t_s - self.first_s) / self.step_s - interval
        powers = np.zeros((*np.shape(u), ORDER))
        for p in range(derivative, ORDER):
            powers[..., p] = factorial(p) / factorial(p - derivative) * u ** (p - derivative)
        out: Floats = powers @ PIECES.T / self.step_s**derivative
        return out

    def values(self, coefficients: Floats, t_s: Floats, derivative: int = 0) -> Floats:
        """(..., C) of the curve with coefficients (count, C) at t_s."""
        i = self.interval(t_s)
        w = self.weights(t_s, i, derivative)
        picked = coefficients[i[..., None] + np.arange(ORDER)]
        return np.asarray(np.einsum("...b,...bc->...c", w, picked))

    def matrix(self, t_s: Floats, derivative: int = 0) -> Floats:
        """(N, count) dense values of all splines at t_s (N,)."""
        i = self.interval(t_s)
        out = np.zeros((t_s.size, self.count))
        rows = np.arange(t_s.size)[:, None]
        out[rows, i[:, None] + np.arange(ORDER)] = self.weights(t_s, i, derivative)
        return out


def knots_over(start_s: float, end_s: float, step_s: float) -> Knots:
    """Even knots that cover the span, the step shortened a little to fit."""
    intervals = max(1, int(np.ceil((end_s - start_s) / step_s - 1e-9)))
    return Knots(start_s, (end_s - start_s) / intervals, intervals + ORDER - 1)
