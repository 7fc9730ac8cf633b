"""Verbs on what was measured: show, report, export, check."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from olivevib import values
from olivevib.cli.console import Console
from olivevib.errors import OlivevibError
from olivevib.values import counted

if TYPE_CHECKING:
    from olivevib.trial import Trial


def show(arguments: argparse.Namespace, console: Console) -> int:
    """Print state and headline numbers."""
    from olivevib.cli.trials import trial_of
    from olivevib.trial.summary import summary

    if arguments.trial is None:
        return _list(arguments.json, console)
    facts = summary(trial_of(arguments.trial, console).readable())
    if arguments.json:
        _out(json.dumps(facts, indent=2, ensure_ascii=False, allow_nan=False))
    else:
        from olivevib.cli.summary_text import summary_text

        _out(summary_text(facts))
    return 0


def _list(as_json: bool, console: Console) -> int:
    """Every trial of the workspace here: its quality word, and why."""
    from olivevib.files.trial_folders import list_trials
    from olivevib.trial import Trial
    from olivevib.trial.quality import quality_of, stage_lines

    rows: list[dict[str, Any]] = []
    archived = 0
    for folder in list_trials(Path()):
        try:
            trial = Trial.open(folder)
            stages = stage_lines(trial)
            quality = quality_of(stages, trial)
        except OlivevibError as error:
            rows.append({"trial": folder.name, "quality": "unreadable", "why": error.what})
            continue
        archived += trial.settings.session.archived
        if not trial.settings.session.archived:
            states = {stage.name: stage.state for stage in stages}
            row = {"trial": trial.name, "quality": quality.word, "why": quality.why}
            rows.append(row | {"stages": states})
    if as_json:
        _out(json.dumps(rows, indent=2, ensure_ascii=False))
    for row in () if as_json else rows:
        _out(f"{row['trial']}  {row['quality']}: {row['why']}")
    if archived:
        console.say(f"{counted(archived, 'archived trial')} not shown")
    elif not rows:
        console.say(f"No trial is here: none in {Path().resolve() / 'trials'}.")
        console.say("Change to a workspace, or make a trial: olivevib new TRIAL --left … --right …")
        console.say("To see one first: olivevib demo")
    return 0


def report(arguments: argparse.Namespace, console: Console) -> int:
    """Write one page a trial; several trials also give a season page and its table."""
    from olivevib import pipeline
    from olivevib.batch import find_trials
    from olivevib.report import Also
    from olivevib.trial import Trial

    also = Also(pdf=arguments.pdf, figures=arguments.figures, parquet=arguments.parquet)
    trials = [Trial.open(folder) for folder in find_trials(arguments.trials, Path())]
    pages = not arguments.season
    archived = arguments.archived
    for path in pipeline.report(trials, arguments.output, console.tick, also, pages, archived):
        _out(str(path))
    hidden = [t.name for t in trials if t.settings.session.archived and not archived]
    if hidden and (len(trials) > 1 or not pages):
        told = f"archived, not in the season: {', '.join(hidden)}"
        console.say(f"{told}  (--archived takes them in)")
    return 3 if sum(_told_first(trial, console, len(trials) > 1) for trial in trials) else 0


def _told_first(trial: Trial, console: Console, named: bool) -> int:
    """Say what failed in a trial and which of its numbers are old; returns how much that is."""
    from olivevib.trial.standing import standing

    found = standing(trial)
    if found and named:
        console.say(f"{trial.name}:")
    return console.cautions(found)


def export(arguments: argparse.Namespace, console: Console) -> int:
    """Write the 3-D paths for another program."""
    from olivevib import pipeline
    from olivevib.cli.trials import trial_of

    trial = trial_of(arguments.trial, console)
    ids = values.id_list(arguments.markers) or None
    target: Path | BinaryIO = pipeline.export_place(trial, arguments.to)
    if arguments.output:
        target = sys.stdout.buffer if arguments.output == "-" else Path(arguments.output)
    found = pipeline.export(trial, arguments.to, target, ids)
    if isinstance(target, Path):
        _out(str(target))
    words = pipeline.export_words(trial, arguments.to, ids)
    if words:
        console.say(f"{arguments.to}: {words}")
    return 3 if console.cautions(found) else 0


def check(arguments: argparse.Namespace, console: Console) -> int:
    """Say what of a trial is whole, what is lost, what can be remade."""
    from olivevib import pipeline
    from olivevib.cli.trials import folder_of

    findings = pipeline.check(folder_of(arguments.trial, console), console.tick)
    for finding in findings:
        words = finding.words.replace("\n", "\n" + " " * 9)
        _out(f"{finding.state:8} {finding.what}  {words}".rstrip())
    states = {finding.state for finding in findings}
    return 1 if states & {"lost", "faulty"} else 3 if states & {"damaged", "remake"} else 0


def _out(text: Any) -> None:
    print(text, file=sys.stdout)
