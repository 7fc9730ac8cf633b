"""From a trial folder to the frozen values that its report is made of."""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import olivevib
from olivevib.comparison import Verdict
from olivevib.errors import Caution
from olivevib.files.store import read_header
from olivevib.report.content import ReportContent
from olivevib.report.figures.agreement import CommonLine
from olivevib.report.season import SeasonEntry
from olivevib.report.season_table import trial_rows
from olivevib.trial.stages import STAGES
from olivevib.trial.summary import summary
from olivevib.vibration.verdict import sway_below

if TYPE_CHECKING:
    from olivevib.trial import Trial

KNOWN_WELL = 5.0  # sigmas of a line that counts in the agreement over all trials
_FILES = ("video", "stamps", "file", "library")
_RECORD = ("session", "tree", "machine", "outcome", "markers", "cameras", "accelerometers")


def content_of(trial: Trial) -> ReportContent:
    """Everything that the report of ``trial`` shows; None and () where a stage has not run."""
    settings, tracks = trial.settings, trial.tracks
    fit = trial.reconstruction.motion if trial.reconstruction else None
    facts = within(trial.folder, summary(trial))
    return ReportContent(
        name=trial.name,
        record=_record(trial),
        summary=facts,
        places=places_of(trial),
        simulated=settings.session.simulated,
        rig=trial.rig,
        calibration=trial.calibration,
        tracks=(*tracks.left, *tracks.right) if tracks else (),
        recordings=_recordings(trial),
        trajectory=trial.trajectory,
        vibration=trial.vibration,
        comparisons=trial.comparison,
        cautions=tuple(Caution(w["code"], w["text"], w["remedy"]) for w in facts["warnings"]),
        sway_hz=sway_below(settings.vibration.band_hz),
        next_time=() if fit is None else fit.next_time,
        provenance=provenance(trial),
    )


def entry_of(trial: Trial, link: str = "") -> SeasonEntry:
    """What a season page needs of one trial."""
    return SeasonEntry(
        name=trial.name,
        record=_record(trial),
        summary=within(trial.folder, summary(trial)),
        places={m.id: m.place for m in trial.settings.markers.marker if m.place},
        simulated=trial.settings.session.simulated,
        link=link,
        table=tuple(trial_rows(trial)),
        sensor_lines=tuple(
            CommonLine(
                trial.name, x.f_hz, x.optical_m_s2, x.optical_sigma_m_s2, x.sensor_m_s2,
                x.sensor_sigma_m_s2, c.verdict in (Verdict.AGREES, Verdict.DIFFERS),
            )
            for c in trial.comparison
            for x in c.lines
            if x.optical_m_s2 > KNOWN_WELL * x.optical_sigma_m_s2
            and x.sensor_m_s2 > KNOWN_WELL * x.sensor_sigma_m_s2
        ),
    )  # fmt: skip


def _recordings(trial: Trial) -> dict[str, dict[str, Any]]:
    if trial.tracks is None:
        return {}
    return {
        side: asdict(record) | {"video": file_name(record.video)}
        for side, record in trial.tracks.cameras.items()
    }


def places_of(trial: Trial) -> dict[int, str]:
    """Where each described marker sits: its place, and the branch's diameter where it is known."""
    out = {}
    for marker in trial.settings.markers.marker:
        words: list[str] = [marker.place or ""]
        if marker.branch_diameter_mm is not None:
            words.append(f"{marker.branch_diameter_mm:g} mm thick")
        out[marker.id] = ", ".join(w for w in words if w)
    return {i: place for i, place in out.items() if place}


def within(folder: Path, value: Any) -> Any:
    """Plain values whose texts name files of the trial relative to it: a page travels."""
    if isinstance(value, str):
        for place in (folder, folder.resolve()):
            if place.name:
                value = value.replace(f"{place}{os.sep}", "")
        return value
    if isinstance(value, dict):
        return {k: within(folder, v) for k, v in value.items()}
    if isinstance(value, list):
        return [within(folder, v) for v in value]
    return value


def _record(trial: Trial) -> dict[str, Any]:
    """The session record as plain values: dates as text, of files only the name."""
    plain: dict[str, Any] = trial.settings.model_dump(mode="json", include=set(_RECORD))
    plain["session"].pop("simulated", None)  # the page says so in its head
    return {name: _names_only(section) for name, section in plain.items()}


def _names_only(value: Any, key: str = "") -> Any:
    if isinstance(value, dict):
        return {k: _names_only(v, k) for k, v in value.items()}
    if isinstance(value, list):
        return [_names_only(v, key) for v in value]
    return file_name(value) if key in _FILES and isinstance(value, str) else value


def file_name(path: str) -> str:
    """The last part of a path written on any system."""
    return path.replace("\\", "/").rsplit("/", 1)[-1]


def provenance(trial: Trial) -> dict[str, str]:
    """The command, versions, the settings' hash, and what each stage was computed from."""
    text = json.dumps(trial.settings.model_dump(mode="json"), sort_keys=True)
    out = {
        "command": f"olivevib report {trial.name}",
        "olivevib": olivevib.__version__,
        "settings, SHA-256": hashlib.sha256(text.encode()).hexdigest(),
    }
    for stage in STAGES:
        path = trial.folder / stage.file
        if not path.exists() or stage.file in dict(trial.damage):
            continue
        header = read_header(path)
        out[f"{stage.file} written by olivevib"] = header.software_version
        out |= {f"{stage.file} from {name}, SHA-256": sha for name, sha in header.inputs.items()}
    return out
