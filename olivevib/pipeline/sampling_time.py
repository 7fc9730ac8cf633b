"""When every row was seen: what a trial knows of it beforehand, and the fit that uses it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import NamedTuple

import numpy as np

from olivevib.arrays import Floats
from olivevib.detection.exposure_gain import exposure_gain
from olivevib.geometry import StereoRig
from olivevib.pipeline.recordings import SIDES
from olivevib.progress import Tick
from olivevib.reconstruction import Trajectory, TrialClock
from olivevib.reconstruction.motion import (
    Anchor,
    MotionFit,
    MotionSettings,
    Pattern,
    fit_motion,
    observe,
    steady_ends,
)
from olivevib.reconstruction.motion.types import Gain
from olivevib.tracking import Track
from olivevib.trial import Trial
from olivevib.trial.records.tracks import StoredTracks
from olivevib.vibration import SamplingFacts, find_phases

DECLARED_SHARE = 0.02  # sigma of a row time that was declared without one
DECLARED_OFFSET_S = 5e-4  # sigma of an offset that was declared: typed, not measured
LEAST_STEADY_S = 1.5  # of shaking that windows call steady: less holds too few frames for a fit


class RowTime(NamedTuple):
    """Signed seconds a raw row, sigma (inf: not known), source as CameraModel.row_time_source."""

    value_s: float
    sigma_s: float
    source: str


def row_time(trial: Trial, tracks: StoredTracks, side: str) -> RowTime:
    """The best that is known of one camera's row time before the fit.

    What trial.toml declares (typed, or from an LED by the book of cameras) wins; else what the
    waved board of the calibration showed; else unknown.
    """
    camera = tracks.cameras[side]
    if camera.row_time_source == "global":
        return RowTime(0.0, 0.0, "global")
    if camera.row_time_source != "unknown":
        sigma = camera.row_time_sigma_s
        if not math.isfinite(sigma):
            sigma = DECLARED_SHARE * abs(camera.row_time_s)
        return RowTime(camera.row_time_s, sigma, camera.row_time_source)
    known = None if trial.rig is None else getattr(trial.rig, side)
    if known is None or known.row_time_source in ("unknown", "global"):
        return RowTime(0.0, math.inf, "unknown")
    sigma = known.row_time_sigma_s
    sigma = sigma if math.isfinite(sigma) else DECLARED_SHARE * abs(known.row_time_s)
    return RowTime(known.row_time_s, sigma, known.row_time_source)


def retimed(trial: Trial, tracks: StoredTracks) -> StoredTracks:
    """The tracks with each observation at the time of its row, by the best row time known."""
    cameras = dict(tracks.cameras)
    sides: dict[str, tuple[Track, ...]] = {side: tracks.of(side) for side in SIDES}
    for side in SIDES:
        found = row_time(trial, tracks, side)
        if found.source == cameras[side].row_time_source:
            continue
        more = found.value_s - cameras[side].row_time_s
        middle = cameras[side].size_px[1] / 2
        sides[side] = tuple(_shifted(track, more, middle) for track in sides[side])
        sigma = found.sigma_s if math.isfinite(found.sigma_s) else math.nan
        cameras[side] = replace(
            cameras[side],
            row_time_s=found.value_s,
            row_time_sigma_s=sigma,
            row_time_source=found.source,
        )
    return replace(tracks, left=sides["left"], right=sides["right"], cameras=cameras)


def _shifted(track: Track, more_s: float, middle: float) -> Track:
    rows = np.where(np.isfinite(track.raw_row), track.raw_row, middle)
    return replace(track, t_s=track.t_s + more_s * rows)


def anchor(trial: Trial, tracks: StoredTracks, clock: TrialClock) -> Anchor:
    """What is known of time before the fit: both row times and the offset, with their sources."""
    left, right = (row_time(trial, tracks, side) for side in SIDES)
    source = left.source if left.source == right.source else f"{left.source} / {right.source}"
    if "unknown" in (left.source, right.source):
        source = "unknown"
    known = clock.source != "unknown"
    sigma = clock.right_offset_sigma_s if known else math.inf
    if known and not math.isfinite(sigma):
        sigma = DECLARED_OFFSET_S
    kinds = (tracks.cameras[side].stamp_kind for side in SIDES)
    return Anchor(
        left_row_time_s=left.value_s,
        left_row_time_sigma_s=left.sigma_s,
        right_row_time_s=right.value_s,
        right_row_time_sigma_s=right.sigma_s,
        row_time_source=source,
        right_offset_s=clock.right_offset_s,
        right_offset_sigma_s=sigma,
        reference_row=clock.reference_row,
        offset_source=clock.source,
        stamps_true="slots" not in kinds,
    )


@dataclass(frozen=True)
class TrialTimes:
    """A trial's tracks with what is known of their times; steady_s: where the machine ran."""

    tracks: StoredTracks
    clock: TrialClock
    steady_s: tuple[float, float] | None


def steady_interval(trajectory: Trajectory, sway_hz: float) -> tuple[float, float] | None:
    """When the machine ran steadily, from what was triangulated; None where it is not told.

    What is too short for a fit is a beat of ramp and sway, near the frame rate.

    Above half the frame rate the triangulated motion is an alias, but its size and its coming and
    going are right.
    """
    motion = {int(i): trajectory.samples(int(i)) for i in trajectory.ids}
    phases = find_phases({i: s for i, s in motion.items() if s.t_s.size > 1}, sway_hz)
    found = next((p for p in phases if p.name == "steady"), None)
    if found is None or found.duration_s < LEAST_STEADY_S:
        return None
    return found.start_s, found.end_s


def fit_trial(
    trial: Trial,
    times: TrialTimes,
    rig: StereoRig,
    corners_mm: Mapping[int, Floats],
    patterns: Mapping[int, Pattern],
    tick: Tick,
) -> MotionFit | None:
    """The continuous-time fit of a trial; None where no marker was seen often enough for one.

    patterns: of the flat markers, where their drawings were fitted.
    """
    tracks, clock = times.tracks, times.clock
    left = [_within(t, times.steady_s) for t in tracks.left]
    right = [_within(t, times.steady_s) for t in tracks.right]
    rows = (tracks.cameras["left"].row_time_s, tracks.cameras["right"].row_time_s)
    band = trial.settings.vibration.band_hz
    settings = MotionSettings(
        band_hz=band or SamplingFacts(1.0).band_hz,
        band_declared=band is not None,
        gain=_gain(tracks.localiser),
    )
    try:
        seen = observe(left, right, corners_mm, rows, patterns)
        ends = steady_ends(seen) if times.steady_s else steady_ends(seen, math.inf)
        seen = seen if ends is None else ends.of(seen)
        return fit_motion(seen, rig, anchor(trial, tracks, clock), settings, tick)
    except ValueError:  # no marker was seen often enough by both cameras
        return None


def _gain(localiser: str) -> Gain:
    """What the exposure takes from an amplitude, as this localiser sees it."""

    def gain(f_hz: float, exposure_s: float, amplitude_px: float) -> tuple[float, float] | None:
        found = exposure_gain(f_hz, exposure_s, amplitude_px, localiser)
        return None if found is None else (found.gain, found.sigma)

    return gain


def _within(track: Track, interval_s: tuple[float, float] | None) -> Track:
    """The rows of a track whose instants lie in the interval."""
    if interval_s is None:
        return track
    keep = (track.t_s >= interval_s[0]) & (track.t_s <= interval_s[1])
    names = [f.name for f in fields(Track) if f.name not in ("camera", "id", "localiser")]
    return replace(track, **{name: getattr(track, name)[keep] for name in names})


def fitted_clock(fit: MotionFit, clock: TrialClock) -> TrialClock:
    """The clock as the fit found it, with the row times of the tracks."""
    timing = fit.timing
    return replace(
        clock,
        right_offset_s=timing.right_offset_s,
        right_offset_sigma_s=timing.sigma("right_offset_s"),
        reference_row=timing.reference_row,
        right_drift=timing.right_drift,
        drift_from_s=fit.mid_s,
        source="fit",
    )
