"""Which results of a trial are not of the trial as it is now, and what has failed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from olivevib.errors import Caution, OlivevibError
from olivevib.trial.stages import (
    BY_NAME,
    STAGES,
    Condition,
    StageState,
    last_fault,
)

if TYPE_CHECKING:
    from olivevib.trial.trial import Trial

CODES = ("stage-failed", "results-stale", "results-left")  # said before everything else


def old_results(trial: Trial, states: Mapping[str, StageState]) -> dict[str, str]:
    """Of each stage whose stored result is not that of the trial as it is now: why, in words.

    The words go on after "these numbers": of a stage that waits for an earlier one, those of the
    earlier one.
    """
    out = {}
    for stage in STAGES:
        there = (trial.folder / stage.file).exists() and stage.file not in dict(trial.damage)
        if there and states[stage.name].state is not Condition.DONE:
            out[stage.name] = _why(*_root(stage.name, states))
    return out


def standing(trial: Trial, states: Mapping[str, StageState] | None = None) -> tuple[Caution, ...]:
    """What a person must know before any number: failures, results from before a change.

    states: those of the trial, where they are known already.
    """
    states = trial.states() if states is None else states
    found = (_fault(trial, name, s) for name, s in states.items() if _root(name, states)[0] == name)
    out = [caution for caution in found if caution is not None]
    by_root: dict[str, list[str]] = {}
    for name in old_results(trial, states):
        by_root.setdefault(_root(name, states)[0], []).append(name)
    out += [
        _old(trial, root, states[root], names)
        for root, names in by_root.items()
        if states[root].state is not Condition.BLOCKED  # said already, with its remedy
    ]
    return tuple(out)


def _root(name: str, states: Mapping[str, StageState]) -> tuple[str, StageState]:
    """The stage that is to blame for the state of ``name``: itself, or one that it waits for."""
    if states[name].state is Condition.SKIPPED:
        return name, states[name]
    for need in BY_NAME[name].needs:
        if states[need].state is not Condition.DONE:
            return _root(need, states)
    return name, states[name]


def _why(name: str, found: StageState) -> str:
    reason = found.reason.rstrip(".")
    if found.state is Condition.STALE and reason.endswith("changed"):
        return f"are from before {reason}"
    if found.state is Condition.SKIPPED:
        return f"are of an input that is no longer asked for ({reason})"
    if found.state is Condition.MISSING:
        return f"are from before the result of {name} was removed"
    word = {Condition.FAILED: f"{name} failed: "}.get(found.state, "")
    return f"are not shown to be of the trial as it is now ({word}{reason})"


def _fault(trial: Trial, name: str, found: StageState) -> Caution | None:
    """What made a stage fail, or keeps it from running: what, why and remedy; None for neither."""
    fault: OlivevibError | None = None
    if found.state is Condition.FAILED:
        fault, word = last_fault(trial.folder, BY_NAME[name]), "failed"
    elif found.state is Condition.BLOCKED:
        word = "cannot run"
        try:
            trial.fingerprint(name)
        except OlivevibError as error:
            fault = error
    if fault is None:
        return None
    text = f"{name} {word}: {fault.what} {fault.why}".strip()
    return Caution("stage-failed", text, fault.remedy or f"Run: olivevib run {trial.name}")


def _old(trial: Trial, root: str, found: StageState, names: list[str]) -> Caution:
    """What is said of the results of ``names``, which are old because of one stage."""
    listed = names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
    text = f"The numbers of {listed} {_why(root, found)}."
    if found.state is Condition.SKIPPED:
        remedy = f"Name the input in trial.toml again and run; or delete {BY_NAME[root].file}."
        return Caution("results-left", text, remedy)
    return Caution("results-stale", text, f"Run: olivevib run {trial.name}")
