"""Verbs paper and benchmark: what was claimed, measured again on this machine."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from olivevib.cli.console import Console

if TYPE_CHECKING:
    from olivevib.studies import Entry


def paper(arguments: argparse.Namespace, console: Console) -> int:
    """Reproduce an experiment of the paper."""
    from olivevib.studies import PAPER

    return _study(arguments, console, PAPER, "paper")


def benchmark(arguments: argparse.Namespace, console: Console) -> int:
    """Measure speed and accuracy beside other libraries."""
    from olivevib.studies import BENCHMARKS

    return _study(arguments, console, BENCHMARKS, "benchmark")


def _study(
    arguments: argparse.Namespace, console: Console, kind: tuple[Entry, ...], verb: str
) -> int:
    from olivevib.studies import Effort, as_json, as_text, find, write_study

    if arguments.name is None:
        width = max((len(entry.name) for entry in kind), default=0)
        for entry in kind:
            print(f"{entry.name:{width}}  {entry.what}")
        console.say(f"Run one with: olivevib {verb} NAME")
        return 0
    effort = Effort(arguments.effort, arguments.seed)
    study = find(kind, arguments.name).load()(effort, console.tick)
    print(as_json(study) if arguments.json else as_text(study), end="")
    paths = write_study(study, Path(arguments.output or f"reports/{verb}"))
    console.say(f"kept in {paths[0].parent}: {', '.join(path.name for path in paths)}")
    for goal in study.missed:
        console.say(f"not reached: {goal.quantity}: asked {goal.asked}, measured {goal.measured}")
    return 3 if study.missed else 0
