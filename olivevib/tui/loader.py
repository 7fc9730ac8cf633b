"""What the screens show of a trial: frozen values, read from the files in one place.

Everything heavy is imported inside: the first picture of the app waits for none of it.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from olivevib.errors import InputError, OlivevibError

if TYPE_CHECKING:
    from olivevib.comparison import Comparison
    from olivevib.reconstruction import Trajectory
    from olivevib.trial import Trial
    from olivevib.tui.views.coverage import Coverage
    from olivevib.tui.views.setting_rows import SettingRow
    from olivevib.vibration import Vibration

Value = TypeVar("Value")
STAGE_NAMES = ("calibrate", "track", "reconstruct", "analyse", "compare")


@dataclass(frozen=True)
class StageLine:
    """One stage of a trial: its state and the reason, as words."""

    name: str
    state: str
    reason: str


@dataclass(frozen=True)
class Quality:
    """One word for how far a trial can be used as it is, and why."""

    word: str
    why: str


@dataclass(frozen=True)
class TrialRow:
    """One line of the trial list."""

    folder: Path
    name: str
    stages: tuple[StageLine, ...] = ()
    quality: Quality = Quality("…", "reading it")
    about: str = ""
    simulated: bool = False


@dataclass(frozen=True)
class TrialFacts:
    """Everything the trial screen shows.

    summary: as ``show --json``; None where a result cannot be read, and then ``fault`` says why.
    """

    folder: Path
    name: str
    simulated: bool
    stages: tuple[StageLine, ...]
    summary: Mapping[str, Any] | None = None
    fault: OlivevibError | None = None
    resume: str = ""


@dataclass(frozen=True)
class Results:
    """Everything the result screens draw; None where a stage has not run."""

    folder: Path
    summary: Mapping[str, Any]
    trajectory: Trajectory | None = None
    vibration: Vibration | None = None
    comparisons: tuple[Comparison, ...] = ()
    places: Mapping[int, str] = field(default_factory=dict)


@dataclass(frozen=True)
class CalibrationFacts:
    """What the calibration page shows; no coverage before the stage has run."""

    summary: Mapping[str, Any]
    coverage: tuple[Coverage, ...] = ()
    places: tuple[str, ...] = ()
    cautions: tuple[Mapping[str, str], ...] = ()


def guarded(read: Callable[[], Value]) -> Value | OlivevibError:
    """What ``read`` gives, or the error that says why not; also for what nobody foresaw."""
    try:
        return read()
    except OlivevibError as error:
        return error
    except Exception as error:  # a damaged file must never take the app down
        why = f"{type(error).__name__}: {error}"
        return InputError("this trial cannot be read.", why, "Run olivevib check on it.")


def trial_folders(workspace: Path) -> tuple[Path, ...]:
    """The trial folders of the workspace, sorted by name."""
    from olivevib.trial.workspace import list_trials

    return tuple(list_trials(workspace))


def trial_row(folder: Path) -> TrialRow:
    """The line of one trial in the list; a trial that cannot be read says so in its line."""
    found = guarded(lambda: _row(folder))
    if isinstance(found, OlivevibError):
        return TrialRow(folder, folder.name, (), Quality("unreadable", str(found)))
    return found


def _row(folder: Path) -> TrialRow:
    from olivevib.trial import Trial

    trial = Trial.open(folder)
    session, tree = trial.settings.session, trial.settings.tree
    about = [str(part) for part in (session.date, session.place, tree.cultivar) if part]
    stages = stage_lines(trial)
    quality = quality_of(stages, trial)
    return TrialRow(folder, trial.name, stages, quality, ", ".join(about), session.simulated)


def stage_lines(trial: Trial) -> tuple[StageLine, ...]:
    """The stages in order; files of the trial are named from its folder on."""
    here = f"{trial.folder.resolve()}{os.sep}"
    near = f"{trial.folder}{os.sep}"
    return tuple(
        StageLine(name, state.state.value, state.reason.replace(here, "").replace(near, ""))
        for name, state in trial.states().items()
    )


def quality_of(stages: tuple[StageLine, ...], trial: Trial) -> Quality:
    """The worst thing that can be said of a trial, in one word."""
    for word in ("failed", "stale", "missing", "blocked"):
        bad = next((s for s in stages if s.state == word), None)
        if bad is not None:
            said = {"missing": "unfinished", "blocked": "unfinished"}.get(word, word)
            return Quality(said, f"{bad.name}: {bad.reason}")
    if not trial.vibration:
        return Quality("unfinished", "there is nothing to analyse yet")
    return _quality_of_results(trial)


def _quality_of_results(trial: Trial) -> Quality:
    for comparison in trial.comparison:
        if comparison.verdict.value == "differs":
            return Quality("differs", comparison.reason)
    cautions = trial.cautions
    if cautions:
        return Quality("warnings", f"{len(cautions)}: {', '.join(c.code for c in cautions)}")
    return Quality("clean", "every stage is done and none of them warned")


def trial_facts(folder: Path) -> TrialFacts:
    """What the trial screen shows; raises InputError where the trial cannot be read."""
    from olivevib.trial import Trial
    from olivevib.trial.summary import summary

    trial = Trial.open(folder)
    journal = trial.private / "track.journal"
    resume = "tracking was stopped half way: run goes on from there" if journal.exists() else ""
    stages = stage_lines(trial)
    found = guarded(lambda: summary(trial))
    return TrialFacts(
        folder,
        trial.name,
        trial.settings.session.simulated,
        stages,
        None if isinstance(found, OlivevibError) else found,
        found if isinstance(found, OlivevibError) else None,
        resume,
    )


def results(folder: Path) -> Results:
    """What the result screens draw; raises InputError where the trial cannot be read."""
    from olivevib.trial import Trial
    from olivevib.trial.summary import summary

    trial = Trial.open(folder)
    marked = {m.id: m.place or "" for m in trial.settings.markers.marker}
    return Results(
        folder, summary(trial), trial.trajectory, trial.vibration, trial.comparison, marked
    )


def calibration_facts(folder: Path) -> CalibrationFacts:
    """What the calibration page shows; raises InputError where a file cannot be read."""
    from olivevib.trial import Trial
    from olivevib.trial.summary import summary
    from olivevib.tui.views.coverage import Coverage, camera_places

    trial = Trial.open(folder)
    record, rig, facts = trial.calibration, trial.rig, summary(trial)
    if record is None or rig is None:
        return CalibrationFacts(facts)
    points = (record.residuals_left, record.residuals_right)
    sizes = (rig.left.size_px, rig.right.size_px)
    return CalibrationFacts(
        facts,
        tuple(map(Coverage, ("left", "right"), points, sizes)),
        camera_places(rig.R_right_left, rig.t_right_left_mm),
        tuple(vars(c) for c in record.cautions),
    )


def form_values(folder: Path) -> dict[str, str]:
    """What a new trial may take over from another one: markers, board, cameras, band."""
    from olivevib.trial import Trial
    from olivevib.tui.plan import values_of

    trial = Trial.open(folder)
    return values_of(trial.settings, trial.path)


def setting_values(folder: Path) -> tuple[SettingRow, ...]:
    """Every setting of a trial as it would be typed."""
    from olivevib.trial import Trial
    from olivevib.tui.views.setting_rows import setting_rows

    return setting_rows(Trial.open(folder).settings.model_dump(mode="json"))


def change_trial(folder: Path, changes: Mapping[str, Any]) -> None:
    """Write changed settings into trial.toml; raises UsageError, and then nothing is written."""
    from olivevib.trial import Trial

    Trial.open(folder).changed(changes)
