"""The order of the stages, and running those that are missing or stale."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from olivevib.errors import Caution, OlivevibError, UsageError
from olivevib.files.lock import alone_in
from olivevib.pipeline.calibrate import calibrate
from olivevib.pipeline.compare import compare
from olivevib.pipeline.measure import analyse, reconstruct
from olivevib.pipeline.track import track
from olivevib.progress import Tick, silent
from olivevib.trial import STAGES, Condition, Trial
from olivevib.trial.fingerprints import PRIVATE
from olivevib.trial.stages import BY_NAME, Stage, failure_file, write_failure

Verb = Callable[[Trial, Tick], tuple[Caution, ...]]
VERBS: Mapping[str, Verb] = {
    "calibrate": calibrate,
    "track": track,
    "reconstruct": reconstruct,
    "analyse": analyse,
    "compare": compare,
}
TO_DO = (Condition.MISSING, Condition.STALE, Condition.FAILED)


@dataclass(frozen=True)
class Outcome:
    """What became of one stage in a run; ``words`` for a person."""

    stage: str
    words: str
    cautions: tuple[Caution, ...] = ()


def run_stage(trial: Trial, stage: str, tick: Tick = silent) -> tuple[Caution, ...]:
    """Run one stage, whatever its state; a failure is kept beside the trial and raised.

    UsageError where another process is at work on the trial.
    """
    with alone_in(trial.folder, PRIVATE):
        return _run_stage(trial, stage, tick)


def _run_stage(trial: Trial, stage: str, tick: Tick) -> tuple[Caution, ...]:
    now = trial.fingerprint(stage)
    try:
        cautions = VERBS[stage](trial, tick)
    except OlivevibError as error:
        write_failure(trial.folder, BY_NAME[stage], now, error)
        raise
    failure_file(trial.folder, BY_NAME[stage]).unlink(missing_ok=True)
    return cautions


def run(trial: Trial, tick: Tick = silent) -> Iterator[Outcome]:
    """Run every stage that is missing, stale or failed, in order; yields what became of each.

    The first failure ends it (raised); what earlier stages wrote stays. UsageError where another
    process is at work on the trial.
    """
    with alone_in(trial.folder, PRIVATE):
        yield from _stages(trial, tick)


def _explain_block(trial: Trial, stage: Stage) -> None:
    """Raise what a person can do about a stage that cannot run."""
    if "calibrate" in stage.needs and trial.states()["calibrate"].state is Condition.SKIPPED:
        raise UsageError(
            f"trial {trial.name} has no calibration: {stage.name} cannot run.",
            "Neither board recordings nor a rig file are named in trial.toml.",
            "Name them: --set calibration.left=PATH --set calibration.right=PATH "
            "--set calibration.board=SPEC, or --set calibration.rig=FILE.",
        )
    trial.fingerprint(stage)  # names the input that is missing


def _stages(trial: Trial, tick: Tick) -> Iterator[Outcome]:
    for stage in STAGES:
        trial = trial.reopen()
        state = trial.states()[stage.name]
        if state.state in TO_DO:
            yield Outcome(stage.name, "done", _run_stage(trial, stage.name, tick))
        elif state.state is Condition.BLOCKED:
            _explain_block(trial, stage)
            yield Outcome(stage.name, f"blocked: {state.reason}")
        else:
            yield Outcome(stage.name, f"{state.state}: {state.reason}")
