"""What ``trial.toml`` may say: the session record, the recordings, the settings of each stage."""

from __future__ import annotations

import datetime
from itertools import pairwise
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from olivevib.detection import DetectionSettings
from olivevib.reconstruction import ReconstructionSettings
from olivevib.vibration import Phase

Place = Literal["trunk", "branch", "twig", "fixed"]
Positive = Field(default=None, gt=0)


class Section(BaseModel):
    """A table of trial.toml: unknown keys are faults, values never change."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Session(Section):
    """Who, where, when. ``simulated`` marks a trial that no camera recorded, ``archived``
    one that lists leave out.
    """

    date: datetime.date | datetime.datetime | str | None = None
    place: str = ""
    operator: str = ""
    notes: str = ""
    simulated: bool = False
    archived: bool = False


class Tree(Section):
    """The tree and where the shaker held it."""

    id: str | int = ""
    cultivar: str = ""
    training: str = ""
    trunk_diameter_mm: float | None = Positive
    clamp_height_mm: float | None = Positive


class Machine(Section):
    """The shaker as its operator set it."""

    make: str = ""
    type: str = ""
    set_frequency_hz: float | None = Positive
    shaking_time_s: float | None = Positive


class MarkerPlace(Section):
    """Where one marker was fixed, and its own size where it differs."""

    id: int = Field(ge=0)
    place: Place | None = None
    branch_diameter_mm: float | None = Positive
    angle_deg: float | None = None
    distance_mm: float | None = Positive
    size_mm: float | None = Positive
    wrapped: bool = False  # round the branch, like a cuff; else it is flat
    axis_deg: float = 90.0  # of the branch in the print, from right to down: 90 is upright


class Markers(Section):
    """Which markers are on the tree; ids empty: every id of the library."""

    library: str = "olive49"
    size_mm: float | None = Positive
    ids: tuple[int, ...] = ()
    marker: tuple[MarkerPlace, ...] = ()

    @model_validator(mode="after")
    def _one_place_each(self) -> Markers:
        ids = [m.id for m in self.marker]
        twice = sorted({i for i in ids if ids.count(i) > 1})
        if twice:
            raise ValueError(f"marker {twice[0]} is described twice")
        return self

    def size_of(self, marker: int) -> float | None:
        """Outer side of the dark square of one marker, mm; None where nobody stated it."""
        own = next((m.size_mm for m in self.marker if m.id == marker), None)
        return own or self.size_mm

    def place_of(self, marker: int) -> str | None:
        """Where one marker was fixed, or None."""
        return next((m.place for m in self.marker if m.id == marker), None)

    def at(self, place: Place) -> tuple[int, ...]:
        """The ids of the markers that were fixed there, ascending."""
        return tuple(sorted(m.id for m in self.marker if m.place == place))


class Camera(Section):
    """One recording; row_time_us is signed, per raw sensor row."""

    video: str = ""
    stamps: str | None = None
    row_time_us: float | None = None
    row_time_sigma_us: float | None = Field(default=None, ge=0)
    row_time_source: Literal["declared", "led", "board"] = "declared"
    exposure_ms: float | None = Positive


class Cameras(Section):
    """Both recordings and how their sensors read out."""

    shutter: Literal["rolling", "global", "unknown"] = "unknown"
    left: Camera = Camera()
    right: Camera = Camera()

    def row_time_s(self, side: str) -> tuple[float, float, str]:
        """Row time, its sigma (NaN: unknown) and the source of one camera, s."""
        camera: Camera = getattr(self, side)
        nan = float("nan")
        if self.shutter == "global":
            return 0.0, 0.0, "global"
        if camera.row_time_us is None:
            return 0.0, nan, "unknown"
        sigma = camera.row_time_sigma_us
        known = nan if sigma is None else sigma * 1e-6
        return camera.row_time_us * 1e-6, known, camera.row_time_source


class CalibrationInputs(Section):
    """Board recordings of both cameras with the board, or the rig of an earlier calibration."""

    left: str | None = None
    right: str | None = None
    left_stamps: str | None = None
    right_stamps: str | None = None
    board: str | None = None
    rig: str | None = None
    paper: bool = False


class Accelerometer(Section):
    """One sensor file, the marker it was fixed to, and how to read it.

    lever_mm: where it sat, from the marker's centre in the marker's axes. preset: TOML file of
    options kept from an earlier trial; what stands beside it here goes before it.
    """

    file: str
    preset: str | None = None
    marker: int | None = Field(default=None, ge=0)
    axes: tuple[str, ...] = ()
    lever_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    unit: str | None = None
    per_g: float | None = Positive
    rate_hz: float | None = Positive
    columns: tuple[str, ...] = ()
    time_column: str | None = None
    time_unit: str | None = None
    start: str | None = None


class Motion(Section):
    """A motion to analyse beside the markers' own: of a point of a body, or against another marker.

    at_mm: the point, from the marker's centre in its own axes (x right, y down as printed, z into
    the surface). relative_to: the marker whose motion is taken out.
    """

    name: str = ""
    marker: int = Field(ge=0)
    relative_to: int | None = Field(default=None, ge=0)
    at_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)


class Vibration(Section):
    """band_hz: where the shaker's lines may lie; empty: 5 to 45 Hz, and nobody declared it.

    phases: (name, start s, end s) on the trial clock, in place of those found. reference: the
    marker that the others are compared with; empty: the first on the trunk, or the first.
    """

    band_hz: tuple[float, float] | None = None
    window: str = "hann"
    phases: tuple[tuple[str, float, float], ...] = ()
    reference: int | None = Field(default=None, ge=0)
    motion: tuple[Motion, ...] = ()

    @field_validator("phases")
    @classmethod
    def _in_order(
        cls, value: tuple[tuple[str, float, float], ...]
    ) -> tuple[tuple[str, float, float], ...]:
        each = [Phase(*row) for row in value]
        if any(b.start_s < a.end_s for a, b in pairwise(each)):
            raise ValueError("phases must follow one another without overlap")
        return value

    @model_validator(mode="after")
    def _rising(self) -> Vibration:
        if self.band_hz is not None and not 0 < self.band_hz[0] < self.band_hz[1]:
            raise ValueError(f"band_hz must rise from above 0, got {list(self.band_hz)}")
        return self


class Outcome(Section):
    """What the harvest gave, entered by hand."""

    removed_kg: float | None = Field(default=None, ge=0)
    left_kg: float | None = Field(default=None, ge=0)
    damage: str = ""


class TrialSettings(Section):
    """The whole of trial.toml."""

    session: Session = Session()
    tree: Tree = Tree()
    machine: Machine = Machine()
    markers: Markers = Markers()
    cameras: Cameras = Cameras()
    calibration: CalibrationInputs = CalibrationInputs()
    accelerometers: tuple[Accelerometer, ...] = ()
    detection: DetectionSettings = DetectionSettings()
    reconstruction: ReconstructionSettings = ReconstructionSettings()
    vibration: Vibration = Vibration()
    outcome: Outcome = Outcome()
