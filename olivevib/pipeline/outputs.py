"""What leaves a trial: reports and exports."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

from olivevib.files.exports import ExportFacts
from olivevib.files.exports import export as write_export
from olivevib.progress import Tick, silent
from olivevib.trial import Trial


def export_place(trial: Trial, to: str) -> Path:
    """Where an export goes when nobody said: ``exports/`` of the trial."""
    return trial.folder / "exports" / f"{trial.name}.{to}"


def export(
    trial: Trial, to: str, target: Path | BinaryIO, ids: tuple[int, ...] | None = None
) -> None:
    """Write the paths of the markers ``ids`` (None: all); InputError before reconstruct."""
    trajectory = trial.trajectory
    if trajectory is None:
        raise trial.need("reconstruct")
    facts = ExportFacts(trial.name, trial.rig, tuple(trial.spectra.values()))
    write_export(trajectory, to, target, facts, ids)


def report(trials: Sequence[Trial], folder: str | None, tick: Tick = silent) -> Iterator[Path]:
    """Write one page a trial (report.html in its folder, or NAME.html in ``folder``).

    Several trials also give a season page, season.html in ``folder`` or in the current folder.
    """
    from olivevib.report import write_season_report, write_trial_report

    pages = []
    for trial in trials:
        page = Path(folder) / f"{trial.name}.html" if folder else trial.folder / "report.html"
        page.parent.mkdir(parents=True, exist_ok=True)
        write_trial_report(trial, page, tick)
        pages.append(page)
        yield page
    if len(trials) > 1:
        season = Path(folder or ".") / "season.html"
        write_season_report(list(zip(trials, pages, strict=True)), season, tick)
        yield season
