"""Verbs on what was measured: show, report, export, check."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from olivevib import values
from olivevib.cli.console import Console


def show(arguments: argparse.Namespace, console: Console) -> int:
    """Print state and headline numbers."""
    from olivevib.trial import Trial
    from olivevib.trial.summary import summary
    from olivevib.trial.workspace import find_trial

    facts = summary(Trial.open(find_trial(arguments.trial, Path())))
    if arguments.json:
        _out(json.dumps(facts, indent=2, ensure_ascii=False, allow_nan=False))
    else:
        from olivevib.cli.summary_text import summary_text

        _out(summary_text(facts))
    return 0


def report(arguments: argparse.Namespace, console: Console) -> int:
    """Write one page a trial; several trials also give a season page."""
    from olivevib import pipeline
    from olivevib.trial import Trial
    from olivevib.trial.workspace import find_trial

    trials = [Trial.open(find_trial(name, Path())) for name in arguments.trials]
    for page in pipeline.report(trials, arguments.output, console.tick):
        _out(str(page))
    return 0


def export(arguments: argparse.Namespace, console: Console) -> int:
    """Write the 3-D paths for another program."""
    from olivevib import pipeline
    from olivevib.trial import Trial
    from olivevib.trial.workspace import find_trial

    trial = Trial.open(find_trial(arguments.trial, Path()))
    ids = values.id_list(arguments.markers) or None
    if arguments.output == "-":
        pipeline.export(trial, arguments.to, sys.stdout.buffer, ids)
        return 0
    target = (
        Path(arguments.output) if arguments.output else pipeline.export_place(trial, arguments.to)
    )
    pipeline.export(trial, arguments.to, target, ids)
    _out(str(target))
    return 0


def check(arguments: argparse.Namespace, console: Console) -> int:
    """Say what of a trial is whole, what is lost, what can be remade."""
    from olivevib import pipeline
    from olivevib.trial.workspace import find_trial

    findings = pipeline.check(find_trial(arguments.trial, Path()), console.tick)
    for finding in findings:
        _out(f"{finding.state:8} {finding.what}  {finding.words}".rstrip())
    states = {finding.state for finding in findings}
    return 1 if "lost" in states else 3 if "damaged" in states else 0


def _out(text: Any) -> None:
    print(text, file=sys.stdout)
