"""The calibration's verdict: what to expect at a marker, and the weakest spot, in one breath."""

from __future__ import annotations

import numpy as np

from olivevib.arrays import Floats
from olivevib.calibration.bundle import LAG
from olivevib.calibration.quality import SIDES, Evidence, focal_percent
from olivevib.calibration.uncertainty import length_sigma, point_sigma
from olivevib.geometry import StereoRig
from olivevib.values import with_sigma


def verdict(e: Evidence, rig: StereoRig, sigma_px: tuple[float, float]) -> str:
    """Plain words: unused frames, sigma at the board's distance, lag, weak spot."""
    distance_mm = float(np.median(e.coverage[0].distance_mm))
    parts = [_tested(e), _expected(rig, distance_mm, sigma_px)]
    if e.fit.lag_free:
        sd = 1e3 * float(np.sqrt(e.sure.published[LAG, LAG]))
        lag = 1e3 * e.fit.state.lag_s
        parts.append(
            f"the right camera is {with_sigma(abs(lag), sd, 1)} ms {'late' if lag > 0 else 'early'}"
        )
    parts.append(f"weakest: {weak_spot(e)}")
    text = "; ".join(part for part in parts if part)
    return text[0].upper() + text[1:] + "."


def _tested(e: Evidence) -> str:
    h = e.holdout
    if h is None:
        return "not tested on unused frames (too few)"
    return (
        f"on {h.frames} unused frames, distances on the board are right to {_two(h.rms_mm)} mm "
        f"({_two(h.rms_percent)} %) rms"
    )


def _expected(rig: StereoRig, distance_mm: float, sigma_px: tuple[float, float]) -> str:
    if rig.covariance is None:
        return ""
    at = working_point(rig, distance_mm)
    sigma = point_sigma(rig, at, sigma_px)
    if not np.isfinite(sigma.frame_mm).all():
        return ""
    half = np.array([[100.0, 0.0, 0.0]])
    length = float(length_sigma(rig, at - half, at + half)[0])
    frame = " / ".join(_two(v) for v in sigma.frame_mm[0])
    return (
        f"at {distance_mm / 1000:.1f} m the calibration itself adds {_two(length)} mm (one sigma) "
        f"to a length of 200 mm, and a board point scatters by {frame} mm in x / y / z from frame "
        "to frame"
    )


def _two(value: float) -> str:
    """A number with two significant digits, never rounded to zero."""
    if value == 0 or not np.isfinite(value):
        return f"{value:.2f}"
    digits = max(2, 1 - int(np.floor(np.log10(abs(value)))))
    return f"{value:.{digits}f}"


def working_point(rig: StereoRig, distance_mm: float) -> Floats:
    """A point (1, 3) in the middle of what both cameras see, at a distance from the left one."""
    axis = rig.R_right_left.T @ np.array([0.0, 0.0, 1.0]) + np.array([0.0, 0.0, 1.0])
    centre = -rig.R_right_left.T @ rig.t_right_left_mm / 2
    axis = axis / np.linalg.norm(axis)
    along = (
        np.sqrt(max(distance_mm**2 - centre @ centre + (centre @ axis) ** 2, 1.0)) - centre @ axis
    )
    return np.asarray((centre + along * axis)[None], dtype=np.float64)


def weak_spot(e: Evidence) -> str:
    """The one thing whose improvement would help most."""
    both = int(e.both.sum())
    if both < 10:
        return f"only {both} views that both cameras share"
    spots: list[tuple[float, str]] = []
    for camera, side in enumerate(SIDES):
        cover = e.coverage[camera]
        spots.append((cover.frontal - 0.3, f"the {side} camera saw too few tilted boards"))
        spots.append(
            (0.6 - cover.filled, f"no board in the {cover.emptiest()} of the {side} image")
        )
        spots.append((1.5 - cover.far_to_near, f"the {side} camera saw the board at one distance"))
        spots.append((focal_percent(e, camera) - 0.7, f"the focal length of the {side} camera"))
    return max(spots)[1]
