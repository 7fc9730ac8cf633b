"""Markers that are partly covered: a second fit that leaves out the cover with a margin around it.

Robust weights drop pixels that are wrong, but the rim of a cover looks like an edge of the marker
when it lies near one, and where cover and print agree nothing is wrong. What lies within a module
or so of the wrong pixels is therefore not believed.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from olivevib.arrays import Bools, Grey
from olivevib.detection.card_fit import CardFit
from olivevib.detection.pixels import Pixels, Singles, marker_pixels
from olivevib.detection.refine import CLEAR, fit_template, only, weights_in_place
from olivevib.detection.template import draw_template, module_px
from olivevib.marker import MarkerLayout

SUSPECT = 0.97  # mean weight of a ninth of the marker below which covers are looked for
MARGIN_MODULES = 1.3  # around wrong pixels that is not believed
LEAST_LEFT = 0.3  # of the pixels
BETTER = 0.7  # of the first residual: what leaving the cover out must achieve to be believed


def without_cover(grey: Grey, white: Singles, one: CardFit, layout: MarkerLayout) -> CardFit:
    """The marker fitted again on what surely is not covered; ``one`` itself where nothing is.

    What the first fit says of covered parts (weight, cells, correlation) stays. Uneven light, which
    is fitted otherwise, is left as it is.
    """
    if one.uneven or one.fit.cells.min() >= SUSPECT:
        return one
    pixels = marker_pixels(grey, one.fit.H, layout.modules)
    template = draw_template(white, one.fit.H, one.blur, layout.quiet)
    if pixels is None:
        return one
    keep = _believed(pixels, weights_in_place(template, pixels), module_px(one.fit.H))
    if keep.all() or keep.mean() < LEAST_LEFT:
        return one
    again = fit_template(template, only(pixels, keep))
    if again is None or not again.converged or again.rms > BETTER * one.fit.rms:
        return one
    kept = replace(again, weight=one.fit.weight, cells=one.fit.cells, whole_ncc=one.fit.whole_ncc)
    return replace(one, fit=kept)


def _believed(pixels: Pixels, weights: Singles, side_px: float) -> Bools:
    """Pixels (N,) farther than the margin from any patch of wrong ones."""
    left, top = int(pixels.x.min()), int(pixels.y.min())
    wrong = np.zeros((int(pixels.y.max()) - top + 1, int(pixels.x.max()) - left + 1), np.uint8)
    at = (pixels.y - top, pixels.x - left)
    wrong[at] = weights < CLEAR
    patches = cv2.morphologyEx(wrong, cv2.MORPH_OPEN, np.ones((2, 2), np.uint8))
    reach = 2 * round(MARGIN_MODULES * side_px) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (reach, reach))
    out: Bools = np.asarray(cv2.dilate(patches, disc))[at] == 0
    return out
