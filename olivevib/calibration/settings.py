"""What a person may set about a calibration; every default is the method's own."""

from __future__ import annotations

from dataclasses import dataclass

from olivevib.geometry import CameraModel


@dataclass(frozen=True)
class LensPrior:
    """Weak knowledge of a webcam's lens, needed where recordings are short or flat.

    aspect_sd: beta/alpha = 1 +- this; centre_sd: principal point about the image centre, share of
    the width; distortion_sd of k1, k2; bow_sd_mm: the board's bend at half its width.
    """

    aspect_sd: float = 0.005
    centre_sd: float = 0.02
    distortion_sd: float = 0.5
    bow_sd_mm: float = 1.0


@dataclass(frozen=True)
class Shutter:
    """How one camera reads its rows: ``row_time_s`` per row (signed; 0: global or unknown).

    source: "unknown", "global", "declared", "led", "board", "trial" as in CameraModel. Where it is
    unknown, views in which the board moves count for less, as if ``assumed_readout_s`` passed
    between the first and the last row.
    """

    row_time_s: float = 0.0
    source: str = "unknown"
    assumed_readout_s: float = 0.025

    def unknown_readout_s(self) -> float:
        """The read-out time that nobody corrects for, s."""
        return self.assumed_readout_s if self.source == "unknown" else 0.0


@dataclass(frozen=True)
class CalibrationSettings:
    """Settings of ``calibrate``.

    huber: points beyond this many sigma count less; estimate_lag: find how late the right camera
    is, where frames carry stamps and the board moves; lag_range_s: how far the search goes;
    least_pairs: fewer common views are an error; common_points: points that both cameras must see
    for a view to count in the hold-out test; largest_dropped: share of views that may be dropped as
    outliers; most_views: of more common views than this those are chosen that tell
    most; known_left,
    known_right: earlier calibrations of these cameras, with covariance, as prior knowledge.
    """

    lens: LensPrior = LensPrior()
    left_shutter: Shutter = Shutter()
    right_shutter: Shutter = Shutter()
    huber: float = 2.0
    estimate_lag: bool = True
    lag_range_s: float = 0.2
    least_pairs: int = 3
    common_points: int = 8
    largest_dropped: float = 0.2
    most_views: int = 120
    known_left: CameraModel | None = None
    known_right: CameraModel | None = None
