"""Stages after tracking: reconstruct and analyse."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from olivevib.arrays import Floats
from olivevib.calibration.trust import cautions_of, swapped
from olivevib.errors import Caution, InputError
from olivevib.files.store import write_stage
from olivevib.geometry import StereoRig
from olivevib.pipeline.fitted import fitted_samples, with_lines
from olivevib.pipeline.fitted_camera import without_cameras
from olivevib.pipeline.fitted_response import with_fitted_responses
from olivevib.pipeline.libraries import corners_mm, pattern_of, trial_library
from olivevib.pipeline.motions import marker_motion, surveyed
from olivevib.pipeline.rig_in_use import chosen_world, rig_trust
from olivevib.pipeline.sampling_time import (
    TrialTimes,
    fit_trial,
    fitted_clock,
    retimed,
    steady_interval,
)
from olivevib.progress import Tick, silent
from olivevib.reconstruction import Reconstruction, TrialClock, clock_from_motion
from olivevib.reconstruction import reconstruct as reconstruct_tracks
from olivevib.reconstruction.continuous import decided, trajectory_of
from olivevib.reconstruction.motion import Pattern
from olivevib.reconstruction.world import placed, with_rig_sigma
from olivevib.trial import Trial
from olivevib.trial.records.tracks import StoredTracks
from olivevib.trial.records.trajectory import trajectory_file
from olivevib.trial.records.vibration import vibration_file
from olivevib.vibration import Line, Phase, SamplingFacts, Vibration, VibrationSettings
from olivevib.vibration import analyse as analyse_motion

IMPOSSIBLE_PX = 25.0  # beyond this no bumped tripod explains the misfit: nothing is delivered


def reconstruct(trial: Trial, tick: Tick = silent) -> tuple[Caution, ...]:
    """Triangulate the tracks on the trial clock and write trajectory.h5."""
    now = trial.fingerprint("reconstruct")
    tracks, rig = trial.tracks, trial.rig
    if tracks is None:
        raise trial.need("track")
    if rig is None:
        raise trial.need("calibrate")
    _check_rig(rig, tracks)
    if not trial.settings.reconstruction.paper:
        tracks = retimed(trial, tracks)
    library = trial_library(trial)
    ids = {t.id for t in (*tracks.left, *tracks.right)}
    if not ids:
        raise InputError(
            f"trial {trial.name} has no tracks.",
            "No marker of the library was found in either video.",
            "Check --markers and --ids (markers.library, markers.ids in trial.toml).",
        )
    corners = {i: corners_mm(library, trial.settings, i) for i in sorted(ids)}
    trust = rig_trust(tracks, rig, corners)
    if trust is not None and trust.likely == "swapped":
        raise swapped(trust)
    clock = trial_clock(trial, tracks)
    if clock.source == "unknown" and not trial.settings.reconstruction.paper:
        clock = clock_from_motion(tracks.left, tracks.right, rig, clock)
    result = reconstruct_tracks(
        tracks.left, tracks.right, rig, clock, corners, trial.settings.reconstruction, tick
    )
    if result.epipolar_rms_px > IMPOSSIBLE_PX:
        raise InputError(
            f"the two cameras' pictures do not belong together: markers miss the epipolar lines by "
            f"{result.epipolar_rms_px:.0f} px rms.",
            "The recordings are swapped or the same, or the rig is that of other cameras.",
            "Check left and right in trial.toml, and calibrate this pair as it stood.",
        )
    if not (trial.settings.reconstruction.paper or _settled(trial, tracks, clock)):
        result = with_motion(trial, tracks, rig, corners, result, tick)
    result = _in_its_frame(trial, result, rig, tick)
    result = replace(result, cautions=(*result.cautions, *cautions_of(trust)))
    write_stage(trial.folder / "trajectory.h5", trajectory_file(result, now))
    return result.cautions


def _in_its_frame(
    trial: Trial, result: Reconstruction, rig: StereoRig, tick: Tick
) -> Reconstruction:
    """The result in the frame that was chosen, with what the calibration adds to each sigma."""
    world = chosen_world(trial, result, tick)
    return with_rig_sigma(result if world is None else placed(result, world), rig)


def _settled(trial: Trial, tracks: StoredTracks, clock: TrialClock) -> bool:
    """Whether frames alone tell all: no alias in the declared band, offset known or motion slow."""
    band = trial.settings.vibration.band_hz
    rate = tracks.cameras["left"].rate_hz
    return band is not None and rate > 2 * band[1] and clock.source != "unknown"


def with_motion(
    trial: Trial,
    tracks: StoredTracks,
    rig: StereoRig,
    corners: dict[int, Floats],
    result: Reconstruction,
    tick: Tick,
) -> Reconstruction:
    """The reconstruction with the continuous-time fit; with its paths where it could decide."""
    facts = SamplingFacts(tracks.cameras["left"].rate_hz)
    steady = steady_interval(result.trajectory, facts.sway_hz)
    patterns = _patterns(trial, corners) if tracks.localiser == "template" else {}
    times = TrialTimes(tracks, result.clock, steady)
    fit = fit_trial(trial, times, rig, corners, patterns, tick)
    if fit is None or not decided(fit):
        return replace(result, motion=fit)
    clock = fitted_clock(fit, result.clock)
    settings = trial.settings.reconstruction
    again = reconstruct_tracks(tracks.left, tracks.right, rig, clock, corners, settings, tick)
    path = trajectory_of(fit, again.trajectory)
    return replace(again, trajectory=path, motion=fit)


def _patterns(trial: Trial, ids: Iterable[int]) -> dict[int, Pattern]:
    """Of the markers that are flat."""
    library = trial_library(trial)
    found = {i: pattern_of(library, trial.settings, i) for i in ids}
    return {i: pattern for i, pattern in found.items() if pattern is not None}


def _check_rig(rig: StereoRig, tracks: StoredTracks) -> None:
    """InputError where the rig was calibrated at another picture size."""
    for side in ("left", "right"):
        calibrated = getattr(rig, side).size_px
        recorded = tracks.cameras[side].size_px
        if tuple(calibrated) != tuple(recorded):
            raise InputError(
                f"the {side} video is {recorded[0]} x {recorded[1]} px, but rig.toml was "
                f"calibrated at {calibrated[0]} x {calibrated[1]} px.",
                "A calibration holds for one mode of the camera only.",
                "Calibrate in the mode of the trial (olivevib calibrate), or name another rig.",
            )


def trial_clock(trial: Trial, tracks: StoredTracks) -> TrialClock:
    """The offset between the cameras as far as it is known, and both row times.

    A stated offset wins; else that of the calibration where board and trial are one recording (the
    lag changes from recording to recording); else unknown, taken as zero.
    """
    middle = tracks.cameras["left"].size_px[1] / 2
    plain = TrialClock(
        reference_row=middle,
        left_row_time_s=tracks.cameras["left"].row_time_s,
        right_row_time_s=tracks.cameras["right"].row_time_s,
    )
    stated = trial.settings.reconstruction.right_offset_ms
    if stated is not None:
        return replace(plain, right_offset_s=stated * 1e-3, source="declared")
    calibration = trial.calibration
    c, cameras = trial.settings.calibration, trial.settings.cameras
    same = c.left == cameras.left.video and c.right == cameras.right.video
    if same and calibration is not None and calibration.right_offset_sigma_s > 0:
        return replace(
            plain,
            right_offset_s=calibration.right_offset_s,
            right_offset_sigma_s=calibration.right_offset_sigma_s,
            reference_row=calibration.reference_row,
            source="calibration",
        )
    return plain


def sampling_facts(trial: Trial, clock: TrialClock) -> SamplingFacts:
    """What is known of the moments at which the markers were sampled."""
    tracks = trial.tracks
    if tracks is None:
        raise trial.need("track")
    left, right = tracks.cameras["left"], tracks.cameras["right"]
    band = trial.settings.vibration.band_hz
    known = left.row_time_source != "unknown" and right.row_time_source != "unknown"
    exposure = trial.settings.cameras.left.exposure_ms
    return SamplingFacts(
        frame_rate_hz=left.rate_hz,
        row_time_known=known,
        right_offset_known=clock.source != "unknown",
        stamps_true="slots" not in (left.stamp_kind, right.stamp_kind),
        band_hz=band or SamplingFacts(left.rate_hz).band_hz,
        band_declared=band is not None,
        row_time_s=left.row_time_s if known else None,
        right_offset_s=clock.right_offset_s if clock.source != "unknown" else None,
        exposure_s=(exposure or 0.0) * 1e-3,
    )


def _unproven(result: Vibration) -> Vibration:
    """The analysis without sigmas of amplitudes, and with a caution that says why.

    Above half the frame rate, cameras out of step by an unknown time mix depth and motion: the
    scatter of the samples then tells nothing of the amplitude's error.
    """

    def bare(line: Line) -> Line:
        return replace(line, amplitude_sigma=np.full(3, np.nan))

    return replace(
        result,
        table=tuple(replace(row, line=bare(row.line)) for row in result.table),
        spectra={
            quantity: replace(spectrum, lines=tuple(bare(line) for line in spectrum.lines))
            for quantity, spectrum in result.spectra.items()
        },
        cautions=(
            *result.cautions,
            Caution(
                "amplitude-unproven",
                "Amplitudes may be wrong several times over: the lines may lie above half the "
                "frame rate and the time offset between the cameras is not known.",
                "Let board and trial be one recording, or state reconstruction.right_offset_ms; "
                "or declare the machine's band (--band) where it lies below half the frame rate.",
            ),
        ),
    )


def analyse(trial: Trial, tick: Tick = silent) -> tuple[Caution, ...]:
    """Spectra, lines with their status and the figures of every marker; writes vibration.h5."""
    now = trial.fingerprint("analyse")
    reconstruction = trial.reconstruction
    if reconstruction is None:
        raise trial.need("reconstruct")
    trajectory = reconstruction.trajectory
    motion, cautions = marker_motion(trial, trajectory)
    settings = VibrationSettings(window=trial.settings.vibration.window)
    facts = sampling_facts(trial, reconstruction.clock)
    phases = [Phase(*row) for row in trial.settings.vibration.phases] or None
    fit = reconstruction.motion
    if facts.direct and not decided(fit):  # no alias lies in the band: nothing was to be decided
        fit = None
    if fit is not None and decided(fit):
        motion, facts, found = fitted_samples(fit, motion, facts)
        phases = phases or found
        fit = without_cameras(fit, trial.settings.markers.at("fixed"))
    result = analyse_motion(motion, facts, settings, phases, tick)
    result = replace(result, cautions=(*result.cautions, *cautions))
    if fit is not None:
        result = with_lines(result, fit)
    if reconstruction.clock.source == "unknown" and not facts.direct:
        result = _unproven(result)
    survey = surveyed(trial, trajectory, motion, result, facts, tick)
    if fit is not None and decided(fit):
        survey = with_fitted_responses(survey, fit)
    result = replace(result, survey=survey)
    write_stage(trial.folder / "vibration.h5", vibration_file(result, now))
    return result.cautions
