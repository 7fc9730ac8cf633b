"""How a trial is meant to be recorded: cameras, marker, distance, light."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

APART = (0.24, 0.39)  # of a frame period: 8 … 13 ms at 30 frames/s
LOCALISER_PX = 0.05  # scatter of one edge point of a marker
POINTS = 28  # edge points of a marker that the fine detector amounts to
FLOOR_PX = 0.02  # what all points of a picture share and no averaging removes


@dataclass(frozen=True)
class Setup:
    """A planned recording; every length in mm or px, every time in s.

    readout_s: from the first to the last row (0: global shutter), None where nobody knows it;
    readout_sigma: its relative sigma. offset_s: how much later than the left camera the right one
    exposes, None where nobody arranged or measured it. band_hz: declared limits of the machine.
    """

    fps: float = 30.0
    readout_s: float | None = None
    offset_s: float | None = None
    marker_mm: float = 60.0
    distance_mm: float = 1400.0
    exposure_s: float = 0.002
    focal_px: float = 950.0
    baseline_mm: float = 420.0
    rows: int = 720
    seconds: float = 10.0
    band_hz: tuple[float, float] | None = None
    readout_sigma: float = 0.02

    def __post_init__(self) -> None:
        positive = {"fps", "marker_mm", "distance_mm", "focal_px", "baseline_mm", "rows", "seconds"}
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, int | float) and not math.isfinite(value):
                raise ValueError(f"{field.name} must be a number, got {value}")
            if field.name in positive and value <= 0:
                raise ValueError(f"{field.name} must be above 0, got {value}")
        if not 0 <= self.exposure_s < 1 or not 0 < self.readout_sigma < 1:
            raise ValueError(f"exposure_s and readout_sigma must lie in 0 … 1: {self}")
        if self.readout_s is not None and abs(self.readout_s) * self.fps > 1.2:
            raise ValueError(f"a readout of {self.readout_s} s is longer than a frame")
        if self.band_hz is not None and not 0 < self.band_hz[0] < self.band_hz[1]:
            raise ValueError(f"band_hz must rise from above 0, got {self.band_hz}")

    @property
    def px_per_mm(self) -> float:
        """Scale of the picture at the marker."""
        return self.focal_px / self.distance_mm

    @property
    def marker_px(self) -> float:
        """Height of the marker in the picture."""
        return self.marker_mm * self.px_per_mm

    @property
    def row_time_s(self) -> float:
        """Time from a row to the next; 0 where it is unknown or there is none."""
        return abs(self.readout_s or 0.0) / self.rows

    @property
    def period_share(self) -> float | None:
        """The offset as a share of the frame period, 0 … 1/2 (the sign does not matter)."""
        if self.offset_s is None:
            return None
        frames = self.offset_s * self.fps
        return abs(frames - round(frames))

    @property
    def apart(self) -> bool:
        """Whether the cameras are out of step by what breaks the blind zones (8–13 ms at 30/s)."""
        share = self.period_share
        return share is not None and APART[0] - 1e-9 <= share <= APART[1] + 1e-9

    @property
    def apart_ms(self) -> str:
        """The offsets that do, in words: "8-13 ms" at 30 frames/s."""
        low, high = (f"{1e3 * share / self.fps:.2g}" for share in APART)
        return f"{low}-{high} ms"

    @property
    def in_step(self) -> bool:
        """Whether both cameras look at the same moments, so that only rows can tell."""
        share = self.period_share
        return share is not None and share < 0.01

    @property
    def direct(self) -> bool:
        """Whether the frame rate exceeds twice the declared band: nothing has to be decided."""
        return self.band_hz is not None and self.fps > 2 * self.band_hz[1]

    def contrast_px(self, amplitude_mm: float) -> float:
        """How far two neighbouring aliases shear the marker apart, px (timing page, 5.1)."""
        moved_px = amplitude_mm * self.px_per_mm
        return 2 * math.pi * self.fps * moved_px * self.marker_px * self.row_time_s
