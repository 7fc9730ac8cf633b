"""Verbs of the measurement: calibrate, track, reconstruct, analyse, compare, run."""

from __future__ import annotations

import argparse
import math
from typing import TYPE_CHECKING

from olivevib import values
from olivevib.cli.console import Console
from olivevib.errors import UsageError
from olivevib.values import counted

if TYPE_CHECKING:
    from olivevib.errors import Caution
    from olivevib.trial import Trial

PAPER_KEYS: dict[str, dict[str, object]] = {
    "calibrate": {"calibration.paper": True},
    "track": {"detection.mode": "paper", "detection.paper_centre": True},
    "reconstruct": {"reconstruction.paper": True},
    "analyse": {},
    "compare": {},
}


def one(arguments: argparse.Namespace, console: Console) -> int:
    """Run one stage of each trial, whether or not it is up to date."""
    from olivevib import pipeline

    changes = values.settings(arguments.set)
    if arguments.paper:
        changes |= PAPER_KEYS[arguments.stage]
    if arguments.stage == "calibrate" and _on_cameras(arguments):
        from olivevib.cli.live_board import live_preview

        return live_preview(arguments, console)
    if arguments.stage == "calibrate" and (arguments.preview or arguments.sigma):
        from olivevib.cli import calibration

        verb = calibration.preview if arguments.preview else calibration.sigma
        return max(verb(_open(name, changes, console), console) for name in arguments.trials)
    warned = 0
    for name in arguments.trials:
        trial = _open(name, changes, console)
        console.say(f"{trial.name}: {arguments.stage}")
        cautions = pipeline.run_stage(trial, arguments.stage, console.tick)
        if arguments.stage == "compare":
            _tell_comparison(trial.reopen(), console)
        warned += console.cautions(cautions)
    return 3 if warned else 0


def _tell_comparison(trial: Trial, console: Console) -> None:
    """What came out for each sensor: verdict, reason and gain."""
    for c in trial.comparison:
        gain = ""
        if math.isfinite(c.gain):
            gain = f"; gain (camera over sensor) {values.with_sigma(c.gain, c.gain_sigma, 4)}"
        console.say(f"  {c.sensor} at marker {c.marker}: {c.verdict}{gain}")
        console.say(f"    {c.reason}")
    if not trial.comparison:
        console.say("  nothing was compared: no accelerometer is bound to a marker in trial.toml")


def _on_cameras(arguments: argparse.Namespace) -> bool:
    """Whether the preview is to run on cameras; UsageError where that makes no sense."""
    if arguments.left is None and arguments.right is None:
        return False
    if not arguments.preview or len(arguments.trials) != 1 or arguments.set or arguments.paper:
        raise UsageError(
            "--left and --right name cameras for the preview of one trial.",
            "They go with --preview and one TRIAL, without --set and --paper.",
            "Record first: olivevib calibrate TRIAL --preview --left DEVICE --right DEVICE",
        )
    return True


def run(arguments: argparse.Namespace, console: Console) -> int:
    """Run every stage that is missing or stale, in order."""
    from olivevib import pipeline

    warned = 0
    changes = values.settings(arguments.set)
    for name in arguments.trials:
        trial = _open(name, changes, console)
        console.say(f"{trial.name}")
        told: set[Caution] = set()
        for outcome in pipeline.run(trial, console.tick):
            console.say(f"  {outcome.stage}: {outcome.words}")
            console.cautions(outcome.cautions)
            told.update(outcome.cautions)
        standing = trial.reopen().cautions  # also those of stages that were up to date
        warned += len(standing) + len(told)
        kept = [caution for caution in standing if caution not in told]
        if kept:
            console.say(f"  {counted(len(kept), 'warning')} of earlier runs: olivevib show {name}")
        console.say(f"Next: olivevib show {name}   or   olivevib report {name}")
    return 3 if warned else 0


def _open(name: str, changes: dict[str, object], console: Console) -> Trial:
    from olivevib.cli.trials import trial_of

    trial = trial_of(name, console)
    if changes:
        trial = trial.changed(changes)
        told = ", ".join(f"{key} = {value}" for key, value in changes.items())
        console.say(f"{trial.name}: trial.toml now says {told}")
    return trial
