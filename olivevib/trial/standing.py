"""Which results of a trial are not of the trial as it is now, and what has failed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

from olivevib.errors import Caution, InputError, OlivevibError
from olivevib.trial.stages import (
    BY_NAME,
    STAGES,
    Condition,
    StageState,
    last_fault,
)
from olivevib.values import listed

if TYPE_CHECKING:
    from olivevib.trial.trial import Trial

CODES = ("stage-failed", "results-stale", "results-left")  # said before everything else


class Fault(NamedTuple):
    """What keeps a stage from its result: its name, its state, and the error whole."""

    stage: str
    state: Condition
    error: OlivevibError


def faults(trial: Trial, states: Mapping[str, StageState]) -> tuple[Fault, ...]:
    """Of the stages that failed, or whose own inputs cannot be read: the errors, each once."""
    found: dict[str, Fault] = {}
    for name, state in states.items():
        error = _error(trial, name, state) if _root(name, states)[0] == name else None
        if error is not None:
            found.setdefault(error.what, Fault(name, state.state, error))
    return tuple(found.values())


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
    out = [_said(trial, fault) for fault in faults(trial, states)]
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


def _error(trial: Trial, name: str, found: StageState) -> OlivevibError | None:
    """What made a stage fail, or keeps it from running; None for neither."""
    if found.state is Condition.FAILED:
        return last_fault(trial.folder, BY_NAME[name]) or InputError(found.reason)
    if found.state is Condition.BLOCKED:
        try:
            trial.fingerprint(name)
        except OlivevibError as error:
            return error
    return None


def _said(trial: Trial, fault: Fault) -> Caution:
    word = "failed" if fault.state is Condition.FAILED else "cannot run"
    text = f"{fault.stage} {word}: {fault.error.what} {fault.error.why}".strip()
    return Caution("stage-failed", text, fault.error.remedy or f"Run: olivevib run {trial.name}")


def _old(trial: Trial, root: str, found: StageState, names: list[str]) -> Caution:
    """What is said of the results of ``names``, which are old because of one stage."""
    text = f"The numbers of {listed(names)} {_why(root, found)}."
    if found.state is Condition.SKIPPED:
        remedy = f"Name the input in trial.toml again and run; or delete {BY_NAME[root].file}."
        return Caution("results-left", text, remedy)
    return Caution("results-stale", text, f"Run: olivevib run {trial.name}")
