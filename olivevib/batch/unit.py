"""The work unit of a batch: one trial through every stage, with its report and result hash."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import cv2

from olivevib import __version__, pipeline
from olivevib.batch.content_hash import result_hash
from olivevib.batch.result import TrialResult
from olivevib.errors import InputError, OlivevibError
from olivevib.files.atomic import write_text_atomic
from olivevib.files.hashing import sha256_file
from olivevib.progress import Cancelled, Tick, silent
from olivevib.trial import STAGES, Trial
from olivevib.trial.document import FILE
from olivevib.trial.fingerprints import RIG

PAGE = "report.html"


def use_one_core() -> None:
    """Tell this process to use one core, so that as many as there are cores scale."""
    cv2.setNumThreads(1)


def measure(folder: Path, tick: Tick = silent) -> TrialResult:
    """Run what is missing or stale, write the report, hash the results.

    Whatever goes wrong is in the result: one trial never stops the others. Only what the tick
    raises (Cancelled) comes through; finished stages are kept then.
    """
    try:
        return _measure(Trial.open(folder), tick)
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
    if _report(trial, tick):
        ran.append("report")
    return TrialResult(str(trial.folder), result_hash(trial), tuple(ran), trial.cautions)


def _report(trial: Trial, tick: Tick) -> bool:
    """Write report.html unless it is there and was made of exactly these results."""
    page, note = trial.folder / PAGE, trial.private / "report.json"
    made_of = _made_of(trial.folder)
    if page.exists() and _read(note) == {"of": made_of, "page": sha256_file(page)}:
        return False
    for _ in pipeline.report([trial], None, tick):
        pass
    trial.private.mkdir(exist_ok=True)
    write_text_atomic(note, json.dumps({"of": made_of, "page": sha256_file(page)}))
    return True


def _made_of(folder: Path) -> str:
    """SHA-256 of all that a report shows: what was typed, what was measured, the version."""
    names = [FILE, RIG, *(stage.file for stage in STAGES)]
    there = {n: sha256_file(folder / n) for n in names if (folder / n).exists()}
    facts = json.dumps([folder.name, __version__, there])
    return hashlib.sha256(facts.encode()).hexdigest()


def _read(note: Path) -> object:
    try:
        return json.loads(note.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


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
