"""The covariance of a fit when neighbouring pixels' noise agrees.

In sharpened, demosaiced, denoised and JPEG images a pixel's noise resembles its neighbours':
C = Σ R(l) s(x) E(x) s(x + l) E(x + l) over lags l, with R the residuals' own autocorrelation. There
noise is also larger along edges, where all that the fit knows comes from: s(x), from the residuals.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Bools, Floats

if TYPE_CHECKING:
    from olivevib.detection.pixels import Pixels, Singles

LAGS = 2  # px, up to which noise may be correlated
DOUBT = 3.0  # standard deviations that make a correlation of the noise believable
UNKNOWNS = 15  # of a fit in even, still light
FEW = 3000  # pixels from which what a fit takes out of its residuals is below 2 %
ROUNDS = 3  # of the noise's correlation and what the fit takes of it
LEAST_FLAT = 0.1  # noise variance away from edges, of the mean, at least


def noise_covariance(
    pixels: Pixels, fit: tuple[Singles, Singles], residual: Singles, clear: Bools, slope2: Singles
) -> tuple[Floats, Singles, float]:
    """Covariance (8, 8) of the first of the estimates Σ E(x) r(x), from residuals that are clear.

    And the noise itself: its autocorrelation as if it were alike everywhere, variance in the
    middle, and how many times larger its being larger along edges makes the covariance.
    fit: Jacobian (U, N) and E (U, N); slope2 (N,): squared slope of the fitted image, in any unit.
    """
    alike, kernel = _covariance(pixels, fit, residual, clear)
    uneven = edge_noise(residual, slope2, clear)
    if (uneven == 1).all():
        return alike, kernel, 1.0
    J, E = fit
    C, _ = _covariance(pixels, (J / uneven, E * uneven), residual / uneven, clear)
    excess = float((C[2, 2] + C[5, 5]) / (alike[2, 2] + alike[5, 5]))  # of a shift
    return C, kernel, excess


def _covariance(
    pixels: Pixels, fit: tuple[Singles, Singles], residual: Singles, clear: Bools
) -> tuple[Floats, Singles]:
    """Covariance (8, 8) of Σ E(x) r(x) and the autocorrelation of the noise."""
    left, top = int(pixels.x.min()) - LAGS, int(pixels.y.min()) - LAGS
    shape = (int(pixels.y.max()) - top + LAGS + 1, int(pixels.x.max()) - left + LAGS + 1)
    at = (pixels.y - top) * shape[1] + (pixels.x - left)
    noise = np.zeros(shape, dtype=np.float32)
    noise.ravel()[at] = np.where(clear, residual, 0)
    seen = np.zeros(shape, dtype=np.float32)
    seen.ravel()[at] = clear
    kernel = autocorrelation(noise, seen)
    E = fit[1]
    if np.count_nonzero(kernel) == 1:
        white: Floats = (kernel[LAGS, LAGS] * (E[:8] @ E[:8].T)).astype(np.float64)
        return white, kernel
    if len(at) <= FEW:
        kernel = _given_back(kernel, fit, at, seen)
    C: Floats = (E[:8] @ _smeared(E[:8], kernel, at, shape)[:, at].T).astype(np.float64)
    return (C + C.T) / 2, kernel


def _given_back(
    kernel: Singles, fit: tuple[Singles, Singles], at: NDArray[np.intp], seen: Singles
) -> Singles:
    """The noise's correlation from the residuals': with what the fit itself has taken out of it.

    Residuals are (1 - P) n, P = J' E, so their correlation is R - P R - R P' + P R P'. With few
    pixels and smooth noise, which looks like a move, that is a third less than R.
    """
    J, E = fit
    rows = np.zeros((len(J), *seen.shape), dtype=np.float32)
    rows.reshape(len(J), -1)[:, at] = J
    out = kernel
    for _ in range(ROUNDS):
        smeared = _smeared(E, out, at, seen.shape)
        half = 0.5 * (E @ smeared[:, at].T) @ rows.reshape(len(J), -1)
        out = kernel + _mean_products(rows, (smeared - half).reshape(rows.shape), seen)
    return out


def _mean_products(a: Singles, b: Singles, seen: Singles) -> Singles:
    """Mean of a(x) b(x + l) + b(x) a(x + l) over pairs that are seen, at each lag; rows summed."""
    height, width = seen.shape
    out = np.zeros((2 * LAGS + 1, 2 * LAGS + 1), dtype=np.float32)
    here = np.s_[: height - LAGS, LAGS : width - LAGS]
    a, b = a * seen, b * seen
    for dy, dx, there in _lags(seen.shape):
        count = max(float((seen[here] * seen[there]).sum()), 1.0)
        total = np.vdot(a[:, *here], b[:, *there]) + np.vdot(b[:, *here], a[:, *there])
        out[LAGS + dy, LAGS + dx] = out[LAGS - dy, LAGS - dx] = total / count
    return out


def _lags(shape: tuple[int, ...]) -> list[tuple[int, int, tuple[slice, slice]]]:
    """Lags (dy, dx) of one half plane and 0, and the slices that they move a picture to."""
    height, width = shape
    return [
        (dy, dx, np.s_[dy : height - LAGS + dy, LAGS + dx : width - LAGS + dx])
        for dy in range(LAGS + 1)
        for dx in range(-LAGS if dy else 0, LAGS + 1)
    ]


def _smeared(E: Singles, kernel: Singles, at: NDArray[np.intp], shape: tuple[int, ...]) -> Singles:
    """Rows (U, h w) of E, spread over the box of the pixels, as the noise's correlation does."""
    field = np.zeros((shape[0] * shape[1], len(E)), dtype=np.float32)
    field[at] = E.T
    out = cv2.filter2D(field.reshape(*shape, -1), -1, kernel, borderType=cv2.BORDER_CONSTANT)
    return np.ascontiguousarray(out.reshape(-1, len(E)).T, dtype=np.float32)


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

    noise, seen (h, w): residuals and whether they count (1), with a border of LAGS zeros. Noise
    whose nearest neighbours agree by less than DOUBT standard deviations of white noise is white:
    variance alone, with the freedom that the fit took.
    """
    width = noise.shape[1]
    flat, mask = noise.ravel(), seen.ravel()  # the border keeps a shift within its row
    out = np.zeros((2 * LAGS + 1, 2 * LAGS + 1), dtype=np.float32)
    variance = float(flat @ flat) / max(float(mask.sum()), 1.0)
    doubt = 0.0
    for dy, dx, _ in _lags(noise.shape):
        step = dy * width + dx
        count = max(float(mask[: mask.size - step] @ mask[step:]), 1.0)
        value = float(flat[: flat.size - step] @ flat[step:]) / count
        out[LAGS + dy, LAGS + dx] = out[LAGS - dy, LAGS - dx] = value
        if 0 < max(dy, abs(dx)) < 2:
            doubt = max(doubt, abs(value) * float(np.sqrt(count)))
    if doubt <= DOUBT * variance:
        out[:] = 0
        out[LAGS, LAGS] = variance * float(seen.sum()) / max(float(seen.sum()) - UNKNOWNS, 1.0)
    return out
