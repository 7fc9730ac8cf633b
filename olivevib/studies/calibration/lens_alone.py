"""One lens from its own views, by our fit, by the paper's closed form, or by OpenCV."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import cv2
import numpy as np

from olivevib.arrays import Floats
from olivevib.calibration import BoardView, CalibrationSettings, Shutter, solve_closed
from olivevib.calibration.assemble import Side, shape_of
from olivevib.calibration.closed_form import fixes_homography
from olivevib.calibration.lens import LensFit, fit_lens, mono_prior
from olivevib.calibration.uncertainty import uncertainty
from olivevib.errors import InputError
from olivevib.geometry import CameraModel

Size = tuple[int, int]
Method = Callable[[Sequence[BoardView], Size], Floats]
NO_LENS = np.full(6, np.nan)


def fit(views: Sequence[BoardView], size_px: Size, recording: Sequence[BoardView] = ()) -> LensFit:
    """Our fit of one camera from its own views.

    ``recording``: all views of the video that they are of, whose stamps tell how the board moved in
    each, so that a rolling shutter is estimated as in ``calibrate``; without it they are stills.
    """
    width, height = size_px
    K = np.array([[width, 0, (width - 1) / 2], [0, width, (height - 1) / 2], [0, 0, 1.0]])
    good = tuple(view for view in views if fixes_homography(view))
    tracks, timed = tuple(recording) or good, bool(recording)
    side = Side(good, tracks, CameraModel(size_px, K, np.zeros(5)), timed, height / 2, 0.0)
    readout_s = Shutter().unknown_readout_s() if timed else 0.0
    prior = mono_prior(CalibrationSettings().lens, side, None, readout_s / height)
    return fit_lens(side, shape_of(good), prior)


def ours(views: Sequence[BoardView], size_px: Size) -> Floats:
    """fx, fy, cx, cy, k1, k2 by our fit (6,)."""
    return fit(views, size_px).camera.lens


def of_video(recording: Sequence[BoardView]) -> Method:
    """The same for views of one video, whose other frames tell how the board moved."""

    def method(views: Sequence[BoardView], size_px: Size) -> Floats:
        return fit(views, size_px, recording).camera.lens

    return method


def with_sigma(views: Sequence[BoardView], size_px: Size) -> tuple[Floats, Floats]:
    """The same with published covariance (6, 6)."""
    found = fit(views, size_px)
    return found.camera.lens, uncertainty(found.problem, found.solution).published[:6, :6]


def closed(views: Sequence[BoardView], size_px: Size) -> Floats:
    """The paper's closed form; NaN where it finds no camera."""
    good = [view for view in views if fixes_homography(view)]
    try:
        K = solve_closed(good, size_px, "one").camera.K
    except InputError:
        return NO_LENS
    return np.array([K[0, 0], K[1, 1], K[0, 2], K[1, 2], 0.0, 0.0])


def opencv(views: Sequence[BoardView], size_px: Size) -> Floats:
    """cv2.calibrateCamera with k1 and k2, from its own start."""
    flags = cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K3
    places = [view.board_mm.astype(np.float32) for view in views]
    images = [view.px.astype(np.float32) for view in views]
    try:
        _, K, d, _, _ = cv2.calibrateCamera(places, images, size_px, None, None, flags=flags)
    except cv2.error:
        return NO_LENS
    return np.array([K[0, 0], K[1, 1], K[0, 2], K[1, 2], *d.ravel()[:2]])


METHODS: dict[str, Method] = {"closed form": closed, "OpenCV k1 k2": opencv, "ours": ours}
