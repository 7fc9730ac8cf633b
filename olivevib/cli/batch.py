"""Verb batch: many trials, on the cores here or on a cluster."""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Generator, Sequence
from contextlib import closing
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from olivevib.cli.console import Console

NAMED = 5  # trials that are named with a warning; --json has all of them

if TYPE_CHECKING:
    from olivevib.batch import TrialResult


def batch(arguments: argparse.Namespace, console: Console) -> int:
    """Measure and report every trial; print trial and result hash, list failures at the end."""
    from olivevib.batch import find_trials

    trials = find_trials(arguments.trials, Path())
    console.say(f"{len(trials)} trial{'s' * (len(trials) != 1)}")
    results: list[TrialResult] = []
    try:
        with closing(_measured(arguments, trials, console)) as coming:
            results.extend(coming)
    finally:  # also when cancelled: what is done is told
        place = {str(trial): n for n, trial in enumerate(trials)}
        results.sort(key=lambda r: place[r.folder])
        _count(results, len(trials), console)
        _print(results, _names(trials), arguments.json)
        _tell(results, _names(trials), console)
    if any(r.failed for r in results):
        return 1
    return 3 if any(r.cautions for r in results) else 0


def _measured(
    arguments: argparse.Namespace, trials: Sequence[Path], console: Console
) -> Generator[TrialResult, None, None]:
    from olivevib.batch import measure_here, measure_on_cluster

    if arguments.scheduler:
        return measure_on_cluster(trials, arguments.scheduler, console.tick)
    return measure_here(trials, arguments.workers, console.tick)


def _names(trials: Sequence[Path]) -> dict[str, str]:
    """Each trial by its folder's name where that is the only one of that name, else by its path."""
    count = Counter(trial.name for trial in trials)
    return {str(t): t.name if count[t.name] == 1 else str(t) for t in trials}


def _print(results: Sequence[TrialResult], names: dict[str, str], as_json: bool) -> None:
    if as_json:
        rows = [_facts(result, names[result.folder]) for result in results]
        print(json.dumps({"trials": rows}, indent=2, ensure_ascii=False))
        return
    for result in results:
        if not result.failed:
            print(f"{names[result.folder]} {result.hash}")


def _facts(result: TrialResult, name: str) -> dict[str, Any]:
    error = {"what": result.what, "why": result.why, "remedy": result.remedy}
    return {
        "trial": name,
        "state": "failed" if result.failed else "done",
        "hash": result.hash or None,
        "ran": result.ran,
        "warnings": [asdict(c) for c in result.cautions],
        "error": error if result.failed else None,
    }


def _count(results: Sequence[TrialResult], total: int, console: Console) -> None:
    failed = sum(r.failed for r in results)
    idle = sum(not r.failed and not r.ran for r in results)
    told = f" ({idle} up to date before)" if idle else ""
    console.say(f"{len(results) - failed} of {total} done{told}, {failed} failed")


def _tell(results: Sequence[TrialResult], names: dict[str, str], console: Console) -> None:
    """Each warning with its trials, and every failure with its remedy."""
    warned: dict[str, list[str]] = {}
    for result in results:
        for code in dict.fromkeys(c.code for c in result.cautions):
            warned.setdefault(code, []).append(names[result.folder])
    for code, trials in warned.items():
        more = f" and {len(trials) - NAMED} more" if len(trials) > NAMED else ""
        console.say(f"warning [{code}]: {', '.join(trials[:NAMED])}{more}")
    if warned:
        console.say("    Texts and remedies: olivevib show TRIAL")
    for result in results:
        if result.failed:
            what = f"{names[result.folder]} failed: {result.what}"
            console.error(what, result.why, result.remedy)
