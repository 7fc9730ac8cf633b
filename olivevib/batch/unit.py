"""The work unit of a batch: one trial through every stage, with its report and result hash."""

from __future__ import annotations

import hashlib
import json
import time
from dataclasses import replace
from pathlib import Path

import cv2

from olivevib import __version__, pipeline
from olivevib.batch.contents import read_contents
from olivevib.batch.result import TrialResult
from olivevib.errors import InputError, OlivevibError
from olivevib.files.atomic import write_text_atomic
from olivevib.files.hashing import sha256_file
from olivevib.files.trial_folders import FILE
from olivevib.progress import Cancelled, Tick, silent
from olivevib.trial import STAGES, Trial
from olivevib.trial.fingerprints import RIG

PAGE = "report.html"
NOTE = "batch.json"  # derived, in .olivevib/
SCHEME = 1  # of the result hash


def use_one_core() -> None:
    """Tell this process to use one core, so that as many as there are cores scale."""
    cv2.setNumThreads(1)


def measure(folder: Path, tick: Tick = silent) -> TrialResult:
    """Run what is missing or stale, write the report, hash the results.

    Whatever goes wrong is in the result: one trial never stops the others. Only what the tick
    raises (Cancelled) comes through; finished stages are kept then.
    """
    started = time.monotonic()
    try:
        result = _measure(Trial.open(folder), tick)
        return replace(result, seconds=time.monotonic() - started)
    except Cancelled:
        raise
    except OlivevibError as error:
        return TrialResult.failure(str(folder), error)
    except MemoryError:
        return TrialResult.failure(str(folder), _out_of_memory(folder))
    except Exception as error:  # told to a person at the end of the batch
        return TrialResult.failure(str(folder), _unforeseen(folder, error))


def _measure(trial: Trial, tick: Tick) -> TrialResult:
    ran = [o.stage for o in pipeline.run(trial, tick) if o.words == "done"]
    trial = trial.reopen()
    made_of = _made_of(trial.folder)
    known = _known(trial, made_of)
    if known is None:
        known = _conclude(trial, made_of, tick)
        ran.append("report")
    return replace(known, folder=str(trial.folder), ran=tuple(ran))


def _conclude(trial: Trial, made_of: str, tick: Tick) -> TrialResult:
    """Write the report, hash the results, and note both for the next batch."""
    for _ in pipeline.report([trial], None, tick):
        pass
    sha256, cautions = read_contents(trial)
    result = TrialResult(str(trial.folder), sha256, (), cautions)
    page = sha256_file(trial.folder / PAGE)
    trial.private.mkdir(exist_ok=True)
    note = {"of": made_of, "page": page, "result": result.to_json()}
    write_text_atomic(trial.private / NOTE, json.dumps(note))
    return result


def _known(trial: Trial, made_of: str) -> TrialResult | None:
    """What the last batch noted, if results and report are still exactly those."""
    try:
        note = json.loads((trial.private / NOTE).read_text(encoding="utf-8"))
        if note["of"] == made_of and note["page"] == sha256_file(trial.folder / PAGE):
            return TrialResult.from_json(note["result"])
    except (OSError, ValueError, TypeError, KeyError, InputError):
        return None  # no note, no report, or a damaged note: made anew
    return None


def _made_of(folder: Path) -> str:
    """SHA-256 of all that report and hash are made of: what was typed and measured, the version."""
    names = [FILE, RIG, *(stage.file for stage in STAGES)]
    there = {n: sha256_file(folder / n) for n in names if (folder / n).exists()}
    facts = json.dumps([SCHEME, folder.name, __version__, there])
    return hashlib.sha256(facts.encode()).hexdigest()


def _out_of_memory(folder: Path) -> InputError:
    return InputError(
        f"{folder.name} needs more memory than there is.",
        "The system refused to give any more.",
        "End other programs or use --workers 1, and run the same command again.",
    )


def _unforeseen(folder: Path, error: Exception) -> OlivevibError:
    return OlivevibError(
        f"{folder.name} met an unforeseen error: {type(error).__name__}: {error}",
        "This is a fault of the program, not yours; nothing that was measured is lost.",
        f"Run: olivevib run {folder} --debug   and send what it prints to the authors.",
    )
