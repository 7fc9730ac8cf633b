"""Fitting a drawn marker to the image: homography, light, blur, and what is known of them.

Gauss-Newton on all pixels of the marker, for the unknowns of ``model``. Robust weights (Tukey) take
covered modules out. See knowledge: the template model, its covariance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Bools, Floats
from olivevib.detection.fitted_points import image_homography
from olivevib.detection.model import (
    Unknowns,
    drawn_level,
    fitted_light,
    in_even_light,
    linearised,
    predicted,
    read_texture,
)
from olivevib.detection.noise import noise_covariance
from olivevib.detection.pixels import Pixels, Singles
from olivevib.detection.template import Template

LEAST_GAIN = 4.0  # grey levels between dark and white
CLEAR = 0.5  # weight above which a pixel counts as not covered
MOVED_PX = 0.02  # a pass that moves no cornerstone farther is the last: the next is quadratic
ROUGH_PX = 0.1  # the same of a first, coarse fit
PASSES = 14  # light that starts on a covered marker takes ten to let go of the cover
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
    residual, grey levels; further (S,): to add to the numbers of the template's blur; weight: mean
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
class _Settled:
    """Where the passes ended: Jacobian (14 + S, N), template level, residual and weight (N,)."""

    state: Unknowns
    J: Singles
    T: Singles
    residual: Singles
    weight: Singles
    converged: bool


def approach(
    template: Template, pixels: Pixels, least_ncc: float = 0.3
) -> tuple[Floats, Floats] | None:
    """A first, coarse fit: pose H (3, 3) and further blur (S,); None where it is lost.

    Lost is what correlates with the image on the whole marker by less than ``least_ncc``.
    """
    end = _settle(template, pixels, ROUGH_PX)
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
    root = np.sqrt(pixels.trust)
    trusted = bool((root == 1).all())
    whitened = end.residual if trusted else end.residual * root
    rms = float(np.sqrt((whitened[clear] ** 2).sum() / (clear.sum() - unknowns)))
    H = image_homography(end.state.W, (pixels.centre, pixels.scale)) @ template.H
    even = in_even_light(pixels, end.state)
    counts = np.maximum(np.bincount(pixels.cell, minlength=9), 1)
    J, E = end.J, np.asarray(inverse.astype(np.float32) @ WJ, dtype=np.float32)
    linear = (J, E) if trusted else (J * root, np.asarray(E / root, dtype=np.float32))
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
    T = read_texture(template, pixels, np.eye(3))[0]
    weight: Singles = np.ones_like(T)
    for _ in range(LIGHT_ROUNDS):
        light = fitted_light(pixels, T, weight * pixels.trust)
        weight = _tukey(
            pixels.level - predicted(pixels, light, T), max(float(light[3]), LEAST_GAIN)
        )
    return weight


def _settle(template: Template, pixels: Pixels, enough_px: float = MOVED_PX) -> _Settled | None:
    """Gauss-Newton until no cornerstone moves by ``enough_px``; Tukey weights from pass two on."""
    state = Unknowns.of(template, pixels.scale)
    reads = read_texture(template, pixels, state.W)
    weight = np.ones_like(pixels.X)
    state.light = fitted_light(pixels, reads[0], weight)
    converged = False
    for step in range(PASSES):
        J, residual = linearised(pixels, reads, state)
        if step:
            weight = _tukey(residual, state.light[3])
        WJ = J * (weight * pixels.trust)
        A = (WJ @ J.T).astype(np.float64)
        A[np.diag_indices(len(A))] *= 1 + 1e-7
        try:
            change = np.asarray(np.linalg.solve(A, WJ @ residual), dtype=np.float64)
        except np.linalg.LinAlgError:
            return None
        state.add(change)
        if not (np.isfinite(change).all() and state.light[3] > LEAST_GAIN):
            return None
        reads = read_texture(template, pixels, state.W)
        if step and np.abs(change[:8]).max() * pixels.scale < enough_px:
            converged = True
            break
    residual -= change.astype(np.float32) @ J
    return _Settled(state, J, drawn_level(pixels, reads, state), residual, weight, converged)


def only(pixels: Pixels, keep: Bools) -> Pixels:
    """The pixels ``keep`` (N,) alone."""
    return replace(
        pixels,
        X=pixels.X[keep],
        Y=pixels.Y[keep],
        level=pixels.level[keep],
        x=pixels.x[keep],
        y=pixels.y[keep],
        cell=pixels.cell[keep],
        trust=pixels.trust[keep],
    )


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


def _correlation(a: Singles, b: Singles) -> float:
    a, b = a - a.mean(), b - b.mean()
    return float(a @ b / max(float(np.sqrt((a @ a) * (b @ b))), 1e-9))
