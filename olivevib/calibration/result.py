"""What a calibration hands on: the rig, the lag, the tests, every residual, and the verdict."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from olivevib.arrays import Bools, Floats, Ints, bools, floats, ints
from olivevib.calibration.coverage import Coverage
from olivevib.calibration.holdout import HoldOut
from olivevib.errors import Caution
from olivevib.geometry import StereoRig


@dataclass(frozen=True)
class ViewUse:
    """One board view: camera "left" or "right", frame, points, whether it was used, its rms px.

    reason: why it was not used; rms_px as the square root of the mean squared distance (NaN where
    it was not used).
    """

    camera: str
    frame: int
    t_s: float
    points: int
    used: bool
    reason: str
    rms_px: float


@dataclass(frozen=True)
class Residuals:
    """Every image point of the fit (N,): predicted minus observed px (N, 2).

    camera 0 left, 1 right; frame of its view; id of the board point; px (N, 2) observed, taken to
    the common instant; sigma_px claimed; weight (0: dropped).
    """

    camera: Ints
    frame: Ints
    id: Ints
    px: Floats
    residual_px: Floats
    sigma_px: Floats
    weight: Floats

    def __post_init__(self) -> None:
        n = np.asarray(self.camera).size
        for name in ("camera", "frame", "id"):
            object.__setattr__(self, name, ints(name, getattr(self, name), (n,)))
        for name, shape in (
            ("px", (n, 2)),
            ("residual_px", (n, 2)),
            ("sigma_px", (n,)),
            ("weight", (n,)),
        ):
            object.__setattr__(self, name, floats(name, getattr(self, name), shape))


@dataclass(frozen=True)
class BoardPoses:
    """Where the board was, in the left camera's frame: frame (V,), R (V, 3, 3), t_mm (V, 3).

    both (V,): whether the right camera saw it too.
    """

    frame: Ints
    R: Floats
    t_mm: Floats
    both: Bools

    def __post_init__(self) -> None:
        v = np.asarray(self.frame).size
        object.__setattr__(self, "frame", ints("frame", self.frame, (v,)))
        object.__setattr__(self, "R", floats("R", self.R, (v, 3, 3)))
        object.__setattr__(self, "t_mm", floats("t_mm", self.t_mm, (v, 3)))
        object.__setattr__(self, "both", bools("both", self.both, (v,)))


@dataclass(frozen=True)
class HalfTest:
    """Two halves of the views against each other: name, largest |z|, of which parameter, the
    largest relative difference of a focal length in %, and the rms z of all eight.
    """

    name: str
    largest_z: float
    parameter: str
    focal_percent: float
    rms_z: float = float("nan")


@dataclass(frozen=True)
class Calibration:
    """A calibrated pair, with proof.

    right_offset_s: to be added to the right camera's stamps, so that both cameras agree at sensor
    row ``reference_row`` (minus the lag of the method's page); jitter_s: by how much single
    frames scatter about it; row_time_s (2,) and row_time_sigma_s (2,) of left and right as the
    waved board shows them (NaN: not estimated; the cameras of ``rig`` keep what the caller gave).
    rms_*_px: square root of the mean squared distance (OpenCV's convention) over the points used.
    bow_mm (3,): board height x^2, xy, y^2 at half its width. epipolar_rms_px: on unused frames
    where there are any, else on the fit. point_sigma_px: sigma of a board point in the left and the
    right image, so that the distances on unused frames come out as predicted.
    method: "joint" or "paper". choice: why these views were solved for, empty where all were.
    """

    rig: StereoRig
    right_offset_s: float
    right_offset_sigma_s: float
    reference_row: float
    jitter_s: float
    row_time_s: Floats
    row_time_sigma_s: Floats
    bow_mm: Floats
    bow_sigma_mm: Floats
    rms_left_px: float
    rms_right_px: float
    epipolar_rms_px: float
    holdout: HoldOut | None
    halves: tuple[HalfTest, ...]
    left_coverage: Coverage
    right_coverage: Coverage
    views: tuple[ViewUse, ...] = field(repr=False)
    residuals: Residuals = field(repr=False)
    poses: BoardPoses = field(repr=False)
    point_sigma_px: tuple[float, float]
    cautions: tuple[Caution, ...]
    verdict: str
    method: str = "joint"
    choice: str = ""

    def __post_init__(self) -> None:
        for name, n, nan in (
            ("row_time_s", 2, True),
            ("row_time_sigma_s", 2, True),
            ("bow_mm", 3, False),
            ("bow_sigma_mm", 3, True),
        ):
            object.__setattr__(self, name, floats(name, getattr(self, name), (n,), nan=nan))

    @property
    def common_frames(self) -> int:
        """Frames in which both cameras saw the board and that were used."""
        return int(self.poses.both.sum())
