"""Reports as files: one page a trial, one page a season."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

from olivevib.errors import UsageError
from olivevib.files.atomic import write_bytes_atomic, write_text_atomic
from olivevib.files.exports.parquet import parquet_bytes, require_pyarrow
from olivevib.progress import Tick, silent
from olivevib.report.gather import content_of, entry_of
from olivevib.report.page import page_facts, render_facts
from olivevib.report.pdf import render_pdf, require_typst
from olivevib.report.plates import Plate
from olivevib.report.season import render_season
from olivevib.report.season_table import table_columns, table_csv

if TYPE_CHECKING:
    from olivevib.trial import Trial


@dataclass(frozen=True)
class Also:
    """What is written beside the page: PDF, every figure as an SVG file, Parquet of a season."""

    pdf: bool = False
    figures: bool = False
    parquet: bool = False

    def __post_init__(self) -> None:
        if self.pdf:
            require_typst()  # before the work, not after it
        if self.parquet:
            require_pyarrow()


def write_trial_report(
    trial: Trial, target: Path, tick: Tick = silent, also: Also = Also()
) -> tuple[Path, ...]:
    """Write the page of one trial as the file ``target`` (self-contained HTML), whole.

    Stages that have not run are said to be missing. Returns the files that were written, the page
    first. A file that cannot be read
    is left out and named. Raises InputError where ``target`` cannot be written.
    """
    facts = page_facts(content_of(trial.readable()), tick)
    write_text_atomic(target, render_facts(facts))
    paths = [target]
    if also.pdf:
        paths.append(target.with_suffix(".pdf"))
        write_bytes_atomic(paths[-1], render_pdf(facts))
    if also.figures:
        paths += _figures(facts["plates"], target.with_name(f"{target.stem}-figures"))
    return tuple(paths)


def _figures(plates: Mapping[str, Sequence[Plate]], folder: Path) -> list[Path]:
    """Every figure as a file of its own: SECTION.svg, SECTION-2.svg and so on."""
    folder.mkdir(exist_ok=True)
    paths = []
    for section, drawn in plates.items():
        for number, plate in enumerate(drawn, start=1):
            path = folder / (f"{section}.svg" if number == 1 else f"{section}-{number}.svg")
            write_text_atomic(path, plate.svg + "\n")
            paths.append(path)
    return paths


def write_season_report(
    trials: Sequence[tuple[Trial, Path | None]],
    target: Path,
    tick: Tick = silent,
    also: Also = Also(),
    archived: bool = False,
) -> tuple[Path, ...]:
    """Write one page over several trials; each trial comes with its own page's file, or None.

    The table links to these pages by relative address where they lie at or below the season page.
    Beside the page stands its table as CSV (and Parquet). Returns the files, the page first.
    Archived trials are in neither, but named on the page, unless ``archived``; UsageError where
    no other is left.
    """
    shown = [t for t in trials if archived or not t[0].settings.session.archived]
    left_out = [t[0].name for t in trials if not archived and t[0].settings.session.archived]
    if not shown:
        raise UsageError(
            "all of these trials are archived: the season has none to show.",
            "An archived trial is left out of lists.",
            "Take them in with --archived, or back with: olivevib archive TRIAL --undo",
        )
    entries = []
    for done, (trial, page) in enumerate(shown):
        tick(done, len(shown), f"reading {trial.name}")
        entries.append(entry_of(trial.readable(), _link(page, target.parent) if page else ""))
    write_text_atomic(target, render_season(entries, tick, left_out))
    rows = [row for entry in entries for row in entry.table]
    paths = [target, target.with_suffix(".csv")]
    write_text_atomic(paths[1], table_csv(rows))
    if also.parquet:
        paths.append(target.with_suffix(".parquet"))
        write_bytes_atomic(paths[-1], parquet_bytes(table_columns(rows), {"software": "olivevib"}))
    return tuple(paths)


def _link(page: Path, folder: Path) -> str:
    """The address of a page relative to a folder; empty where it lies elsewhere."""
    try:
        return quote(page.resolve().relative_to(folder.resolve()).as_posix())
    except ValueError:
        return ""
