"""Grey image to location bars for the fine detector: two thresholds, moments, affine fill.

A bar under a steep view is a thin parallelogram that blur joins to the code. Sharpening parts them;
a second pass on the logarithm survives the edge of a hard shadow. The fill of a domain is measured
by its moments, which do not change under any affine view.
"""

from __future__ import annotations

import cv2
import numpy as np

from olivevib.arrays import Grey
from olivevib.detection.domains import Bars, Domains, dark_domains, principal_axes

WINDOW_PX = 21  # of the local mean
BELOW = 6  # grey levels below the mean of the sharpened image
BELOW_LOG = 0.12  # below the mean of ln(level + 4)
FILL = (0.72, 1.2)  # area over that of the parallelogram of equal moments
AREA_PX2 = (5, 4000)
LENGTH_PX = (3.0, 260.0)

_LOG_STEP = 60.0  # levels of an 8-bit logarithm per unit
_LOG = np.clip((np.log(np.arange(256) + 4.0) - np.log(4.0)) * _LOG_STEP, 0, 255).round()
_LOG_TABLE = _LOG.astype(np.uint8)


def sharpened_dark(grey: Grey) -> Grey:
    """Dark pixels (1) of the image sharpened threefold: I' = 3 I - 2 Gauss(I, 1 px)."""
    soft = cv2.GaussianBlur(grey, (7, 7), 1.0)
    sharp = cv2.addWeighted(grey, 3.0, soft, -2.0, 0.0)
    return _below_mean(np.asarray(sharp, dtype=np.uint8), BELOW)


def shadowed_dark(grey: Grey) -> Grey:
    """Dark pixels (1) relative to their surroundings: a threshold on the logarithm."""
    logarithm = cv2.GaussianBlur(cv2.LUT(grey, _LOG_TABLE), (5, 5), 0.6)
    return _below_mean(np.asarray(logarithm, dtype=np.uint8), round(BELOW_LOG * _LOG_STEP))


def _below_mean(image: Grey, by: int) -> Grey:
    mean = np.asarray(cv2.boxFilter(image, -1, (WINDOW_PX, WINDOW_PX)))
    dark = cv2.compare(image, cv2.subtract(mean, np.full(1, by, np.float64)), cv2.CMP_LT)
    return np.asarray(dark, dtype=np.uint8)


def fine_bars(dark: Grey) -> Bars:
    """Domains that may be location bars or parts of the code, by their moments alone.

    length and width are those of the rectangle of equal moments, sqrt(12 variance).
    """
    return bars_of(dark_domains(dark))


def bars_of(domains: Domains) -> Bars:
    """The bars among the domains."""
    xx, yy, xy = domains.moments.T
    with np.errstate(divide="ignore", invalid="ignore"):
        fill = domains.area / (12 * np.sqrt(np.maximum(xx * yy - xy * xy, 1e-12)))
    good = (domains.area >= AREA_PX2[0]) & (domains.area <= AREA_PX2[1])
    good &= (fill > FILL[0]) & (fill < FILL[1])
    wanted = np.flatnonzero(good)
    large, small, axis = principal_axes(domains.moments[wanted])
    length, width = np.sqrt(12 * large), np.sqrt(12 * np.maximum(small, 0))
    bars = Bars(domains.centre[wanted], axis, length, width, domains.area[wanted], wanted)
    return bars.only((length >= LENGTH_PX[0]) & (length <= LENGTH_PX[1]))
