"""One word for how far a trial can be used as it is, and the state of its stages in words."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from olivevib.trial.stages import StageState
    from olivevib.trial.trial import Trial


@dataclass(frozen=True)
class StageLine:
    """One stage of a trial: its state and the reason, as words."""

    name: str
    state: str
    reason: str


@dataclass(frozen=True)
class Quality:
    """One word for how far a trial can be used as it is, and why."""

    word: str
    why: str


def stage_lines(
    trial: Trial, states: Mapping[str, StageState] | None = None
) -> tuple[StageLine, ...]:
    """The stages in order; files of the trial are named from its folder on.

    states: those of the trial, where they are known already.
    """
    here = f"{trial.folder.resolve()}{os.sep}"
    near = f"{trial.folder}{os.sep}"
    return tuple(
        StageLine(name, state.state.value, state.reason.replace(here, "").replace(near, ""))
        for name, state in (trial.states() if states is None else states).items()
    )


def quality_of(stages: tuple[StageLine, ...], trial: Trial) -> Quality:
    """The worst thing that can be said of a trial, in one word."""
    for word in ("failed", "stale", "missing", "blocked"):
        bad = next((s for s in stages if s.state == word), None)
        if bad is not None:
            said = {"missing": "unfinished", "blocked": "unfinished"}.get(word, word)
            return Quality(said, f"{bad.name}: {bad.reason}")
    if not trial.vibration:
        return Quality("unfinished", "there is nothing to analyse yet")
    asked = all(s.state != "skipped" for s in stages if s.name == "compare")
    return _quality_of_results(trial, asked)


def _quality_of_results(trial: Trial, asked: bool) -> Quality:
    """asked: whether a comparison is; one that is left over from before counts as a warning."""
    for comparison in trial.comparison if asked else ():
        if comparison.verdict.value == "differs":
            return Quality("differs", comparison.reason)
    codes = [c.code for c in trial.cautions]
    if trial.comparison and not asked:
        codes.insert(0, "results-left")
    if codes:
        return Quality("warnings", f"{len(codes)}: {', '.join(codes)}")
    return Quality("clean", "every stage is done and none of them warned")
