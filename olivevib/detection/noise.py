"""The covariance of a fit when neighbouring pixels' noise agrees.

In sharpened, demosaiced, denoised and JPEG images a pixel's noise resembles its neighbours':
C = Σ R(l) s(x) E(x) s(x + l) E(x + l) over lags l, with R the residuals' own autocorrelation. There
noise is also larger along edges, where all that the fit knows comes from: s(x), from the residuals.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from olivevib.arrays import Bools, Floats

if TYPE_CHECKING:
    from olivevib.detection.refine import Pixels, Singles

LAGS = 2  # px, up to which noise may be correlated
DOUBT = 3.0  # standard deviations that make a correlation of the noise believable
UNKNOWNS = 15  # of a fit in even, still light
LEAST_FLAT = 0.1  # noise variance away from edges, of the mean, at least


def noise_covariance(
    pixels: Pixels, E: Singles, residual: Singles, clear: Bools, slope2: Singles
) -> tuple[Floats, Singles, float]:
    """Covariance (8, 8) of estimates Σ E(x) r(x), E (8, N), from the residuals that are clear.

    And the noise itself: its autocorrelation as if it were alike everywhere, variance in the
    middle, and how many times larger its being larger along edges makes the covariance.
    slope2 (N,): squared slope of the fitted image, in any unit.
    """
    alike, kernel = _covariance(pixels, E, residual, clear)
    uneven = edge_noise(residual, slope2, clear)
    if (uneven == 1).all():
        return alike, kernel, 1.0
    C, _ = _covariance(pixels, E * uneven, residual / uneven, clear)
    excess = float((C[2, 2] + C[5, 5]) / (alike[2, 2] + alike[5, 5]))  # of a shift
    return C, kernel, excess


def _covariance(
    pixels: Pixels, E: Singles, residual: Singles, clear: Bools
) -> tuple[Floats, Singles]:
    """Covariance (8, 8) of Σ E(x) r(x) and the residuals' autocorrelation."""
    left, top = int(pixels.x.min()) - LAGS, int(pixels.y.min()) - LAGS
    shape = (int(pixels.y.max()) - top + LAGS + 1, int(pixels.x.max()) - left + LAGS + 1)
    at = (pixels.y - top) * shape[1] + (pixels.x - left)
    noise = np.zeros(shape, dtype=np.float32)
    noise.ravel()[at] = np.where(clear, residual, 0)
    seen = np.zeros(shape, dtype=np.float32)
    seen.ravel()[at] = clear
    kernel = autocorrelation(noise, seen)
    if np.count_nonzero(kernel) == 1:
        white: Floats = (kernel[LAGS, LAGS] * (E @ E.T)).astype(np.float64)
        return white, kernel
    field = np.zeros((shape[0] * shape[1], 8), dtype=np.float32)
    field[at] = E.T
    smeared = cv2.filter2D(field.reshape(*shape, 8), -1, kernel, borderType=cv2.BORDER_CONSTANT)
    C: Floats = (E @ smeared.reshape(-1, 8)[at]).astype(np.float64)
    return (C + C.T) / 2, kernel


def edge_noise(residual: Singles, slope2: Singles, clear: Bools) -> Singles:
    """Noise (N,) of the pixels in units of its root mean square: variance a + b slope².

    Ones where the residuals do not show, beyond doubt, that edges are noisier.
    """
    r2 = residual[clear].astype(np.float64) ** 2
    s = slope2[clear].astype(np.float64)
    mean, spread = float(s.mean()), float(s.std())
    if spread <= 0 or r2.size <= UNKNOWNS:
        return np.ones_like(residual)
    level = float(r2.mean())
    b = float(((s - mean) * r2).mean()) / spread**2
    if b * spread * np.sqrt(r2.size) < DOUBT * np.sqrt(2) * level:
        return np.ones_like(residual)
    a = max(level - b * mean, LEAST_FLAT * level)
    variance = np.asarray(a + b * slope2, dtype=np.float32)
    out: Singles = np.sqrt(variance / variance[clear].mean(), dtype=np.float32)
    return out


def autocorrelation(noise: Singles, seen: Singles) -> Singles:
    """Mean product of residuals at each lag up to LAGS, (2 LAGS + 1) squared, symmetric.

    noise, seen (h, w): residuals and whether they count (1), with a border of LAGS zeros.
    Correlations below DOUBT standard deviations of white noise count as none: their sum would make
    the covariance of clean images uncertain.
    """
    height, width = noise.shape
    out = np.zeros((2 * LAGS + 1, 2 * LAGS + 1), dtype=np.float32)
    freedom = max(float(seen.sum()) - UNKNOWNS, 1.0)
    out[LAGS, LAGS] = variance = float(np.vdot(noise, noise)) / freedom
    rows, columns = slice(0, height - LAGS), slice(LAGS, width - LAGS)
    a, b = noise[rows, columns], seen[rows, columns]
    for dy in range(LAGS + 1):
        for dx in range(-LAGS if dy else 1, LAGS + 1):
            moved = np.s_[dy : height - LAGS + dy, LAGS + dx : width - LAGS + dx]
            count = max(float((b * seen[moved]).sum()), 1.0)
            value = float((a * noise[moved]).sum()) / count
            if abs(value) * np.sqrt(count) > DOUBT * variance:
                out[LAGS + dy, LAGS + dx] = out[LAGS - dy, LAGS - dx] = value
    return out
