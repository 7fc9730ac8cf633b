"""Location rectangles: each marker is looked for in its last box, enlarged.

Source: paper, section 3.3.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from olivevib.arrays import Floats, Grey
from olivevib.detection import Detection, Detector

QUIET_SHARE = 0.25  # of the marker's box: kept around it so that its border can be read


def read_rectangles(
    detector: Detector, grey: Grey, last: Iterable[Floats], scale: float
) -> dict[int, Detection]:
    """Markers found in the rectangles of their last corners (4, 2), enlarged by ``scale``."""
    height, width = grey.shape
    found: dict[int, Detection] = {}
    for x0, y0, x1, y1 in _merged([_rectangle(c, scale) for c in last]):
        left, top = max(0, int(x0)), max(0, int(y0))
        right, bottom = min(width, int(np.ceil(x1))), min(height, int(np.ceil(y1)))
        if right - left >= 16 and bottom - top >= 16:
            window = np.ascontiguousarray(grey[top:bottom, left:right])
            for detection in detector.detect(window):
                found[detection.id] = _shifted(detection, left, top)
    return found


def _rectangle(corners: Floats, scale: float) -> tuple[float, float, float, float]:
    """The location rectangle: bounding box of the corners about its centre, enlarged."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle, half = (low + high) / 2, (high - low).max() / 2 * (scale + QUIET_SHARE)
    return (middle[0] - half, middle[1] - half, middle[0] + half, middle[1] + half)


def _merged(
    boxes: Sequence[tuple[float, float, float, float]],
) -> list[tuple[float, float, float, float]]:
    """Overlapping boxes joined until none overlap, so that no marker is read twice."""
    left = sorted(boxes)
    done: list[tuple[float, float, float, float]] = []
    while left:
        a = left.pop(0)
        k = next((k for k, b in enumerate(left) if _overlap(a, b)), None)
        if k is None:
            done.append(a)
        else:
            b = left.pop(k)
            left.insert(0, (min(a[0], b[0]), min(a[1], b[1]), max(a[2], b[2]), max(a[3], b[3])))
    joined = any(_overlap(a, b) for n, a in enumerate(done) for b in done[n + 1 :])
    return _merged(done) if joined else done


def _overlap(a: tuple[float, float, float, float], b: tuple[float, float, float, float]) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def _shifted(d: Detection, x: int, y: int) -> Detection:
    """The detection of a window in the coordinates of the whole image."""
    return Detection(
        id=d.id,
        corners_px=d.corners_px + np.array([x, y]),
        corners_cov_px2=d.corners_cov_px2,
        centre_px=d.centre_px + np.array([x, y]),
        centre_cov_px2=d.centre_cov_px2,
        raw_row=d.raw_row + y,
        localiser=d.localiser,
        bit_errors=d.bit_errors,
        flags=d.flags,
    )
