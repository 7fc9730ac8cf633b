"""Fitting a marker that is wrapped round a branch: pose of its middle, and how it bends.

The drawing is bent, and further textures say how it changes with the depth that bending gives and
with the curvature; the fit of ``refine`` takes them as it takes the blur's variances.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from olivevib.arrays import Floats, Grey
from olivevib.detection.bend import Bend, Wrapped, depths_px
from olivevib.detection.blur import Blur
from olivevib.detection.card_fit import CardFit, blurred_pixels, plausible
from olivevib.detection.pixels import Singles
from olivevib.detection.refine import fit_template
from olivevib.detection.smear import rounder
from olivevib.detection.template import (
    Template,
    draw_template,
    module_px,
    module_stretches_px,
)
from olivevib.marker import MarkerLayout

TRIAL_ROUNDS, ROUNDS = 2, 6  # of drawing and fitting: for each start, for the best
FOCAL_WIDTHS = 0.8  # focal length of a webcam, widths of its image: good to a third, and enough
STEADY = 0.02  # change of the bend's effect at the marker's edge, px, that ends the rounds
DEPTH_STEP, CURVATURE_STEP = 0.3, 0.02  # of the differences: module sides; per module
MOST_CURVATURE = 0.2  # per module: a branch 10 modules thick, on which a marker goes a third round


def fit_wrapped(
    grey: Grey, white: Singles, H: Floats, layout: MarkerLayout, wrapped: Wrapped
) -> CardFit | None:
    """Fit a bent card from a rough pose H (3, 3) of its middle; the better of both tilts."""
    free = wrapped.radius_modules is None
    shrink = float(module_stretches_px(H)[0]) / (FOCAL_WIDTHS * grey.shape[1])
    starts = [
        Bend(curvature, wrapped.axis_deg, (float(depth[0]), float(depth[1])), shrink, free)
        for curvature in wrapped.curvatures
        for depth in depths_px(H)
    ]
    first = [
        one
        for bend in starts
        if (one := _fit_bend(grey, white, H, layout, (Blur(), bend), free, TRIAL_ROUNDS))
    ]
    if not first:
        return None
    best = min(first, key=lambda one: one.fit.rms / one.fit.gain)
    start = (best.blur, best.bend or starts[0])
    return _fit_bend(grey, white, best.fit.H, layout, start, free, ROUNDS)


def _fit_bend(
    grey: Grey,
    white: Singles,
    H: Floats,
    layout: MarkerLayout,
    start: tuple[Blur, Bend],
    free: bool,
    rounds: int,
) -> CardFit | None:
    (blur, bend), fit = start, None
    for _ in range(rounds):
        if not plausible(H, layout, grey.shape):
            return None
        pixels = blurred_pixels(grey, H, blur, layout)
        if pixels is None:
            return None
        fit = fit_template(_draw(white, H, blur, layout.quiet, bend, free), pixels)
        if fit is None or not np.isfinite(fit.further).all():
            return None
        H, blur = fit.H, rounder(blur, fit.further)
        bend, moved = _bent(bend, fit.further[1:], module_px(H), layout.modules / 2)
        if moved < STEADY:
            break
    return None if fit is None else CardFit(fit, blur, bend=bend)


def _draw(white: Singles, H: Floats, blur: Blur, quiet: int, bend: Bend, free: bool) -> Template:
    """The bent drawing with derivatives by depth x and y (per px) and, if free, by curvature."""
    base = draw_template(white, H, blur, quiet, bend=bend)
    step = DEPTH_STEP * module_px(H)
    x, y = bend.depth_px
    others = [
        (replace(bend, depth_px=(x + step, y)), step),
        (replace(bend, depth_px=(x, y + step)), step),
    ]
    if free:
        others.append((replace(bend, curvature=bend.curvature + CURVATURE_STEP), CURVATURE_STEP))
    parts = [
        (draw_template(white, H, blur, quiet, bend=one).texture[..., 0] - base.texture[..., 0])
        / np.float32(size)
        for one, size in others
    ]
    texture = np.asarray(cv2.merge([*cv2.split(base.texture), *parts]), dtype=np.float32)
    return replace(base, texture=texture)


def _bent(bend: Bend, further: Floats, side_px: float, half: float) -> tuple[Bend, float]:
    """The bend after a fit, and how far its change moves the marker's edge, px."""
    depth = half**2 / 2
    change = np.clip(further[:2], -side_px, side_px)
    moved = float(np.abs(change).max()) * bend.curvature * depth
    curvature = bend.curvature
    if further.size > 2:
        curvature = float(np.clip(curvature + further[2], 0.0, MOST_CURVATURE))
        moved += abs(curvature - bend.curvature) * depth * side_px
    x, y = np.array(bend.depth_px) + change
    return replace(bend, curvature=curvature, depth_px=(float(x), float(y))), moved
