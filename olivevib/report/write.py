"""Reports as files: one page a trial, one page a season."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

from olivevib.files.atomic import write_text_atomic
from olivevib.progress import Tick, silent
from olivevib.report.gather import content_of, entry_of
from olivevib.report.page import render_page
from olivevib.report.season import render_season

if TYPE_CHECKING:
    from olivevib.trial import Trial


def write_trial_report(trial: Trial, target: Path, tick: Tick = silent) -> None:
    """Write the page of one trial as the file ``target`` (self-contained HTML), whole.

    Stages that have not run are said to be missing. Raises InputError where a stage file cannot be
    read or ``target`` cannot be written.
    """
    write_text_atomic(target, render_page(content_of(trial), tick))


def write_season_report(
    trials: Sequence[tuple[Trial, Path | None]], target: Path, tick: Tick = silent
) -> None:
    """Write one page over several trials; each trial comes with its own page's file, or None.

    The table links to these pages by relative address where they lie at or below the season page.
    """
    entries = []
    for done, (trial, page) in enumerate(trials):
        tick(done, len(trials), f"reading {trial.name}")
        entries.append(entry_of(trial, _link(page, target.parent) if page else ""))
    write_text_atomic(target, render_season(entries, tick))


def _link(page: Path, folder: Path) -> str:
    """The address of a page relative to a folder; empty where it lies elsewhere."""
    try:
        return quote(page.resolve().relative_to(folder.resolve()).as_posix())
    except ValueError:
        return ""
