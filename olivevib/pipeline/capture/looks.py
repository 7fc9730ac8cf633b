"""What a frame of a running camera shows: markers, sharpness, brightness, and advice on them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import cv2
import numpy as np

from olivevib.arrays import Floats, Grey
from olivevib.calibration.views import BoardView
from olivevib.detection import Detection
from olivevib.files.capture import RAW_LUMA, CameraFacts, Controls, Shot
from olivevib.geometry import apply_homography
from olivevib.marker import MarkerLayout

SATURATED_DN = 250
BLUR_PX, SATURATED_SHARE, WHITE_DN, CONTRAST_DN, EXPOSURE_US = 1.6, 0.02, 110.0, 60.0, 2000.0
REACH_MODULES = 0.9  # of the profile on either side of the border: bar and quiet zone are wider
SAMPLES, ENDS = 61, 8
LEAST_DEPTH_DN, LEAST_PROFILES = 15.0, 4
PIXEL_PX = 0.45  # blur by the pixel's area and by interpolation between pixels


@dataclass(frozen=True)
class Look:
    """One decoded frame, at ``t_s`` after the start.

    ids, centres_px (N, 2) and corners_px (N, 4, 2) of the markers seen; blur_px: sigma of their
    borders; white_dn, dark_dn: brightness of paper and print; saturated: share of pixels at the
    upper end, in the markers where there are any, else in the picture; board: what was seen of the
    board. NaN where nothing could be measured.
    """

    t_s: float
    ids: tuple[int, ...]
    centres_px: Floats
    blur_px: float
    white_dn: float
    dark_dn: float
    saturated: float
    board: BoardView | None = None
    corners_px: Floats = field(default_factory=lambda: np.empty((0, 4, 2)))


def grey_of_shot(shot: Shot, facts: CameraFacts) -> Grey | None:
    """The luma of a picture (H, W) as the camera coded it; None where it cannot be decoded."""
    if facts.codec == "mjpeg":
        flags = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION
        try:
            grey = cv2.imdecode(np.frombuffer(shot.data, np.uint8), flags)
        except cv2.error:
            return None
        return None if grey is None else np.asarray(grey, dtype=np.uint8)
    first, step = RAW_LUMA[facts.pixel_format]
    width, height = facts.size_px
    if len(shot.data) < width * height * step:
        return None
    plane = np.frombuffer(shot.data, np.uint8, width * height * step)
    return np.ascontiguousarray(plane.reshape(height, width * step)[:, first::step])


def look_at(
    grey: Grey,
    t_s: float,
    found: list[Detection],
    layout: MarkerLayout,
    board: BoardView | None = None,
) -> Look:
    """Measure a frame in which ``found`` was detected."""
    levels = [_levels(grey, d.corners_px) for d in found]
    white, dark, saturated = np.mean(levels, axis=0) if levels else _picture_levels(grey)
    blurs = [border_blur_px(grey, d.corners_px, layout) for d in found]
    known = [b for b in blurs if math.isfinite(b)]
    return Look(
        t_s=t_s,
        ids=tuple(d.id for d in found),
        centres_px=np.array([d.centre_px for d in found], dtype=np.float64).reshape(-1, 2),
        blur_px=float(np.median(known)) if known else math.nan,
        white_dn=float(white),
        dark_dn=float(dark),
        saturated=float(saturated),
        board=board,
        corners_px=np.array([d.corners_px for d in found], dtype=np.float64).reshape(-1, 4, 2),
    )


def _levels(grey: Grey, corners_px: Floats) -> tuple[float, float, float]:
    """White, dark and share of saturated pixels within a marker's bounding box."""
    low, high = np.floor(corners_px.min(axis=0)), np.ceil(corners_px.max(axis=0))
    x0, y0 = (int(v) for v in np.maximum(low, 0))
    x1, y1 = (int(v) for v in high)
    return _picture_levels(grey[y0 : y1 + 1, x0 : x1 + 1])


def _picture_levels(part: Grey) -> tuple[float, float, float]:
    dark, white = np.percentile(part, (10, 90))
    return float(white), float(dark), float(np.mean(part >= SATURATED_DN))


def border_blur_px(grey: Grey, corners_px: Floats, layout: MarkerLayout) -> float:
    """Sigma of the blur of a marker's outer border, px; NaN where it cannot be measured.

    Profiles across each side: white paper, a dark bar one module wide, white again. Depth of the
    bar over the steepest slope grows with the blur; the pixel's own area and the interpolation are
    taken out. Within 0.1 px from 0.5 px up to a third of a module, above that it reads low.
    """
    corners = layout.cornerstones.astype(np.float32)
    H = np.asarray(cv2.getPerspectiveTransform(corners, corners_px.astype(np.float32)), np.float64)
    half = layout.modules / 2
    across = np.linspace(half - REACH_MODULES, half + REACH_MODULES, SAMPLES)
    blurs = []
    for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1)):
        for along in (-1.5, 0.0, 1.5):
            line = np.column_stack([c * across - s * along, s * across + c * along])
            blurs.append(_bar_blur_px(grey, apply_homography(H, line)))
    known = [b for b in blurs if math.isfinite(b)]
    return float(np.median(known)) if len(known) >= LEAST_PROFILES else math.nan


def _bar_blur_px(grey: Grey, line: Floats) -> float:
    """Sigma from one profile along a line (N, 2) of pixels, from the bar outward."""
    height, width = grey.shape
    if (line < 1).any() or (line[:, 0] > width - 2).any() or (line[:, 1] > height - 2).any():
        return math.nan
    at = line.astype(np.float32)
    profile = cv2.remap(grey, at[None, :, 0], at[None, :, 1], cv2.INTER_LINEAR)
    values = np.asarray(profile, dtype=np.float64).ravel()
    length = float(np.linalg.norm(line[-1] - line[0]))
    depth = float(values[-ENDS:].mean() - values[: SAMPLES // 2].min())
    slope = float(np.gradient(values, length / (SAMPLES - 1)).max())
    if depth < LEAST_DEPTH_DN or slope <= 0:
        return math.nan
    module = length / (2 * REACH_MODULES)
    sigma = module * float(np.interp(depth / (slope * module), _WIDTHS, _BLURS))
    return math.sqrt(max(0.0, sigma**2 - PIXEL_PX**2))


_BLURS = np.linspace(0.02, 1.0, 99)  # sigma of the blur in modules


def _seen_widths() -> Floats:
    """Depth over slope of a blurred bar, in modules, for each of ``_BLURS``; it rises."""
    erf = np.array([math.erf(1 / (2 * math.sqrt(2) * b)) for b in _BLURS])
    edge = (1 - np.exp(-1 / (2 * _BLURS**2))) / (math.sqrt(2 * math.pi) * _BLURS)
    out: Floats = erf / edge
    return out


_WIDTHS = _seen_widths()


def advise(look: Look, controls: Controls) -> tuple[str, ...]:
    """What to change at a camera, in words for a person; empty where all is well."""
    out = []
    exposure = controls.exposure_us
    if exposure is not None and exposure > EXPOSURE_US:
        out.append(
            f"exposure {exposure / 1000:g} ms smears fast motion: set 2 ms or less, add light"
        )
    if look.saturated > SATURATED_SHARE:
        out.append(f"{look.saturated:.0%} too bright: halve the exposure, or shade the markers")
    elif look.ids and look.white_dn < WHITE_DN:
        out.append(f"dark ({look.white_dn:.0f} of 255): more light, or more gain")
    elif look.ids and look.white_dn - look.dark_dn < CONTRAST_DN:
        out.append("little contrast on the markers: glare, or dirt on the lens")
    if look.blur_px > BLUR_PX:
        out.append(f"blurred by {look.blur_px:.1f} px: focus, and shorten the exposure")
    return tuple(out)
