"""Fitting a drawn marker to the image: homography, light, blur, and what is known of them.

Gauss-Newton on all pixels of the marker. Unknowns: 8 of the homography from image to template, 3 of
the dark level's plane, 3 of the contrast's plane, S of the blur's variances. Robust weights (Tukey)
take covered modules out. See knowledge: the template model, its covariance.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Floats, Grey
from olivevib.detection.fitted_points import image_homography
from olivevib.detection.noise import noise_covariance
from olivevib.detection.template import REACH, Blur, Template
from olivevib.geometry import apply_homography

Singles = NDArray[np.float32]

UNKNOWNS = 14  # and one for each variance of the blur
LEAST_GAIN = 4.0  # grey levels between dark and white
LEAST_PIXELS = 40
MOST_COLUMNS = 32000  # that cv2.remap takes in one row
CLEAR = 0.5  # weight above which a pixel counts as not covered
MOVED_PX = 0.02  # a pass that moves no cornerstone farther is the last: the next is quadratic
PASSES = 8
LEAST_SHARE = 0.15  # of the contrast at the centre that is left anywhere
ENOUGH = 500  # residuals that give the scale of the weights
LIGHT_ROUNDS = 6  # of robust weights and light in turn


@dataclass(frozen=True)
class Fit:
    """A fitted marker.

    H (3, 3): centred modules to px; image, weights (N,): levels that it predicts at the pixels, and
    their robust weights; to_template (3, 3): homography in normalised coordinates
    X = (x - centre)/scale; covariance (8, 8) of its first eight entries; noise (5, 5):
    autocorrelation of the pixels' noise, excess: how many times larger its being larger along edges
    makes the covariance; gain grey levels between dark and white at the centre; rms of the
    residual, grey levels; further (S,): variances to add to the template's blur, px²; weight: mean
    robust weight; cells (3, 3): mean weight of each ninth of the marker; ncc, whole_ncc:
    correlation of image and template where the marker is clear, and on all of it; converged: the
    last pass moved nothing.
    """

    H: Floats
    image: Singles
    weights: Singles
    to_template: Floats
    covariance: Floats
    noise: Singles
    excess: float
    centre: Floats
    scale: float
    gain: float
    rms: float
    further: Floats
    weight: float
    cells: Floats
    ncc: float
    whole_ncc: float
    converged: bool


@dataclass(frozen=True)
class Pixels:
    """The pixels of one marker: normalised X, Y (N,), grey level (N,), and where they lie.

    trust (N,): weight of each pixel by its noise, 1 where nothing is known against it.
    """

    X: Singles
    Y: Singles
    level: Singles
    centre: Floats
    scale: float
    x: NDArray[np.intp]
    y: NDArray[np.intp]
    cell: NDArray[np.intp]  # 0…8: which ninth of the marker, row by row
    trust: Singles


def marker_pixels(
    grey: Grey,
    H: Floats,
    modules: int,
    stride: int = 1,
    reach_modules: float = REACH,
    path_px: tuple[float, float] = (0.0, 0.0),
    card: float = np.inf,
) -> Pixels | None:
    """Every ``stride``-th pixel in each direction on the dark square and some modules around it.

    Of these, whose motion path_px (2,) stays within ``card`` modules around the dark square.
    None where fewer than 40 pixels lie in the image.
    """
    reach = modules / 2 + reach_modules
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
    on = (np.abs(u) <= limit) & (np.abs(v) <= limit)
    for sign in (-0.5, 0.5) if any(path_px) else ():
        du, dv, dw = sign * (G[:, 0] * path_px[0] + G[:, 1] * path_px[1])
        limit = (modules / 2 + card) * np.abs(w + dw)
        on &= (np.abs(u + du) <= limit) & (np.abs(v + dv) <= limit)
    rows, columns = np.nonzero(on)
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
    return Pixels(
        X, Y, grey[py, px].astype(np.float32), centre, scale, px, py, cell, np.ones_like(X)
    )


@dataclass
class _State:
    """Unknowns in the passes: W (3, 3), light (o, ox, oy, g, gx, gy), blur (S,).

    spread (2, 2): covariance of the blur, px², in units of the pixels' scale: light falls on the
    marker before it is blurred. path (2,): motion that is drawn, px; None where nothing moved.
    """

    W: Floats
    light: Floats
    further: Floats
    spread: Floats
    path: Floats | None


@dataclass(frozen=True)
class _Settled:
    """Where the passes ended: Jacobian (14 + S, N), template level, residual and weight (N,)."""

    state: _State
    J: Singles
    T: Singles
    residual: Singles
    weight: Singles
    converged: bool


def approach(
    template: Template, pixels: Pixels, least_ncc: float = 0.3
) -> tuple[Floats, Floats] | None:
    """A first, coarse fit: pose H (3, 3) and further variances (S,); None where it is lost.

    Lost is what correlates with the image on the whole marker by less than ``least_ncc``.
    """
    end = _settle(template, pixels)
    if end is None:
        return None
    if _correlation(end.T, pixels.level) < least_ncc:
        return None
    H = image_homography(end.state.W, (pixels.centre, pixels.scale)) @ template.H
    return H / H[2, 2], end.state.further


def fit_template(template: Template, pixels: Pixels) -> Fit | None:
    """Fit the template to the pixels; None where there is no contrast or the system is singular."""
    end = _settle(template, pixels)
    if end is None:
        return None
    WJ = end.J * (end.weight * pixels.trust)
    try:
        inverse = np.linalg.inv((WJ @ end.J.T).astype(np.float64))
    except np.linalg.LinAlgError:
        return None
    clear = end.weight > CLEAR
    unknowns = len(end.J)
    if clear.sum() <= 2 * unknowns:
        return None
    whitened = np.asarray(end.residual * np.sqrt(pixels.trust), dtype=np.float32)
    rms = float(np.sqrt((whitened[clear] ** 2).sum() / (clear.sum() - unknowns)))
    H = image_homography(end.state.W, (pixels.centre, pixels.scale)) @ template.H
    even = _in_even_light(pixels, end.state)
    counts = np.maximum(np.bincount(pixels.cell, minlength=9), 1)
    root = np.sqrt(pixels.trust)
    linear = (end.J * root, (inverse.astype(np.float32) @ (WJ / root)).astype(np.float32))
    slope2 = end.J[2] ** 2 + end.J[5] ** 2  # by a shift along x, along y
    covariance, noise, excess = noise_covariance(pixels, linear, whitened, clear, slope2)
    return Fit(
        H=H / H[2, 2],
        image=pixels.level - end.residual,
        weights=end.weight,
        to_template=end.state.W,
        covariance=covariance,
        noise=noise,
        excess=excess,
        centre=pixels.centre,
        scale=pixels.scale,
        gain=float(end.state.light[3]),
        rms=rms,
        further=end.state.further,
        weight=float(end.weight.mean()),
        cells=(np.bincount(pixels.cell, end.weight, minlength=9) / counts).reshape(3, 3),
        ncc=_correlation(end.T[clear], even[clear]),
        whole_ncc=_correlation(end.T, even),
        converged=end.converged,
    )


def weights_in_place(template: Template, pixels: Pixels) -> Singles:
    """Robust weights (N,) where the template lies: its light alone is fitted, nothing moves."""
    T = _read(template, pixels, np.eye(3))[0]
    weight: Singles = np.ones_like(T)
    for _ in range(LIGHT_ROUNDS):
        light = _light(pixels, T, weight * pixels.trust)
        weight = _tukey(pixels.level - _image(pixels, light, T), max(float(light[3]), LEAST_GAIN))
    return weight


def _settle(template: Template, pixels: Pixels) -> _Settled | None:
    """Gauss-Newton with Tukey weights from the second pass on."""
    spread = _covariance_px2(template.blur) / pixels.scale
    path = np.array(template.blur.motion_px) if template.moving else None
    state = _State(np.eye(3), np.zeros(6), np.zeros(template.texture.shape[2] - 3), spread, path)
    reads = _read(template, pixels, state.W)
    weight = np.ones_like(pixels.X)
    state.light = _light(pixels, reads[0], weight)
    converged = False
    for step in range(PASSES):
        J, residual = _linearised(pixels, reads, state)
        if step:
            weight = _tukey(residual, state.light[3])
        WJ = J * (weight * pixels.trust)
        A = (WJ @ J.T).astype(np.float64)
        A[np.diag_indices(len(A))] *= 1 + 1e-7
        try:
            change = np.asarray(np.linalg.solve(A, WJ @ residual), dtype=np.float64)
        except np.linalg.LinAlgError:
            return None
        _add(state, change)
        if not (np.isfinite(change).all() and state.light[3] > LEAST_GAIN):
            return None
        reads = _read(template, pixels, state.W)
        if step and np.abs(change[:8]).max() * pixels.scale < MOVED_PX:
            converged = True
            break
    J, residual = _linearised(pixels, reads, state)
    return _Settled(state, J, _level(pixels, reads, state), residual, weight, converged)


def _covariance_px2(blur: Blur) -> Floats:
    return blur.variance_px2 * np.eye(2) + np.outer(blur.motion_px, blur.motion_px) / 12


def _read(template: Template, pixels: Pixels, W: Floats) -> Singles:
    """Texture (3 + S, N) at the pixels seen through W."""
    X, Y = pixels.X, pixels.Y
    M = W.astype(np.float32)
    w = 1 / (M[2, 0] * X + M[2, 1] * Y + M[2, 2])
    offset = (pixels.centre - template.origin_px) * template.samples
    step = np.float32(pixels.scale * template.samples)
    x = (M[0, 0] * X + M[0, 1] * Y + M[0, 2]) * w * step + np.float32(offset[0])
    y = (M[1, 0] * X + M[1, 1] * Y + M[1, 2]) * w * step + np.float32(offset[1])
    parts = [
        cv2.remap(
            template.texture,
            x[None, first : first + MOST_COLUMNS],
            y[None, first : first + MOST_COLUMNS],
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )
        for first in range(0, x.size, MOST_COLUMNS)
    ]
    return np.ascontiguousarray(np.concatenate(parts, axis=1)[0].T, dtype=np.float32)


def _light(pixels: Pixels, T: Singles, weight: Singles) -> Floats:
    """Planes of dark level and contrast (6,) by linear least squares."""
    J = np.stack([np.ones_like(T), pixels.X, pixels.Y, T, pixels.X * T, pixels.Y * T])
    WJ = J * weight
    A = (WJ @ J.T).astype(np.float64) + 1e-3 * np.eye(6)
    return np.asarray(np.linalg.solve(A, (WJ @ pixels.level).astype(np.float64)))


def _level(pixels: Pixels, reads: Singles, state: _State) -> Singles:
    """Template level (N,), 0 dark, 1 white, with the further blur.

    A motion m is the same all over the image, hence in the template, which is drawn with one path,
    it is W's own derivative at each pixel times m.
    """
    out: Singles = reads[0] + state.further.astype(np.float32) @ reads[3:]
    if state.path is not None:
        x, y = (state.path + state.further[1:3]).astype(np.float32)
        M = state.W.astype(np.float32)
        w = 1 / (M[2, 0] * pixels.X + M[2, 1] * pixels.Y + M[2, 2])
        u = (M[0, 0] * pixels.X + M[0, 1] * pixels.Y + M[0, 2]) * w
        v = (M[1, 0] * pixels.X + M[1, 1] * pixels.Y + M[1, 2]) * w
        back = M[2, 0] * x + M[2, 1] * y
        out += ((M[0, 0] * x + M[0, 1] * y - back * u) * w - x) * reads[4]
        out += ((M[1, 0] * x + M[1, 1] * y - back * v) * w - y) * reads[5]
    return out


def _turned_path(pixels: Pixels, along: Singles, path: Floats) -> list[Singles]:
    """Derivatives (N,) by W's eight entries, near 1, of a drawing whose path W turns as well.

    along (2, N): its derivatives by the path's x and y.
    """
    X, Y = pixels.X, pixels.Y
    x, y = path.astype(np.float32)
    p, q = along
    none, both, ahead = np.zeros_like(X), x * p + y * q, X * p + Y * q
    return [
        x * p,
        y * p,
        none,
        x * q,
        y * q,
        none,
        -(X * both + x * ahead),
        -(Y * both + y * ahead),
    ]


def _image(pixels: Pixels, light: Floats, T: Singles) -> Singles:
    """Grey levels (N,) that template level T has in the present light."""
    X, Y = pixels.X, pixels.Y
    o, ox, oy, g, gx, gy = light.astype(np.float32)
    out: Singles = o + ox * X + oy * Y + (g + gx * X + gy * Y) * T
    return out


def _blurred_light(reads: Singles, state: _State) -> Singles:
    """What blurring the light too adds (N,); else 4:1 over 48 px moves a marker by 0.01 px."""
    x, y = (state.spread @ state.light[4:6]).astype(np.float32)
    out: Singles = x * reads[1] + y * reads[2]
    return out


def _in_even_light(pixels: Pixels, state: _State) -> Singles:
    """The pixels (N,) as template levels: the planes of dark and contrast taken out."""
    X, Y = pixels.X, pixels.Y
    o, ox, oy, g, gx, gy = state.light.astype(np.float32)
    gain = np.maximum(g + gx * X + gy * Y, np.float32(LEAST_SHARE) * g)
    out: Singles = (pixels.level - (o + ox * X + oy * Y)) / gain
    return out


def _linearised(pixels: Pixels, reads: Singles, state: _State) -> tuple[Singles, Singles]:
    """Jacobian (14 + S, N) and residual (N,) at the present unknowns."""
    X, Y = pixels.X, pixels.Y
    _, _, _, g, gx, gy = state.light.astype(np.float32)
    gain = g + gx * X + gy * Y
    T = _level(pixels, reads, state)
    residual = pixels.level - _image(pixels, state.light, T) - _blurred_light(reads, state)
    M = state.W.astype(np.float32)
    w = 1 / (M[2, 0] * X + M[2, 1] * Y + M[2, 2])
    bend = gain * w * np.float32(pixels.scale)
    p, q = bend * reads[1], bend * reads[2]
    back = (M[0, 0] * X + M[0, 1] * Y + M[0, 2]) * p + (M[1, 0] * X + M[1, 1] * Y + M[1, 2]) * q
    back *= -w
    one = np.ones_like(X)
    homography = [p * X, p * Y, p, q * X, q * Y, q, back * X, back * Y]
    if state.path is not None:
        turned = _turned_path(pixels, gain * reads[4:6], state.path + state.further[1:3])
        homography = [a + b for a, b in zip(homography, turned, strict=True)]
    (a, b), (c, d) = state.spread.astype(np.float32)
    XT, YT = X * T + (a * reads[1] + c * reads[2]), Y * T + (b * reads[1] + d * reads[2])
    J = np.stack([*homography, one, X, Y, T, XT, YT, *(gain * reads[3:])])
    return J, residual


def _tukey(residual: Singles, gain: float) -> Singles:
    """Weights (1 - (r / 3k)²)², k = max(.12 gain, 1.3 rms of the inner residuals)."""
    size = np.abs(residual)
    scale = max(0.12 * gain, 1.3 * 1.4826 * middle(size))
    u = np.minimum(size / np.float32(3 * scale), np.float32(1))
    out: Singles = (1 - u * u) ** 2
    return out


def middle(size: Singles) -> float:
    """Median of some hundred of the values (N,): enough for the scale of weights."""
    some = size[:: max(1, len(size) // ENOUGH)]
    half = len(some) // 2
    return float(np.partition(some, half)[half])


def _add(state: _State, change: Floats) -> None:
    W = state.W.copy()
    W.ravel()[:8] += change[:8]
    state.W = W
    state.light = state.light + change[8:14]
    state.further = state.further + change[UNKNOWNS:]


def _correlation(a: Singles, b: Singles) -> float:
    a, b = a - a.mean(), b - b.mean()
    return float(a @ b / max(float(np.sqrt((a @ a) * (b @ b))), 1e-9))
