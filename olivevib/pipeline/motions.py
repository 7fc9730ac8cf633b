"""Which motions of a trial are analysed: the markers', less the cameras' own; and asked ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from olivevib.errors import Caution, UsageError
from olivevib.progress import Tick, silent
from olivevib.reconstruction import Trajectory
from olivevib.signals import Samples
from olivevib.trial import Trial
from olivevib.trial.settings import Motion
from olivevib.vibration import (
    Attitude,
    LineSettings,
    NamedMotion,
    Phase,
    SamplingFacts,
    Survey,
    Vibration,
    VibrationSettings,
    analyse,
    point_motion,
    relative_motion,
    survey,
    without_camera_motion,
)

_NOTED_MM = 0.1  # motion of the cameras that is worth telling


def marker_motion(
    trial: Trial, trajectory: Trajectory
) -> tuple[dict[int, Samples], tuple[Caution, ...]]:
    """Displacement of every marker that was seen, the cameras' own motion taken out.

    Markers whose place is "fixed" show the cameras' own motion (tripod, ground).
    """
    motion = {int(i): trajectory.samples(int(i)) for i in trajectory.ids}
    declared = trial.settings.markers.at("fixed")
    fixed = [i for i in declared if i in motion and motion[i].t_s.size > 1]
    if not fixed:
        return motion, _unseen() if declared else ()
    moved = np.mean([np.sum(motion[i].values.var(axis=0)) for i in fixed]) ** 0.5
    return without_camera_motion(motion, fixed), _moved(float(moved))


def _unseen() -> tuple[Caution, ...]:
    return (
        Caution(
            "fixed-markers-unseen",
            "No marker that stands still was seen: the cameras' own motion is not taken out.",
            "Put a marker on a wall or a post that both cameras see, or clear its place.",
        ),
    )


def _moved(rms_mm: float) -> tuple[Caution, ...]:
    if rms_mm < _NOTED_MM:
        return ()
    return (
        Caution(
            "cameras-moved",
            f"The markers that stand still move by {rms_mm:.2f} mm rms: the cameras shake, or "
            "these markers do. Their motion is taken out of all others, shifts only.",
            "Set the tripod on firmer ground, farther from the machine.",
        ),
    )


def attitudes(trajectory: Trajectory) -> dict[int, Attitude]:
    """The rotation of every marker at its own instants, at the samples of its displacement."""
    out = {}
    for m, marker in enumerate(trajectory.ids):
        good = trajectory.seen[:, m]
        out[int(marker)] = Attitude(
            trajectory.sample_t_s[good, m], trajectory.rotation_rad[good, m]
        )
    return out


def body_point(trajectory: Trajectory, motion: Samples, marker: int, at_mm: object) -> Samples:
    """Displacement of a point of a marker's body; UsageError where its rotation is not known."""
    at = np.asarray(at_mm, dtype=np.float64)
    if not at.any():
        return motion
    whole = attitudes(trajectory)[marker]
    rows = np.searchsorted(whole.t_s, motion.t_s)
    attitude = Attitude(motion.t_s, whole.rotation_rad[np.clip(rows, 0, whole.t_s.size - 1)])
    if not attitude.known:
        raise UsageError(
            f"the rotation of marker {marker} is not known.",
            "A point beside its centre needs it.",
            "Leave the lever (lever_mm, at_mm) at zero, or reconstruct without --paper.",
        )
    return point_motion(motion, attitude, at)


def surveyed(
    trial: Trial,
    trajectory: Trajectory,
    motion: Mapping[int, Samples],
    result: Vibration,
    facts: SamplingFacts,
    tick: Tick = silent,
) -> Survey:
    """Orbits, rotations, decay, transmissibility, and the motions that trial.toml asks for."""
    settings = trial.settings
    shown = next(p for p in result.phases if p.name == result.spectrum_phase)
    lines = {row.id: row.line for row in result.table if row.phase == shown.name}
    trunk = [i for i in settings.markers.at("trunk") if i in motion]
    wanted = settings.vibration.reference
    reference = wanted if wanted is not None else next(iter(trunk), None)
    turned = attitudes(trajectory)
    found = survey(motion, turned, lines, result.phases, shown, facts, reference, tick)
    asked = [
        _asked(k, m, trajectory, motion, facts, shown)
        for k, m in enumerate(settings.vibration.motion)
    ]
    return replace(found, motions=tuple(asked))


def _asked(
    k: int,
    wanted: Motion,
    trajectory: Trajectory,
    motion: Mapping[int, Samples],
    facts: SamplingFacts,
    shown: Phase,
) -> NamedMotion:
    """One motion that trial.toml asks for, analysed in the phase shown."""
    for marker in (wanted.marker, wanted.relative_to):
        if marker is not None and marker not in motion:
            raise UsageError(
                f"marker {marker} was not tracked.",
                f"vibration.motion number {k + 1} in trial.toml names it.",
                "Correct it; tracked are " + ", ".join(str(i) for i in sorted(motion)) + ".",
            )
    samples = body_point(trajectory, motion[wanted.marker], wanted.marker, wanted.at_mm)
    if wanted.relative_to is not None:
        samples = relative_motion(samples, motion[wanted.relative_to], facts, LineSettings())
    whole = analyse({wanted.marker: samples}, facts, VibrationSettings(), [shown])
    row = whole.row(wanted.marker, shown.name)
    if row is None:
        raise ValueError(f"the phase {shown.name} was not analysed")
    name = wanted.name or _name(wanted)
    return NamedMotion(name, wanted.marker, wanted.relative_to, wanted.at_mm, row)


def _name(wanted: Motion) -> str:
    words = f"marker {wanted.marker}"
    if any(wanted.at_mm):
        words += " at " + ", ".join(f"{v:g}" for v in wanted.at_mm) + " mm"
    return words + (f" against {wanted.relative_to}" if wanted.relative_to is not None else "")
