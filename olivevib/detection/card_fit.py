"""Fitting one marker from a rough pose: coarse, fine, and what light and motion ask for besides."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Floats, Grey
from olivevib.detection.bend import Bend
from olivevib.detection.blur import LEAST_PATH_PX, Blur
from olivevib.detection.pixels import Pixels, Singles, marker_pixels
from olivevib.detection.refine import Fit, approach, fit_template
from olivevib.detection.smear import further_blur, motion_of, rounder
from olivevib.detection.template import COARSE, MOSAIC, REACH, draw_template, module_px
from olivevib.detection.uneven import closed_light, template_light
from olivevib.geometry import apply_homography
from olivevib.marker import MarkerLayout

REDRAWN_PX2 = 0.12  # change of the blur that asks for a new drawing of what moves or is followed
SETTLED_PX2 = 0.05  # and of a still marker that is fitted by itself
COARSE_PX = 15.0  # centre to corner for each pixel of stride in the first fit
EVEN = 0.05  # rms over gain of a marker in even light, covered parts left out
EVENED_NCC = 0.6  # correlation that a coarse fit must have once the light is even
BETTER = 0.7  # of that rms: what evening out the light must achieve to be believed
ROUNDS = 3  # of light and fit in turn
UNEVEN_VARIANCE = 2.5  # covariance of fits in uneven light, times; set on rendered shadows
MOVING_PX2 = 0.9  # variance of the blur from which a motion is looked for
DRAWN = (3, 10)  # drawings at most: of a still marker, of one that moved
LONGER = (1.0, 1.7)  # starts: of the path that the blur's moments show
REDRAWN_PATH_PX = 0.3  # change of a path that asks for a new drawing
REDRAWN_SHAPE_PX = 0.3  # at the corners, of a marker that moved
BELIEVED = 30.0  # fall of the residuals' chi-squared that a mosaic's six numbers cannot feign
WHOLE = 0.97  # mean weight of every ninth of a marker on which a mosaic is looked for
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

    @property
    def noise(self) -> float:
        """What the drawing leaves unexplained: rms over gain."""
        return self.fit.rms / self.fit.gain


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
    one = None
    if found is not None:
        one = _fine(grey, white, layout, found[0], further_blur(blur, found[1]))
    if one is not None:
        one = _with_motion(grey, white, layout, one)
    if one is not None and one.noise <= EVEN:
        return _demosaiced(grey, white, layout, one)
    even = _even(grey, white, H, layout, pixels)
    if one is None or even is None:
        return even or one
    return even if even.noise < BETTER * one.noise else one


def _fine(
    grey: Grey, white: Singles, layout: MarkerLayout, H: Floats, blur: Blur
) -> CardFit | None:
    """Draw where the marker was found and fit all pixels; anew while the blur is another."""
    one = None
    for step in range(DRAWN[1]):
        pixels = blurred_pixels(grey, H, blur, layout)
        fit = pixels and fit_template(draw_template(white, H, blur, layout.quiet), pixels)
        if not fit:
            return None
        wider = further_blur(blur, fit.further)
        one = CardFit(fit, wider)
        if _settled(fit) or (step + 1 >= DRAWN[0] and blur.path_px <= LEAST_PATH_PX):
            return one
        H, blur = fit.H, wider
    return one and replace(one, fit=replace(one.fit, converged=False))


def _settled(fit: Fit) -> bool:
    """Whether blur and, of what moves, path and shape were drawn as the fit found them."""
    if abs(fit.further[0]) >= (REDRAWN_PX2 if fit.further.size == 3 else SETTLED_PX2):
        return False
    path = float(np.hypot(*fit.further[1:])) if fit.further.size == 3 else 0.0
    turned = fit.to_template[:, :2] - np.eye(3)[:, :2]
    moved = fit.scale * float(np.abs(turned).max()) if fit.further.size == 3 else 0.0
    return path < REDRAWN_PATH_PX and moved < REDRAWN_SHAPE_PX


def _with_motion(grey: Grey, white: Singles, layout: MarkerLayout, one: CardFit) -> CardFit:
    """A motion is looked for in what is blurred, and anew where the one that was given fails."""
    if one.blur.path_px == 0 and one.blur.variance_px2 > MOVING_PX2:
        one = _moving(grey, white, layout, one)
    if one.blur.path_px > 0 and one.noise > EVEN:
        one = _moving(grey, white, layout, one)
    return one


def _demosaiced(grey: Grey, white: Singles, layout: MarkerLayout, one: CardFit) -> CardFit:
    """A still, whole marker with a blur as a colour sensor's mosaic leaves it.

    Only where the residuals show one beyond doubt. The noise that is remembered stays that of
    residuals which hold the mosaic, as those of followed markers do.
    """
    still = one.blur.path_px == 0 and np.count_nonzero(one.fit.noise) > 1
    if not (still and one.fit.converged and one.fit.cells.min() >= WHOLE):
        return one
    pixels = blurred_pixels(grey, one.fit.H, one.blur, layout)
    if pixels is None:
        return one
    template = replace(draw_template(white, one.fit.H, one.blur, layout.quiet), mosaic=True)
    fit = fit_template(template, pixels)
    if not fit or not fit.converged:
        return one
    fall = 2 * pixels.x.size * np.log(one.fit.rms / fit.rms)
    if fall < BELIEVED:
        return one
    kept = replace(fit, further=fit.further[:-MOSAIC], noise=one.fit.noise, excess=one.fit.excess)
    return replace(one, fit=kept)


def _moving(grey: Grey, white: Singles, layout: MarkerLayout, one: CardFit) -> CardFit:
    """The same marker with a motion path where its blur is longer than wide; ``one`` if not."""
    H, blur = one.fit.H, replace(one.blur, motion_px=(0.0, 0.0))
    pixels = blurred_pixels(grey, H, blur, layout)
    template = draw_template(white, H, blur, layout.quiet, moments=True)
    fit = pixels and fit_template(template, pixels)
    if not fit:
        return one
    best = one
    start = motion_of(blur, fit.further)
    for longer in LONGER:
        if start.path_px <= LEAST_PATH_PX:
            break
        x, y = start.motion_px
        start = replace(start, motion_px=(longer * x, longer * y))
        moving = _fine(grey, white, layout, fit.H, start)
        if moving is not None and moving.noise < best.noise:
            best = moving
        if best.noise <= EVEN:
            break
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
    card = layout.quiet - blur.edge_px / module_px(H)
    return marker_pixels(
        grey, H, layout.modules, reach_modules=min(REACH, card), path_px=blur.motion_px, card=card
    )


def _reach_px(H: Floats, layout: MarkerLayout) -> float:
    """Mean distance from centre to cornerstones, px."""
    px = apply_homography(H, np.vstack([[[0.0, 0.0]], layout.cornerstones]))
    return float(np.linalg.norm(px[1:] - px[0], axis=1).mean())
