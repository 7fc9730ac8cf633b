"""What leaves a trial: reports and exports."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from olivevib.errors import Caution, InputError
from olivevib.files.atomic import as_input_error
from olivevib.files.exports import EVEN, ExportFacts, even_part, only_markers
from olivevib.files.exports import export as write_export
from olivevib.progress import Tick, silent
from olivevib.trial import Condition, Trial

if TYPE_CHECKING:
    from olivevib.report import Also


_CHAIN = ("rig.toml", "calibration.h5", "tracks.h5", "trajectory.h5")


def export_place(trial: Trial, to: str) -> Path:
    """Where an export goes when nobody said: ``exports/`` of the trial."""
    return trial.folder / "exports" / f"{trial.name}.{to}"


def export(
    trial: Trial, to: str, target: Path | BinaryIO, ids: tuple[int, ...] | None = None
) -> tuple[Caution, ...]:
    """Write the paths of the markers ``ids`` (None: all); what is stale or left out comes back.

    InputError before reconstruct, and where a file that the paths come from is damaged.
    """
    sound = trial.readable()
    for name, why in sound.damage:
        if name in _CHAIN:
            raise InputError(
                f"trial {trial.name} is damaged: its paths are not exported.",
                f"{name}: {why}",
                f"Run: olivevib check {trial.name}   then   olivevib run {trial.name}",
            )
    trajectory = sound.trajectory
    if trajectory is None:
        raise trial.need("reconstruct")
    facts = ExportFacts(trial.name, sound.rig, tuple(sound.spectra.values()))
    if isinstance(target, Path) and target.parent == export_place(trial, to).parent:
        _make(target.parent)
    write_export(trajectory, to, target, facts, ids)
    return tuple(_export_cautions(sound))


def _make(folder: Path) -> None:
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise as_input_error(error, folder) from error


def export_words(trial: Trial, to: str, ids: tuple[int, ...] | None = None) -> str:
    """What a file of this format does not hold of the paths, and its rate; empty: it holds all."""
    trajectory = trial.readable().trajectory
    if to not in EVEN or trajectory is None:
        return ""
    return even_part(only_markers(trajectory, ids)).words


def _export_cautions(trial: Trial) -> Iterator[Caution]:
    """What a person should know of the file: paths that are not those of the trial as it is now."""
    state = trial.states()["reconstruct"]
    if state.state is not Condition.DONE:
        yield Caution(
            "export-stale",
            f"What was exported is not up to date: reconstruct is {state.state} ({state.reason}).",
            f"Run: olivevib run {trial.name}   and export again.",
        )
    yield from (c for c in trial.cautions if c.code == "file-damaged")


def report(
    trials: Sequence[Trial],
    folder: str | None,
    tick: Tick = silent,
    also: Also | None = None,
    pages: bool = True,
    archived: bool = False,
) -> Iterator[Path]:
    """Write one page a trial (report.html in its folder, or NAME.html in ``folder``).

    Several trials also give a season page, season.html in ``folder`` or in the current folder, with
    its table season.csv. pages False: the season alone, with links to the pages that are there.
    archived: trials that were taken out of lists are in the season too. also: PDF, figures as
    files, Parquet. Yields each file as it is written.
    """
    from olivevib.report import Also, write_season_report, write_trial_report

    also = also or Also()
    named: list[tuple[Trial, Path | None]] = []
    for trial in trials:
        page = Path(folder) / f"{trial.name}.html" if folder else trial.folder / "report.html"
        if pages:
            page.parent.mkdir(parents=True, exist_ok=True)
            yield from write_trial_report(trial, page, tick, also)
        named.append((trial, page if page.exists() else None))
    if len(trials) > 1 or not pages:
        season = Path(folder or ".") / "season.html"
        season.parent.mkdir(parents=True, exist_ok=True)
        yield from write_season_report(named, season, tick, also, archived)
