"""Fitting a drawn marker to the image: homography, light, blur, and what is known of them.

Gauss-Newton on all pixels of the marker. Unknowns: 8 of the homography from image to template, 3 of
the dark level's plane, 3 of the contrast's plane, 1 of the blur's variance. Robust weights (Tukey)
take covered modules out. See knowledge: the template model, its covariance.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Floats, Grey
from olivevib.detection.template import SAMPLES, Template
from olivevib.geometry import apply_homography

Singles = NDArray[np.float32]

UNKNOWNS = 15
REACH = 0.6  # modules around the dark square whose pixels count
LEAST_GAIN = 4.0  # grey levels between dark and white
LEAST_PIXELS = 40
MOVED_PX = 0.01  # convergence: no cornerstone moves farther in a pass
PASSES = 8
DOUBT = 3.0  # standard deviations that make a correlation of the noise believable
LAGS = 2  # px, up to which noise may be correlated


@dataclass(frozen=True)
class Fit:
    """A fitted marker.

    H (3, 3): centred modules to px; to_template (3, 3): homography in normalised coordinates
    X = (x - centre)/scale; covariance (8, 8) of its first eight entries; gain grey levels between
    dark and white at the centre; rms of the residual, grey levels; variance_px2 of the blur with
    its sigma; weight: mean robust weight; cells (3, 3): mean weight of each ninth of the marker;
    ncc: correlation of image and template; converged: the last pass moved nothing.
    """

    H: Floats
    to_template: Floats
    covariance: Floats
    centre: Floats
    scale: float
    gain: float
    rms: float
    variance_px2: float
    variance_sigma_px2: float
    weight: float
    cells: Floats
    ncc: float
    converged: bool


@dataclass(frozen=True)
class Pixels:
    """The pixels of one marker: normalised X, Y (N,), grey level (N,), and where they lie."""

    X: Singles
    Y: Singles
    level: Singles
    centre: Floats
    scale: float
    x: NDArray[np.intp]
    y: NDArray[np.intp]
    cell: NDArray[np.intp]  # 0…8: which ninth of the marker, row by row


def marker_pixels(grey: Grey, H: Floats, modules: int, stride: int = 1) -> Pixels | None:
    """Every ``stride``-th pixel in each direction on the dark square and REACH modules around it.

    None where fewer than 40 pixels lie in the image.
    """
    reach = modules / 2 + REACH
    box = apply_homography(H, [[-reach, -reach], [reach, -reach], [reach, reach], [-reach, reach]])
    low = np.maximum(np.ceil(box.min(axis=0)), 0).astype(int)
    high = np.minimum(np.floor(box.max(axis=0)), [grey.shape[1] - 1, grey.shape[0] - 1]).astype(int)
    if (high < low).any():
        return None
    x = np.arange(low[0], high[0] + 1, stride)
    y = np.arange(low[1], high[1] + 1, stride)
    G = np.linalg.inv(H)
    w = G[2, 0] * x + (G[2, 1] * y + G[2, 2])[:, None]
    u = G[0, 0] * x + (G[0, 1] * y + G[0, 2])[:, None]
    v = G[1, 0] * x + (G[1, 1] * y + G[1, 2])[:, None]
    limit = reach * np.abs(w)
    rows, columns = np.nonzero((np.abs(u) <= limit) & (np.abs(v) <= limit))
    third = (modules / 6) * w[rows, columns]
    cell = (u[rows, columns] > third).astype(np.intp) + (u[rows, columns] > -third)
    cell += 3 * ((v[rows, columns] > third).astype(np.intp) + (v[rows, columns] > -third))
    if rows.size < LEAST_PIXELS:
        return None
    centre = H[:2, 2] / H[2, 2]
    half = (modules - 1) / 2
    corners = apply_homography(H, [[-half, -half], [half, -half], [half, half], [-half, half]])
    scale = float(np.linalg.norm(corners - centre, axis=1).mean())
    px, py = x[columns], y[rows]
    X = ((px - centre[0]) / scale).astype(np.float32)
    Y = ((py - centre[1]) / scale).astype(np.float32)
    return Pixels(X, Y, grey[py, px].astype(np.float32), centre, scale, px, py, cell)


@dataclass
class _State:
    """Unknowns while they are fitted: W (3, 3) and (o, ox, oy, g, gx, gy, change of variance)."""

    W: Floats
    light: Floats
    spread: float = 0.0


def fit_template(
    template: Template, pixels: Pixels, robust: bool = False, start: Floats | None = None
) -> Fit | None:
    """Fit the template to the pixels; None where there is no contrast or the system is singular.

    start (3, 3): homography to the template to begin with, normalised; the identity if not given.
    """
    state = _State(np.eye(3) if start is None else start, np.zeros(6))
    reads = _read(template, pixels, state.W)
    state.light = _light(pixels, reads[:, 0], np.ones_like(pixels.X))
    converged = False
    weight = np.ones_like(pixels.X)
    for step in range(PASSES):
        J, residual = _linearised(pixels, reads, state)
        if robust and step >= 1:
            weight = _tukey(residual, state.light[3])
        WJ = J * weight[:, None]
        A = (WJ.T @ J).astype(np.float64)
        A[np.diag_indices(UNKNOWNS)] *= 1 + 1e-7
        try:
            change = np.asarray(np.linalg.solve(A, WJ.T @ residual), dtype=np.float64)
        except np.linalg.LinAlgError:
            return None
        _add(state, change)
        if not (np.isfinite(change).all() and state.light[3] > LEAST_GAIN):
            return None
        reads = _read(template, pixels, state.W)
        if np.abs(change[:8]).max() * pixels.scale < MOVED_PX:
            converged = True
            break
    return _finished(template, pixels, state, weight, converged)


def _read(template: Template, pixels: Pixels, W: Floats) -> Singles:
    """Texture (N, 4) at the pixels seen through W."""
    X, Y = pixels.X, pixels.Y
    M = W.astype(np.float32)
    w = 1 / (M[2, 0] * X + M[2, 1] * Y + M[2, 2])
    offset = (pixels.centre - template.origin_px) * SAMPLES
    step = np.float32(pixels.scale * SAMPLES)
    x = (M[0, 0] * X + M[0, 1] * Y + M[0, 2]) * w * step + np.float32(offset[0])
    y = (M[1, 0] * X + M[1, 1] * Y + M[1, 2]) * w * step + np.float32(offset[1])
    fold = 256  # cv2.remap takes at most 32767 columns
    pad = -x.size % fold
    at_x, at_y = (np.pad(m, (0, pad)).reshape(-1, fold) for m in (x, y))
    out = cv2.remap(template.texture, at_x, at_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(out, dtype=np.float32).reshape(-1, 4)[: x.size]


def _light(pixels: Pixels, T: Singles, weight: Singles) -> Floats:
    """Planes of dark level and contrast (6,) by linear least squares."""
    one = np.ones_like(T)
    J = np.column_stack([one, pixels.X, pixels.Y, T, pixels.X * T, pixels.Y * T])
    WJ = J * weight[:, None]
    A = (WJ.T @ J).astype(np.float64) + 1e-3 * np.eye(6)
    return np.asarray(np.linalg.solve(A, (WJ.T @ pixels.level).astype(np.float64)))


def _linearised(pixels: Pixels, reads: Singles, state: _State) -> tuple[Singles, Singles]:
    """Jacobian (N, 15) and residual (N,) at the present unknowns."""
    X, Y = pixels.X, pixels.Y
    o, ox, oy, g, gx, gy = state.light.astype(np.float32)
    gain = g + gx * X + gy * Y
    T = reads[:, 0] + np.float32(state.spread) * reads[:, 3]
    residual = pixels.level - (o + ox * X + oy * Y) - gain * T
    M = state.W.astype(np.float32)
    w = 1 / (M[2, 0] * X + M[2, 1] * Y + M[2, 2])
    Xt = (M[0, 0] * X + M[0, 1] * Y + M[0, 2]) * w
    Yt = (M[1, 0] * X + M[1, 1] * Y + M[1, 2]) * w
    bend = gain * w * np.float32(pixels.scale)
    p, q = bend * reads[:, 1], bend * reads[:, 2]
    back = -(p * Xt + q * Yt)
    J = np.empty((X.size, UNKNOWNS), dtype=np.float32)
    columns = [p * X, p * Y, p, q * X, q * Y, q, back * X, back * Y]
    columns += [np.ones_like(X), X, Y, T, X * T, Y * T, gain * reads[:, 3]]
    for k, column in enumerate(columns):
        J[:, k] = column
    return J, residual


def _tukey(residual: Singles, gain: float) -> Singles:
    """Weights (1 - (r / 3k)²)², k = max(.12 gain, 1.3 rms of the inner residuals)."""
    scale = max(0.12 * gain, 1.3 * 1.4826 * float(np.median(np.abs(residual))))
    u = np.minimum(np.abs(residual) / (3 * scale), 1)
    out: Singles = (1 - u * u) ** 2
    return out


def _add(state: _State, change: Floats) -> None:
    W = state.W.copy()
    W.ravel()[:8] += change[:8]
    state.W = W
    state.light = state.light + change[8:14]
    state.spread += float(change[14])


def _finished(
    template: Template, pixels: Pixels, state: _State, weight: Singles, converged: bool
) -> Fit | None:
    reads = _read(template, pixels, state.W)
    J, residual = _linearised(pixels, reads, state)
    WJ = J * weight[:, None]
    freedom = max(float(weight.sum()) - UNKNOWNS, 1.0)
    variance = float((weight * residual**2).sum()) / freedom
    try:
        inverse = np.linalg.inv((WJ.T @ J).astype(np.float64))
    except np.linalg.LinAlgError:
        return None
    H = _from_template(pixels, state.W) @ template.H
    T = reads[:, 0]
    seen = weight > 0.2
    ncc = float(np.corrcoef(T[seen], pixels.level[seen])[0, 1]) if seen.sum() > UNKNOWNS else 0.0
    counts = np.maximum(np.bincount(pixels.cell, minlength=9), 1)
    return Fit(
        H=H / H[2, 2],
        to_template=state.W,
        covariance=_spread(pixels, WJ @ inverse[:, :8].astype(np.float32), residual),
        centre=pixels.centre,
        scale=pixels.scale,
        gain=float(state.light[3]),
        rms=float(np.sqrt(variance)),
        variance_px2=template.variance_px2 + state.spread,
        variance_sigma_px2=float(np.sqrt(variance * inverse[14, 14])),
        weight=float(weight.mean()),
        cells=(np.bincount(pixels.cell, weight, minlength=9) / counts).reshape(3, 3),
        ncc=ncc,
        converged=converged,
    )


def _from_template(pixels: Pixels, W: Floats) -> Floats:
    """The homography (3, 3) from template to image, px, of W in normalised coordinates."""
    N = np.array([[1, 0, -pixels.centre[0]], [0, 1, -pixels.centre[1]], [0, 0, pixels.scale]])
    N = N / pixels.scale
    out: Floats = np.linalg.inv(N) @ np.linalg.inv(W) @ N
    return out


def _spread(pixels: Pixels, E: Singles, residual: Singles) -> Floats:
    """Covariance (8, 8) of estimates Σ E(x) r(x), E (N, 8), when neighbouring residuals agree.

    C = Σ R(l) E(x) E(x + l) with R the residuals' own autocorrelation up to LAGS px: sharpened,
    demosaiced, denoised and JPEG images have noise in which a pixel resembles its neighbours.
    """
    left, top = pixels.x.min() - LAGS, pixels.y.min() - LAGS
    shape = (pixels.y.max() - top + LAGS + 1, pixels.x.max() - left + LAGS + 1)
    at = (pixels.y - top, pixels.x - left)
    field = np.zeros((*shape, 8), dtype=np.float32)
    field[at] = E
    noise = np.zeros(shape, dtype=np.float32)
    noise[at] = residual
    seen = np.zeros(shape, dtype=np.float32)
    seen[at] = 1
    kernel = _autocorrelation(noise, seen, residual.size - UNKNOWNS)
    smeared = cv2.filter2D(field, -1, kernel, borderType=cv2.BORDER_CONSTANT)[at]
    C: Floats = (E.T @ smeared).astype(np.float64)
    return (C + C.T) / 2


def _autocorrelation(noise: Singles, seen: Singles, freedom: int) -> Singles:
    """Mean product of residuals at each lag up to LAGS, (2 LAGS + 1) squared, symmetric.

    Correlations below DOUBT standard deviations of white noise count as none: their sum would make
    the covariance of clean images uncertain.
    """
    height, width = noise.shape
    out = np.zeros((2 * LAGS + 1, 2 * LAGS + 1), dtype=np.float32)
    out[LAGS, LAGS] = variance = float(np.vdot(noise, noise)) / max(freedom, 1)
    inner = np.s_[LAGS : height - LAGS, LAGS : width - LAGS]
    for dy in range(LAGS + 1):
        for dx in range(-LAGS if dy else 1, LAGS + 1):
            moved = np.s_[LAGS + dy : height - LAGS + dy, LAGS + dx : width - LAGS + dx]
            count = max(float(np.vdot(seen[inner], seen[moved])), 1.0)
            value = float(np.vdot(noise[inner], noise[moved])) / count
            if abs(value) * np.sqrt(count) > DOUBT * variance:
                out[LAGS + dy, LAGS + dx] = out[LAGS - dy, LAGS - dx] = value
    return out


def point_jacobian(fit: Fit, points: Floats) -> Floats:
    """Derivative (N, 2, 8), px, of the images of fixed module points (N, 2) by the homography."""
    x = apply_homography(fit.H, points)
    X, Y = ((x - fit.centre) / fit.scale).T
    W = fit.to_template
    w = W[2, 0] * X + W[2, 1] * Y + W[2, 2]
    Xt = (W[0, 0] * X + W[0, 1] * Y + W[0, 2]) / w
    Yt = (W[1, 0] * X + W[1, 1] * Y + W[1, 2]) / w
    Q = np.zeros((len(points), 2, 8))
    Q[:, 0, 0] = Q[:, 1, 3] = X
    Q[:, 0, 1] = Q[:, 1, 4] = Y
    Q[:, 0, 2] = Q[:, 1, 5] = 1
    Q[:, 0, 6], Q[:, 0, 7] = -Xt * X, -Xt * Y
    Q[:, 1, 6], Q[:, 1, 7] = -Yt * X, -Yt * Y
    B = np.empty((len(points), 2, 2))
    B[:, 0, 0], B[:, 0, 1] = W[0, 0] - Xt * W[2, 0], W[0, 1] - Xt * W[2, 1]
    B[:, 1, 0], B[:, 1, 1] = W[1, 0] - Yt * W[2, 0], W[1, 1] - Yt * W[2, 1]
    out: Floats = np.asarray(-fit.scale * np.linalg.solve(B, Q), dtype=np.float64)
    return out
