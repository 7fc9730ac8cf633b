"""What each camera saw of a marker at the times of its own rows, as the comparison takes it."""

from __future__ import annotations

import numpy as np

from olivevib.comparison import View
from olivevib.geometry import StereoRig
from olivevib.pipeline.recordings import SIDES
from olivevib.pipeline.sampling_time import retimed
from olivevib.reconstruction import Trajectory, TrialClock
from olivevib.tracking import Track
from olivevib.trial import Trial


def marker_views(trial: Trial, trajectory: Trajectory, marker: int) -> tuple[View, ...]:
    """The marker in both cameras, on the trial clock; () where tracks or rig are not there.

    The picture moves with the marker's place by the derivative of the projection about its mean.
    """
    tracks, rig, found = trial.tracks, trial.rig, trial.reconstruction
    if tracks is None or rig is None or found is None:
        return ()
    tracks = retimed(trial, tracks)
    m = int(np.flatnonzero(trajectory.ids == marker)[0])
    place = np.nanmean(trajectory.left_camera_mm[:, m], axis=0)
    views = []
    for side in SIDES:
        track = next((t for t in tracks.of(side) if t.id == marker), None)
        if track is not None:
            exposure = (getattr(trial.settings.cameras, side).exposure_ms or 0.0) * 1e-3
            views.append(_view(track, rig, found.clock, (place, trajectory.R_world_left), exposure))
    return tuple(views)


def _view(
    track: Track,
    rig: StereoRig,
    clock: TrialClock,
    at: tuple[np.ndarray, np.ndarray],
    exposure_s: float,
) -> View:
    """One camera's view; at: mean place (3,) in the left camera, R_world_left (3, 3)."""
    place, R_world_left = at
    if track.camera == "left":
        by_left = rig.left.project_jacobian(place)[1][0]
        t_s = track.t_s
    else:
        by_left = rig.right.project_jacobian(rig.to_right(place))[1][0] @ rig.R_right_left
        t_s = clock.right_times(track.t_s)
    seen = np.isfinite(track.centre_px).all(axis=1)
    return View(t_s[seen], track.centre_px[seen], by_left @ R_world_left.T, exposure_s)
