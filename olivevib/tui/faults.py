"""Why the stages of a trial did not work: the whole errors, read from what the failures left."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from olivevib.errors import InputError, OlivevibError

if TYPE_CHECKING:
    from olivevib.trial import Trial
    from olivevib.trial.quality import StageLine

BY_ANOTHER = re.compile(r"\w+ is (?:stale|failed|blocked|missing|skipped)")  # not by itself


class Fault(NamedTuple):
    """What keeps a stage from its result: its name, its state, and the error whole."""

    stage: str
    state: str
    error: OlivevibError


def faults_of(trial: Trial, stages: Iterable[StageLine]) -> tuple[Fault, ...]:
    """The errors of the stages that failed, or whose inputs cannot be read; each error once."""
    from olivevib.tui.loader import guarded

    found: dict[str, Fault] = {}
    for stage in stages:
        error: object = None
        if stage.state == "failed":
            error = _kept(trial, stage)
        elif stage.state == "blocked" and not BY_ANOTHER.fullmatch(stage.reason):
            error = guarded(partial(trial.fingerprint, stage.name))
        if isinstance(error, OlivevibError):
            found.setdefault(error.what, Fault(stage.name, stage.state, error))
    return tuple(found.values())


def _kept(trial: Trial, stage: StageLine) -> OlivevibError:
    from olivevib.trial.stages import BY_NAME, last_fault

    return last_fault(trial.folder, BY_NAME[stage.name]) or InputError(stage.reason, "", "")
