"""Which stage is done, stale, missing, failed, blocked or skipped: computed from files alone."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from olivevib.errors import InputError, OlivevibError
from olivevib.files.atomic import write_text_atomic
from olivevib.files.store import read_header


class Condition(StrEnum):
    """The words for the state of a stage."""

    DONE = "done"
    STALE = "stale"
    MISSING = "missing"
    FAILED = "failed"
    BLOCKED = "blocked"
    SKIPPED = "skipped"


@dataclass(frozen=True)
class StageState:
    """The state of one stage and the reason in words."""

    state: Condition
    reason: str


@dataclass(frozen=True)
class Fingerprint:
    """What a stage's result depends on: SHA-256 of each input file, and its settings (JSON)."""

    inputs: Mapping[str, str]
    settings: Mapping[str, Any]

    def canonical(self) -> str:
        """The fingerprint as text that is equal for equal fingerprints."""
        return json.dumps([dict(self.inputs), dict(self.settings)], sort_keys=True)


@dataclass(frozen=True)
class Stage:
    """One step of the measurement: its verb, the file it writes, and the stages it needs."""

    name: str
    file: str
    schema: int
    needs: tuple[str, ...]


STAGES = (
    Stage("calibrate", "calibration.h5", 1, ()),
    Stage("track", "tracks.h5", 1, ()),
    Stage("reconstruct", "trajectory.h5", 2, ("calibrate", "track")),
    Stage("analyse", "vibration.h5", 2, ("reconstruct",)),
    Stage("compare", "comparison.h5", 2, ("reconstruct",)),
)
BY_NAME = {stage.name: stage for stage in STAGES}
UNUSABLE = (Condition.MISSING, Condition.FAILED, Condition.BLOCKED, Condition.SKIPPED)


def stage_states(
    folder: Path,
    fingerprint: Callable[[Stage], Fingerprint],
    wanting: Mapping[str, str],
) -> dict[str, StageState]:
    """The state of every stage of the trial in ``folder``, in order.

    fingerprint: what the stage would depend on if it ran now (may raise OlivevibError where an
    input is unreadable). wanting: stage -> reason why there is nothing for it to do.
    """
    states: dict[str, StageState] = {}
    for stage in STAGES:
        states[stage.name] = _state(folder, stage, states, fingerprint, wanting)
    return states


def _state(
    folder: Path,
    stage: Stage,
    earlier: Mapping[str, StageState],
    fingerprint: Callable[[Stage], Fingerprint],
    wanting: Mapping[str, str],
) -> StageState:
    if stage.name in wanting:
        return StageState(Condition.SKIPPED, wanting[stage.name])
    for need in stage.needs:
        if earlier[need].state in UNUSABLE:
            return StageState(Condition.BLOCKED, f"{need} is {earlier[need].state}")
    try:
        now = fingerprint(stage)
    except OlivevibError as error:
        return StageState(Condition.BLOCKED, error.what)
    failure = read_failure(folder, stage, now)
    path = folder / stage.file
    if not path.exists():
        return failure or StageState(Condition.MISSING, "not run yet")
    old = next((n for n in stage.needs if earlier[n].state is Condition.STALE), None)
    changed = f"{old} is stale" if old else _difference(path, stage, now)
    if not changed:
        return StageState(Condition.DONE, "up to date")
    return failure or StageState(Condition.STALE, changed)


def _difference(path: Path, stage: Stage, now: Fingerprint) -> str:
    """What changed since the file was written; empty when nothing did."""
    try:
        header = read_header(path)
    except InputError as error:
        return f"{path.name} cannot be read: {error.what}"
    if header.stage != stage.name or header.schema != stage.schema:
        return f"{path.name} was written by another version"
    then = Fingerprint(header.inputs, header.settings)
    for name in sorted(set(now.inputs) | set(then.inputs)):
        if now.inputs.get(name) != then.inputs.get(name):
            return f"{name} changed"
    for name in sorted(set(now.settings) | set(then.settings)):
        if _plain(now.settings.get(name)) != _plain(then.settings.get(name)):
            return f"the setting {name} changed"
    return ""


def _plain(value: Any) -> Any:
    """A value as it looks after a round trip through JSON."""
    return json.loads(json.dumps(value))


def failure_file(folder: Path, stage: Stage) -> Path:
    """Where the reason of a stage's last failure stands."""
    return folder / ".olivevib" / f"{stage.name}.failure.json"


def write_failure(folder: Path, stage: Stage, now: Fingerprint, error: OlivevibError) -> None:
    """Keep why a stage failed, with what it depended on: it counts until one of these changes."""
    path = failure_file(folder, stage)
    path.parent.mkdir(exist_ok=True)
    record = {"on": now.canonical(), "what": error.what, "why": error.why, "remedy": error.remedy}
    write_text_atomic(path, json.dumps(record, indent=1))


def read_failure(folder: Path, stage: Stage, now: Fingerprint) -> StageState | None:
    """The failure of a stage on exactly these inputs and settings, if it failed on them."""
    record = _failure_record(folder, stage)
    if record.get("on") != now.canonical():
        return None
    return StageState(Condition.FAILED, str(record.get("what", "it failed")))


def last_fault(folder: Path, stage: Stage) -> InputError | None:
    """The whole error that a stage failed with last, what, why and remedy; None without one."""
    record = _failure_record(folder, stage)
    if not record:
        return None
    return InputError(*(str(record.get(part, "")) for part in ("what", "why", "remedy")))


def _failure_record(folder: Path, stage: Stage) -> dict[str, Any]:
    try:
        record = json.loads(failure_file(folder, stage).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return record if isinstance(record, dict) else {}
