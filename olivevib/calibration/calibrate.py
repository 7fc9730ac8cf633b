"""The door of the room: board views of two cameras in, a calibrated and tested pair out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from olivevib.calibration.bundle import RIGHT
from olivevib.calibration.choice import choose
from olivevib.calibration.closed_form import fixes_homography
from olivevib.calibration.gather import gather, published_rig
from olivevib.calibration.holdout import HoldOut, common_pairs, measure, with_tracks, without
from olivevib.calibration.joint import Pair, fit_joint, fit_single, make_pair
from olivevib.calibration.outliers import Cleaned, drop_outliers
from olivevib.calibration.quality import halves_test
from olivevib.calibration.result import Calibration, ViewUse
from olivevib.calibration.settings import CalibrationSettings
from olivevib.calibration.uncertainty import uncertainty
from olivevib.calibration.views import BoardView
from olivevib.errors import InputError
from olivevib.geometry import CameraModel
from olivevib.progress import Tick, silent

Size = tuple[int, int]
UNFIT = "its points do not fix a homography: fewer than four, or all but one in line"
LEAST_TEST_FRAMES = 6  # common frames below which none is kept for the test


def calibrate(
    left: Sequence[BoardView],
    right: Sequence[BoardView],
    size_left: Size,
    size_right: Size,
    settings: CalibrationSettings | None = None,
    tick: Tick = silent,
) -> Calibration:
    """Calibrate both lenses, their pose and the lag between the videos, tested on unused frames.

    ``left``, ``right``: board views of each camera (videos: with stamps; stills: NaN stamps, paired
    by frame number); sizes (width, height) px. Raises InputError where too few views are common.
    Degenerates (cautions say so) where the board is never tilted or always equally far.
    """
    settings = settings or CalibrationSettings()
    fit_left, fit_right = ([v for v in views if fixes_homography(v)] for views in (left, right))
    pair = make_pair_checked(fit_left, fit_right, (size_left, size_right), settings)
    try:
        result = _calibrated(pair, settings, tick)
    except np.linalg.LinAlgError as error:
        raise InputError(
            "The board views do not determine the cameras.",
            "They are too few, all alike, or their points lie in line.",
            "Show the whole board to both cameras in 10 or more places, tilted, near and far.",
        ) from error
    return replace(result, views=(*result.views, *_unfit(left, "left"), *_unfit(right, "right")))


def _unfit(views: Sequence[BoardView], side: str) -> list[ViewUse]:
    """Views with too few points, or all but one in line."""
    nan = float("nan")
    return [
        ViewUse(side, view.frame, view.t_s, view.ids.size, False, UNFIT, nan)
        for view in views
        if not fixes_homography(view)
    ]


def _calibrated(pair: Pair, settings: CalibrationSettings, tick: Tick) -> Calibration:
    """Test, solve, ask both halves, judge."""
    tick(0, 4, "testing on unused frames")
    tested = cross_validate(pair, settings, tick)
    tick(1, 4, "solving with all frames")
    choice = choose(pair, settings, tick)
    cleaned = fit_all(choice.pair, settings, tick)
    tick(2, 4, "asking both halves")
    halves = halves_test(cleaned.fit)
    tick(3, 4, "judging")
    return replace(gather(pair, cleaned, tested, halves), choice=choice.words)


def fit_all(pair: Pair, settings: CalibrationSettings, tick: Tick = silent) -> Cleaned:
    """Single lenses, joint solve, outliers dropped."""
    fit = fit_joint(pair, settings, fit_single(pair, settings), tick)
    cleaned = drop_outliers(fit, settings)
    obs = cleaned.fit.problem.observations
    shared = np.unique(obs.pose[obs.chain == RIGHT]).size
    if shared < settings.least_pairs:
        raise InputError(
            f"Only {shared} views could be used of both cameras together; at least "
            f"{settings.least_pairs} are needed.",
            "The others do not fit, or the board was lost just when the other camera saw it.",
            "Show the whole board to both cameras at once in 10 or more places, and hold it there.",
        )
    return cleaned


def make_pair_checked(
    left: Sequence[BoardView],
    right: Sequence[BoardView],
    sizes: tuple[Size, Size],
    settings: CalibrationSettings,
) -> Pair:
    """The pair of views, or InputError saying what is missing."""
    for side, views in (("left", left), ("right", right)):
        if len(views) < settings.least_pairs:
            raise InputError(
                f"The {side} camera shows the board in {len(views)} views; at least "
                f"{settings.least_pairs} are needed.",
                "Either the board was rarely in the picture, or it was not recognised.",
                "Show the whole board to both cameras at once in 10 or more places; if it was "
                "there, look at the board's description and at what the diagnosis says.",
            )
    common = len(common_pairs(left, right, 4))
    if common < settings.least_pairs:
        raise InputError(
            f"Both cameras see the board together in {common} views; at least "
            f"{settings.least_pairs} are needed.",
            f"The left camera shows it in {len(left)} views, the right one in {len(right)}, but "
            "hardly at the same time.",
            "Show it to both cameras at once; check that both recordings started together and "
            "that the stamps are those of these recordings.",
        )
    shutters = (settings.left_shutter, settings.right_shutter)
    cameras = [
        _blank(size, s.row_time_s, s.source) for size, s in zip(sizes, shutters, strict=True)
    ]
    return make_pair(left, right, (cameras[0], cameras[1]), settings)


def _blank(size: Size, row_time_s: float, source: str) -> CameraModel:
    width, height = size
    K = np.array([[width, 0, (width - 1) / 2], [0, width, (height - 1) / 2], [0, 0, 1.0]])
    return CameraModel(size, K, np.zeros(5), row_time_s, row_time_source=source)


def cross_validate(
    pair: Pair, settings: CalibrationSettings, tick: Tick = silent
) -> HoldOut | None:
    """Fit without the odd common frames, test on them; None where there are too few."""
    common = common_pairs(pair.left.views, pair.right.views, settings.common_points)
    if len(common) < LEAST_TEST_FRAMES:
        return None
    test = common[1::2]
    left = without(pair.left.views, [k for k, _ in test])
    right = without(pair.right.views, [m for _, m in test])
    cameras = (pair.left.camera, pair.right.camera)
    train = choose(make_pair(left, right, cameras, settings), settings, tick).pair
    cleaned = fit_all(train, settings, tick)
    rig = published_rig(cleaned.fit, uncertainty(cleaned.fit.problem, cleaned.fit.solution))
    scales = (cleaned.fit.lenses[0].scale, cleaned.fit.lenses[1].scale)
    return measure(rig, cleaned.fit.state, with_tracks(pair.sides, cleaned.fit.state, scales), test)
