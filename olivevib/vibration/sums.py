"""Fourier sums over samples at any times: exact where the record is short, gridded where long."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Floats

Complexes = NDArray[np.complex128]

_DIRECT = 20_000  # products up to which the plain sum is the faster way
_WIDTH = 14  # grid cells a sample is spread over: relative error about 1e-12
_BETA = 2.30 * _WIDTH


def fourier_sums(t_s: Floats, values: Floats, step_hz: float, count: int) -> Complexes:
    """Sums over the samples of values exp(-2 pi i k step t), k = 0 ... count-1.

    t_s (N,), values (N, C) real -> (count, C). Long records are spread over a fine even grid with
    a kernel whose own transform is divided out (a non-uniform FFT): the same sums to about 1e-12
    of the largest, no interpolation of the signal. Source: Barnett, Magland, af Klinteberg,
    SIAM J. Sci. Comput. 41 (2019) C479, doi 10.1137/18M120885X.
    """
    if t_s.size * count <= _DIRECT:
        k = np.arange(count)
        turns = np.outer(k * step_hz, t_s)
        return np.asarray(np.exp(-2j * np.pi * turns) @ values)
    return _gridded(t_s, values, step_hz, count)


def _gridded(t_s: Floats, values: Floats, step_hz: float, count: int) -> Complexes:
    cells = 1 << int(np.ceil(np.log2(max(4 * count, 4 * _WIDTH))))
    position = np.mod(t_s * step_hz, 1.0) * cells
    first = np.ceil(position - _WIDTH / 2).astype(np.int64)
    grid = np.zeros((values.shape[1], cells))
    for j in range(_WIDTH):
        cell = first + j
        kernel = _kernel((cell - position) / (_WIDTH / 2))
        for c in range(values.shape[1]):
            grid[c] += np.bincount(cell % cells, kernel * values[:, c], minlength=cells)
    sums = np.fft.rfft(grid, axis=1)[:, :count]
    return np.asarray((sums / _kernel_transform(np.arange(count) / cells)).T)


def _kernel(z: Floats) -> Floats:
    return np.asarray(np.exp(_BETA * (np.sqrt(np.maximum(0.0, 1.0 - z * z)) - 1.0)))


def _kernel_transform(turns_per_cell: Floats) -> Floats:
    """Fourier transform of the kernel by Gauss-Legendre quadrature."""
    nodes, weights = np.polynomial.legendre.leggauss(32)
    z = (nodes + 1) / 2  # half of a symmetric kernel
    waves = np.cos(np.pi * _WIDTH * np.outer(turns_per_cell, z))
    return np.asarray(waves @ (weights * _WIDTH / 2 * _kernel(z)))
