"""What the screens show of a trial: frozen values, read from the files in one place.

Everything heavy is imported inside: the first picture of the app waits for none of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from olivevib.errors import InputError, OlivevibError

if TYPE_CHECKING:
    from olivevib.comparison import Comparison
    from olivevib.detection import DetectionSettings
    from olivevib.geometry import StereoRig
    from olivevib.pipeline.export_preview import ExportPreview
    from olivevib.pipeline.machine import Check
    from olivevib.reconstruction import Trajectory
    from olivevib.trial import Trial
    from olivevib.trial.quality import StageLine
    from olivevib.trial.standing import Fault
    from olivevib.tui.views.coverage import Coverage
    from olivevib.tui.views.rig import RigScene
    from olivevib.tui.views.setting_rows import SettingRow
    from olivevib.tui.views.spectrogram import ShadePlot
    from olivevib.vibration import Vibration

Value = TypeVar("Value")
LAST = 30  # trials whose values a form offers again
STAGE_NAMES = ("calibrate", "track", "reconstruct", "analyse", "compare")


@dataclass(frozen=True)
class TrialRow:
    """One line of the trial list."""

    folder: Path
    name: str
    stages: tuple[StageLine, ...] = ()
    word: str = "…"
    why: str = "reading it"
    about: str = ""
    simulated: bool = False
    archived: bool = False
    notes: str = ""
    faults: tuple[Fault, ...] = ()


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
    notes: str = ""
    faults: tuple[Fault, ...] = ()


@dataclass(frozen=True)
class Results:
    """Everything the result screens draw; None where a stage has not run."""

    folder: Path
    summary: Mapping[str, Any]
    trajectory: Trajectory | None = None
    vibration: Vibration | None = None
    comparisons: tuple[Comparison, ...] = ()
    places: Mapping[int, str] = field(default_factory=dict)
    faults: tuple[Fault, ...] = ()
    sway_hz: float = 0.0  # slower motion counts as sway


@dataclass(frozen=True)
class FormValues:
    """What the form of a new trial starts with: values to take over, and what to offer."""

    shared: Mapping[str, str]
    used: Mapping[str, tuple[str, ...]]
    source: str = ""  # the trial that ``shared`` is of


@dataclass(frozen=True)
class CameraLine:
    """One camera at this computer: what it is called, its modes in words."""

    title: str
    modes: str


@dataclass(frozen=True)
class CalibrationFacts:
    """What the calibration page shows; no coverage before the stage has run."""

    summary: Mapping[str, Any]
    coverage: tuple[Coverage, ...] = ()
    places: tuple[str, ...] = ()
    cautions: tuple[Mapping[str, str], ...] = ()
    scene: RigScene | None = None
    faults: tuple[Fault, ...] = ()


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
    from olivevib.files.trial_folders import list_trials

    return tuple(list_trials(workspace))


def trial_row(folder: Path) -> TrialRow:
    """The line of one trial in the list; a trial that cannot be read says so in its line."""
    found = guarded(lambda: _row(folder))
    if isinstance(found, OlivevibError):
        return TrialRow(folder, folder.name, (), "unreadable", str(found))
    return found


def _row(folder: Path) -> TrialRow:
    from olivevib.trial import Trial
    from olivevib.trial.quality import quality_of, stage_lines
    from olivevib.trial.standing import faults

    trial = Trial.open(folder)
    session, tree = trial.settings.session, trial.settings.tree
    about = [str(part) for part in (session.date, session.place, tree.cultivar) if part]
    states = trial.states()
    stages = stage_lines(trial, states)
    quality = quality_of(stages, trial)
    return TrialRow(
        folder,
        trial.name,
        stages,
        quality.word,
        quality.why,
        ", ".join(about),
        session.simulated,
        session.archived,
        session.notes,
        faults(trial, states),
    )


def trial_facts(folder: Path) -> TrialFacts:
    """What the trial screen shows; raises InputError where the trial cannot be read."""
    from olivevib.trial import Trial
    from olivevib.trial.quality import stage_lines
    from olivevib.trial.standing import faults
    from olivevib.trial.summary import summary

    trial = Trial.open(folder)
    journal = trial.private / "track.journal"
    resume = "tracking was stopped half way: run goes on from there" if journal.exists() else ""
    states = trial.states()
    stages = stage_lines(trial, states)
    found = guarded(lambda: summary(trial))
    return TrialFacts(
        folder,
        trial.name,
        trial.settings.session.simulated,
        stages,
        None if isinstance(found, OlivevibError) else found,
        found if isinstance(found, OlivevibError) else None,
        resume,
        trial.settings.session.notes,
        faults(trial, states),
    )


def results(folder: Path) -> Results:
    """What the result screens draw; raises InputError where the trial cannot be read."""
    from olivevib.trial import Trial
    from olivevib.trial.standing import faults
    from olivevib.trial.summary import summary
    from olivevib.vibration.verdict import sway_below

    trial = Trial.open(folder)
    marked = {m.id: m.place or "" for m in trial.settings.markers.marker}
    found = (summary(trial), trial.trajectory, trial.vibration, trial.comparison)
    sway_hz = sway_below(trial.settings.vibration.band_hz)
    return Results(folder, *found, marked, faults(trial, trial.states()), sway_hz)


def calibration_facts(folder: Path) -> CalibrationFacts:
    """What the calibration page shows; raises InputError where a file cannot be read."""
    from olivevib.trial import Trial
    from olivevib.trial.standing import faults
    from olivevib.trial.summary import summary
    from olivevib.tui.views.coverage import Coverage, camera_places

    trial = Trial.open(folder)
    record, rig, facts = trial.calibration, trial.rig, summary(trial)
    if record is None or rig is None:
        known = faults(trial, trial.states())
        return CalibrationFacts(facts, faults=tuple(f for f in known if f.stage == "calibrate"))
    points = (record.residuals_left, record.residuals_right)
    sizes = (rig.left.size_px, rig.right.size_px)
    return CalibrationFacts(
        facts,
        tuple(map(Coverage, ("left", "right"), points, sizes)),
        camera_places(rig.R_right_left, rig.t_right_left_mm),
        tuple(vars(c) for c in record.cautions),
        _scene(trial, rig),
    )


def _scene(trial: Trial, rig: StereoRig) -> RigScene:
    """Both cameras in the left one's frame, and the mean place of each marker."""
    import numpy as np

    from olivevib.tui.views.coverage import camera_places
    from olivevib.tui.views.rig import RigScene, Stand

    R, t = rig.R_right_left, rig.t_right_left_mm
    stands = []
    for name, camera, axes, centre in (
        ("left", rig.left, np.eye(3), np.zeros(3)),
        ("right", rig.right, R, -R.T @ t),
    ):
        width, height = camera.size_px
        half = (np.arctan(width / 2 / camera.K[0, 0]), np.arctan(height / 2 / camera.K[1, 1]))
        stands.append(Stand(name, centre, axes, float(half[0]), float(half[1])))
    path, points = trial.trajectory, np.empty((0, 3))
    if path is not None:
        seen = np.asarray(np.isfinite(path.xyz_mm).all(axis=2))
        count = np.maximum(1, seen.sum(axis=0))[:, None]
        means = np.where(seen[:, :, None], path.left_camera_mm, 0.0).sum(axis=0) / count
        points = means[np.asarray(seen.any(axis=0))]
    told = "; dots: markers" if len(points) else ""
    return RigScene(tuple(stands), points, f"{camera_places(R, t)[0]}{told}")


def camera_lines() -> tuple[CameraLine, ...]:
    """The cameras at this computer, in the order of their numbers."""
    from olivevib.files.capture import list_cameras
    from olivevib.pipeline.capture.devices import mode_words

    return tuple(CameraLine(c.title, mode_words(c.modes)) for c in list_cameras())


def shades(found: Results, marker: int, name: str) -> ShadePlot | None:
    """The spectrogram of one marker, the same as in the report; None for too short a record."""
    from olivevib.report.content import ReportContent
    from olivevib.report.figures.spectrogram import spectrogram
    from olivevib.tui.views.of_results import bands_of
    from olivevib.tui.views.spectrogram import ShadePlot

    content = ReportContent(
        found.folder.name,
        trajectory=found.trajectory,
        vibration=found.vibration,
        sway_hz=found.sway_hz,
    )
    path = content.shown_path
    if path is None or marker not in path.ids:
        return None
    one = spectrogram(path, marker, content.shown_hz, content.sway_hz)
    if one is None:
        return None
    how = "of the fitted motion" if content.continuous else "as sampled"
    title = f"marker {name} · displacement, {how}, above {content.sway_hz:g} Hz"
    return ShadePlot(title, one.t_s, one.f_hz, one.power, bands_of(found.vibration))


def form_values(workspace: Path, like: Path | None) -> FormValues:
    """What a new trial may take over from ``like``, and what trials here have said before.

    like None: from the trial that was made last, but not its calibration, because the cameras may
    have been moved since.
    """
    from olivevib.trial import Trial
    from olivevib.tui.plan import values_of

    opened = {f: guarded(partial(Trial.open, f)) for f in trial_folders(workspace)[-LAST:]}
    trials = {f: trial for f, trial in opened.items() if isinstance(trial, Trial)}
    source = like or max(trials, key=_made_ns, default=None)
    used: dict[str, dict[str, None]] = {}
    shared: Mapping[str, str] = {}
    for folder, trial in trials.items():
        values = values_of(trial.settings, trial.path, folder == like)
        shared = values if folder == source else shared
        for name, text in values.items():
            used.setdefault(name, {})[text] = None
    offered = {name: tuple(texts) for name, texts in used.items()}
    return FormValues(shared, offered, source.name if source and shared else "")


def _made_ns(folder: Path) -> int:
    """When trial.toml was last written."""
    return (folder / "trial.toml").stat().st_mtime_ns


def export_contents(folder: Path, kind: str, ids: tuple[int, ...] | None) -> ExportPreview:
    """What an export of these markers (None: all) holds; raises as ``pipeline.export`` does."""
    from olivevib.pipeline.export_preview import export_preview
    from olivevib.trial import Trial

    return export_preview(Trial.open(folder), kind, ids)


def result_stamps(folders: Iterable[Path]) -> tuple[tuple[str, int], ...]:
    """When each result of these trials was written: what shows that a stage has ended."""
    found = []
    for folder in folders:
        for path in (*folder.glob("*.h5"), folder / "rig.toml"):
            with suppress(OSError):
                found.append((str(path), path.stat().st_mtime_ns))
    return tuple(sorted(found))


def machine_checks(workspace: Path) -> tuple[Check, ...]:
    """What ``olivevib doctor`` finds; every camera runs for a second."""
    from olivevib.pipeline.machine import examine

    return tuple(examine(workspace))


def book_lines(workspace: Path) -> tuple[str, ...]:
    """The workspace's book of cameras, a line a camera and mode; raises InputError."""
    from olivevib.trial.camera_book import read_book

    return tuple(
        f"{e.mode.camera}, {e.mode.size_px[0]} × {e.mode.size_px[1]} at {e.mode.fps:g} frames/s: "
        f"{e.row_time_us:.3f} ± {e.sigma_us:.3f} µs a row ({e.source})"
        for e in read_book(workspace)
    )


def settings_now(folder: Path) -> DetectionSettings:
    """The parameters of detection as trial.toml has them; raises InputError."""
    from olivevib.trial import Trial

    return Trial.open(folder).settings.detection


def setting_values(folder: Path) -> tuple[SettingRow, ...]:
    """Every setting of a trial as it would be typed."""
    from olivevib.trial import Trial
    from olivevib.tui.views.setting_rows import setting_rows

    return setting_rows(Trial.open(folder).settings.model_dump(mode="json"))


def change_trial(folder: Path, changes: Mapping[str, Any]) -> None:
    """Write changed settings into trial.toml; raises UsageError, and then nothing is written."""
    from olivevib.trial import Trial

    Trial.open(folder).changed(changes)
