"""Fitting one marker from a rough pose: coarse, fine, and what light and motion ask for besides."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Floats, Grey
from olivevib.detection.bend import Bend
from olivevib.detection.refine import Fit, Pixels, Singles, approach, fit_template, marker_pixels
from olivevib.detection.template import COARSE, REACH, Blur, draw_template, module_px
from olivevib.detection.uneven import closed_light, template_light
from olivevib.geometry import apply_homography
from olivevib.marker import MarkerLayout

VARIANCES_PX2 = (0.15, 6.0)  # blur that is believed
REDRAWN_PX2 = 0.12  # change of the blur that asks for a new drawing
COARSE_PX = 15.0  # centre to corner for each pixel of stride in the first fit
EVEN = 0.05  # rms over gain of a marker in even light, covered parts left out
EVENED_NCC = 0.6  # correlation that a coarse fit must have once the light is even
BETTER = 0.7  # of that rms: what evening out the light must achieve to be believed
ROUNDS = 3  # of light and fit in turn
UNEVEN_VARIANCE = 2.5  # covariance of fits in uneven light, times; set on rendered shadows
MOVING_PX2 = 0.9  # variance of the blur from which a motion is looked for
ELONGATED_PX2 = 0.3  # difference of the blur's two variances that is a motion
MOTION_ROUNDS = 3
BEYOND = 0.25  # image sizes by which a marker's card may leave the image
WIDEST_PX = 900.0  # of a marker's card
SHARP = Blur()  # of a good lens in focus


@dataclass(frozen=True)
class CardFit:
    """A fitted marker with its blur, whether its light had to be evened out, and how it is bent."""

    fit: Fit
    blur: Blur
    uneven: bool = False
    bend: Bend | None = None


def fit_card(
    grey: Grey, white: Singles, H: Floats, layout: MarkerLayout, blur: Blur = SHARP
) -> CardFit | None:
    """Fit a card to the image from pose H (3, 3), centred modules to px, and a blur to start with.

    None where it does not fit: no contrast, outside the image, lost.
    """
    if not plausible(H, layout, grey.shape):
        return None
    stride = max(1, round(_reach_px(H, layout) / COARSE_PX))
    pixels = marker_pixels(grey, H, layout.modules, stride)
    if pixels is None:
        return None
    found = approach(draw_template(white, H, blur, layout.quiet, COARSE), pixels)
    one = None if found is None else _fine(grey, white, layout, found[0], _further(blur, found[1]))
    if one is not None and one.fit.rms <= EVEN * one.fit.gain:
        return one
    if one is not None and (one.blur.variance_px2 > MOVING_PX2 or one.blur.path_px > 0):
        one = _moving(grey, white, layout, one)
        if one.fit.rms <= EVEN * one.fit.gain:
            return one
    even = _even(grey, white, H, layout, pixels)
    if one is None or even is None:
        return even or one
    return even if _noise(even) < BETTER * _noise(one) else one


def _fine(
    grey: Grey, white: Singles, layout: MarkerLayout, H: Floats, blur: Blur
) -> CardFit | None:
    """Draw where the marker was found and fit all pixels; once more if the blur was other."""
    one = None
    for _ in range(2):
        pixels = blurred_pixels(grey, H, blur, layout)
        fit = pixels and fit_template(draw_template(white, H, blur, layout.quiet), pixels)
        if not fit:
            return None
        wider = _further(blur, fit.further)
        one = CardFit(fit, wider)
        if abs(fit.further[0]) < REDRAWN_PX2:
            break
        H, blur = fit.H, wider
    return one


def _moving(grey: Grey, white: Singles, layout: MarkerLayout, one: CardFit) -> CardFit:
    """The same marker with a motion path where its blur is longer than wide; ``one`` if not."""
    H, blur = one.fit.H, one.blur
    pixels = blurred_pixels(grey, H, blur, layout)
    template = draw_template(white, H, blur, layout.quiet, moments=True)
    fit = pixels and fit_template(template, pixels)
    if not fit:
        return one
    moving = _motion(blur, fit.further)
    best = one
    for _ in range(MOTION_ROUNDS):
        if moving.path_px == 0:
            return best
        H = fit.H
        pixels = blurred_pixels(grey, H, moving, layout)
        fit = pixels and fit_template(draw_template(white, H, moving, layout.quiet), pixels)
        if not fit:
            return best
        moving = _longer(moving, fit.further)
        if fit.rms / fit.gain < _noise(best):
            best = CardFit(fit, moving)
    return best


def _even(
    grey: Grey, white: Singles, H: Floats, layout: MarkerLayout, pixels: Pixels
) -> CardFit | None:
    """Fit with the light divided out: as a closing shows it, then as the template shows it."""
    side, blur = module_px(H), Blur()
    coarse = draw_template(white, H, blur, layout.quiet, COARSE)
    found = approach(coarse, closed_light(grey, pixels, side), EVENED_NCC)
    if found is None:
        return None
    H, blur = found[0], rounder(blur, found[1])
    raw = blurred_pixels(grey, H, blur, layout)
    if raw is None:
        return None
    even = closed_light(grey, raw, side)
    fit: Fit | None = None
    for _ in range(ROUNDS + 1):
        fit = fit_template(draw_template(white, H, blur, layout.quiet), even)
        if fit is None or not plausible(fit.H, layout, grey.shape):
            return None
        H, blur = fit.H, rounder(blur, fit.further)
        even = template_light(raw, fit.image, fit.weights, side)
    assert fit is not None
    return CardFit(replace(fit, covariance=UNEVEN_VARIANCE * fit.covariance), blur, uneven=True)


def plausible(H: Floats, layout: MarkerLayout, shape: tuple[int, ...]) -> bool:
    """Whether H shows a whole marker, front side, not far beyond the image (height, width).

    What a fit that lost its way returns is caught here, before it is drawn at any size.
    """
    reach = layout.modules / 2 + layout.quiet
    box = np.array([[-reach, -reach, 1], [reach, -reach, 1], [reach, reach, 1], [-reach, reach, 1]])
    px = box @ H.T
    if not np.isfinite(px).all() or (px[:, 2] * px[0, 2] <= 1e-3 * px[0, 2] ** 2).any():
        return False
    corners = px[:, :2] / px[:, 2:]
    size = np.array([shape[1], shape[0]])
    inside = (corners > -BEYOND * size).all() and (corners < (1 + BEYOND) * size).all()
    d, e = corners[2] - corners[0], corners[3] - corners[1]
    return bool(
        inside and d[0] * e[1] - d[1] * e[0] > 0 and np.ptp(corners, axis=0).max() < WIDEST_PX
    )


def blurred_pixels(grey: Grey, H: Floats, blur: Blur, layout: MarkerLayout) -> Pixels | None:
    """All pixels of the marker that nothing beyond its card is smeared into; None if H is wild."""
    if not plausible(H, layout, grey.shape):
        return None
    reach = min(REACH, layout.quiet - blur.half_width_px / module_px(H))
    return marker_pixels(grey, H, layout.modules, reach_modules=reach)


def rounder(blur: Blur, further: Floats) -> Blur:
    """A blur whose variance is larger by the first of ``further``, as far as it is believed."""
    return replace(blur, variance_px2=_believed(blur.variance_px2 + float(further[0])))


def _further(blur: Blur, further: Floats) -> Blur:
    return _longer(blur, further) if further.size == 2 else rounder(blur, further)


def _longer(blur: Blur, further: Floats) -> Blur:
    """A moving blur with further variances: round, and along its path (path² / 12)."""
    path2 = max(blur.path_px**2 + 12 * float(further[1]), 0.0)
    scale = float(np.sqrt(path2)) / blur.path_px
    x, y = blur.motion_px
    return Blur(_believed(blur.variance_px2 + float(further[0])), (scale * x, scale * y))


def _motion(blur: Blur, further: Floats) -> Blur:
    """A motion along the longer axis of the blur, if it is clearly longer; xx, xy, yy added."""
    path = np.array(blur.motion_px)
    drawn = blur.variance_px2 * np.eye(2) + np.outer(path, path) / 12
    V = drawn + further[[0, 1, 1, 2]].reshape(2, 2)
    small, large = np.linalg.eigvalsh(V)
    if large - small < ELONGATED_PX2:
        return replace(blur, motion_px=(0.0, 0.0))
    angle = 0.5 * np.arctan2(2 * V[0, 1], V[0, 0] - V[1, 1])
    small = _believed(float(small))
    length = float(np.sqrt(12 * (large - small))) if large > small else 0.0
    return Blur(small, (length * float(np.cos(angle)), length * float(np.sin(angle))))


def _believed(variance_px2: float) -> float:
    return float(np.clip(variance_px2, *VARIANCES_PX2))


def _noise(one: CardFit) -> float:
    return one.fit.rms / one.fit.gain


def _reach_px(H: Floats, layout: MarkerLayout) -> float:
    """Mean distance from centre to cornerstones, px."""
    px = apply_homography(H, np.vstack([[[0.0, 0.0]], layout.cornerstones]))
    return float(np.linalg.norm(px[1:] - px[0], axis=1).mean())
