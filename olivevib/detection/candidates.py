"""Grey image to location bars for the fine detector: two thresholds, moments, affine fill.

Both thresholds work on the logarithm of the light, where a shadow is a step and not a factor. A bar
under a steep view is a thin parallelogram that blur joins to the code: the first pass sharpens and
so parts them. Sharpening makes halos along the edges of hard shadows: the second pass does not.
The fill of a domain is measured by its moments, which do not change under any affine view.
"""

from __future__ import annotations

import cv2
import numpy as np

from olivevib.arrays import Grey
from olivevib.detection.domains import Bars, Domains, dark_domains, principal_axes

WINDOW_PX = 21  # of the local mean
SHARP = 1.0  # L' = L + SHARP (L - Gauss(L, 1 px))
BELOW_SHARP = 0.2  # below the local mean of ln(level + 4)
BELOW_SOFT = 0.12
FILL = (0.72, 1.2)  # area over that of the parallelogram of equal moments
AREA_PX2 = (5, 4000)
LENGTH_PX = (3.0, 260.0)

_STEP = 60.0  # levels of an 8-bit logarithm per unit
_LOGARITHM = np.rint((np.log(np.arange(256) + 4.0) - np.log(4.0)) * _STEP).astype(np.uint8)


def dark_passes(grey: Grey) -> tuple[Grey, Grey]:
    """Dark pixels of ``grey`` (H, W), non-zero, sharpened and not: for steep views, for shadows."""
    level = np.asarray(cv2.LUT(grey, _LOGARITHM), dtype=np.uint8)
    soft = cv2.GaussianBlur(level, (7, 7), 1.0)
    sharp = np.asarray(cv2.addWeighted(level, 1 + SHARP, soft, -SHARP, 0.0), dtype=np.uint8)
    plain = np.asarray(cv2.GaussianBlur(level, (5, 5), 0.6), dtype=np.uint8)
    return _below_mean(sharp, BELOW_SHARP), _below_mean(plain, BELOW_SOFT)


def _below_mean(level: Grey, by: float) -> Grey:
    mean = np.asarray(cv2.boxFilter(level, -1, (WINDOW_PX, WINDOW_PX)))
    limit = cv2.subtract(mean, np.full(1, round(by * _STEP), np.float64))
    return np.asarray(cv2.compare(level, limit, cv2.CMP_LT), dtype=np.uint8)


def fine_bars(dark: Grey) -> Bars:
    """Domains that may be location bars or parts of the code, by their moments alone.

    length and width are those of the rectangle of equal moments, sqrt(12 variance).
    """
    return bars_of(dark_domains(dark, AREA_PX2))


def bars_of(domains: Domains) -> Bars:
    """The bars among the domains."""
    xx, yy, xy = domains.moments.T
    with np.errstate(divide="ignore", invalid="ignore"):
        fill = domains.area / (12 * np.sqrt(np.maximum(xx * yy - xy * xy, 1e-12)))
    wanted = np.flatnonzero((fill > FILL[0]) & (fill < FILL[1]) & (domains.area > 0))
    large, small, axis = principal_axes(domains.moments[wanted])
    length, width = np.sqrt(12 * large), np.sqrt(12 * np.maximum(small, 0))
    bars = Bars(domains.centre[wanted], axis, length, width, domains.area[wanted], wanted)
    return bars.only((length >= LENGTH_PX[0]) & (length <= LENGTH_PX[1]))
