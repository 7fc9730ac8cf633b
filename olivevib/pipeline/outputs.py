"""What leaves a trial: reports and exports."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from olivevib.files.exports import ExportFacts
from olivevib.files.exports import export as write_export
from olivevib.progress import Tick, silent
from olivevib.trial import Trial

if TYPE_CHECKING:
    from olivevib.report import Also


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


def report(
    trials: Sequence[Trial],
    folder: str | None,
    tick: Tick = silent,
    also: Also | None = None,
    pages: bool = True,
) -> Iterator[Path]:
    """Write one page a trial (report.html in its folder, or NAME.html in ``folder``).

    Several trials also give a season page, season.html in ``folder`` or in the current folder, with
    its table season.csv. pages False: the season alone, with links to the pages that are there.
    also: PDF, figures as files, Parquet. Yields each file as it is written.
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
        yield from write_season_report(named, season, tick, also)
