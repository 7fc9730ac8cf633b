"""One hash of everything that was measured in a trial: equal results, equal hash.

It covers values, names, units and attributes of the stage files that are up to date, and rig.toml;
not how HDF5 packs them, not versions or dates, and not where the trial lies.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator
from pathlib import Path

from olivevib.errors import Caution
from olivevib.files.store import StageFile, Variable, read_stage
from olivevib.trial import STAGES, Condition, Trial
from olivevib.trial.fingerprints import RIG
from olivevib.trial.records.cautions import cautions_from


def read_contents(trial: Trial) -> tuple[str, tuple[Caution, ...]]:
    """SHA-256 of the trial's results (64 hex digits) and its warnings, in order, each once.

    Raises InputError where a stage file is damaged.
    """
    digest = hashlib.sha256()
    cautions: dict[Caution, None] = {}
    states = trial.states()
    for stage in STAGES:
        if states[stage.name].state is Condition.DONE:
            file = read_stage(trial.folder / stage.file, stage.name)
            cautions |= dict.fromkeys(cautions_from(file.attributes.get("cautions")))
            for part in _parts(file, trial.folder):
                digest.update(len(part).to_bytes(8, "big") + part)
    rig = trial.folder / RIG
    if rig.exists():
        digest.update(rig.read_bytes())
    return digest.hexdigest(), tuple(cautions)


def _parts(file: StageFile, folder: Path) -> Iterator[bytes]:
    yield f"{file.stage} {file.schema}".encode()
    for name in sorted(file.variables):
        yield from _variable(name, file.variables[name])
    for name in sorted(file.attributes):
        value = file.attributes[name]
        text = _without(folder, value) if isinstance(value, str) else value
        yield json.dumps([name, text]).encode()


def _variable(name: str, variable: Variable) -> Iterator[bytes]:
    values = variable.values
    about = [name, variable.dims, variable.units, variable.long_name, variable.flag_words]
    yield json.dumps([*about, values.dtype.kind, values.shape]).encode()
    if values.dtype.kind == "U":
        yield json.dumps(values.ravel().tolist()).encode()
    else:
        yield values.astype(values.dtype.newbyteorder("<")).tobytes()


def _without(folder: Path, text: str) -> str:
    """The text without the place of the trial, plain or as JSON writes it."""
    place = f"{folder}{os.sep}"
    for written in (place, json.dumps(place)[1:-1], json.dumps(place, ensure_ascii=False)[1:-1]):
        text = text.replace(written, "")
    return text
