"""The page of one trial: self-contained HTML from frozen values."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import jinja2

from olivevib.progress import Tick, silent
from olivevib.report import tables
from olivevib.report.clean import clean
from olivevib.report.content import ReportContent
from olivevib.report.figures import pair_distances
from olivevib.report.lines import MEANING
from olivevib.report.plates import Plate, plates
from olivevib.report.verdict import verdict
from olivevib.signals import State
from olivevib.trial.summary import SETTLED
from olivevib.vibration.types import CRYSTAL


@dataclass(frozen=True)
class Section:
    """One heading of the page; ``name`` is its anchor, ``stage`` what must have run for it."""

    name: str
    title: str
    stage: str = ""


LONG = 1500  # characters of a verdict or a reason
MOST_DROPPED = 20  # dropped calibration views that are named
MOST_PAIRS = 66  # distances listed as a table: 12 markers
_WANTING = {  # of a section whose stage is done
    "frequency": "no marker has a line whose frequency, or whose candidates, are known",
    "spectrogram": "no marker was located long enough",
    "transmissibility": "no marker shares its line with the reference (vibration.reference in"
    " trial.toml, else a marker whose place is the trunk)",
    "decay": "no free decay after the shaking was found that a damped sine explains",
}
SECTIONS = (
    Section("markers", "Markers", "reconstruct"),
    Section("paths", "Cameras, markers and paths", "calibrate"),
    Section("motion", "Displacement", "reconstruct"),
    Section("frequency", "Frequency", "analyse"),
    Section("spectra", "Amplitude spectrum", "analyse"),
    Section("psd", "Power spectral density", "analyse"),
    Section("spectrogram", "Spectrogram", "reconstruct"),
    Section("orbits", "Orbits", "reconstruct"),
    Section("transmissibility", "Transmissibility", "analyse"),
    Section("decay", "Free decay", "analyse"),
    Section("comparison", "Camera against accelerometer", "compare"),
    Section("distances", "Distances between markers", "reconstruct"),
    Section("seen", "When each marker was seen", "track"),
    Section("sigma", "How well each position is known", "reconstruct"),
    Section("calibration", "Rig and calibration", "calibrate"),
    Section("timing", "Timing"),
    Section("record", "Session record"),
    Section("provenance", "Provenance"),
)


@cache
def environment() -> jinja2.Environment:
    """Templates that escape everything and refuse an unknown name; compiled once a process."""
    return jinja2.Environment(
        loader=jinja2.PackageLoader("olivevib.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def render_page(content: ReportContent, tick: Tick = silent) -> str:
    """One trial as an HTML document: inline style and figures, no script, no request anywhere."""
    return render_facts(page_facts(content, tick))


def render_facts(facts: Mapping[str, Any]) -> str:
    """The HTML document of what ``page_facts`` gathered."""
    return environment().get_template("trial.html.j2").render(**facts)


def page_facts(content: ReportContent, tick: Tick = silent) -> dict[str, Any]:
    """Everything that a page prints, as text and figures: the same for HTML and PDF."""
    drawn: dict[str, list[Plate]] = defaultdict(list)
    for plate in plates(content, tick):
        drawn[plate.section].append(plate)
    shown = [s for s in SECTIONS if not s.stage or _has(content, s, bool(drawn.get(s.name)))]
    statuses = {line.status for line in content.lines().values()}
    return {
        "name": clean(content.name),
        "simulated": content.simulated,
        "sections": shown,
        "old": _old(content),
        "missing": [(s.title, _why(content, s)) for s in SECTIONS if s not in shown],
        "plates": drawn,
        "verdict": verdict(content),
        "cautions": [
            (clean(c.code, 60), clean(c.text, LONG), clean(c.remedy, LONG))
            for c in content.cautions
        ],
        "heading": _heading(content),
        "markers": tables.marker_rows(content),
        "clock_ppm": f"{1e6 * CRYSTAL:.0f}",
        "meanings": [(str(s), words) for s, words in MEANING.items() if s in statuses],
        "reasons": _reasons(content),
        "next_time": _advice(content),
        "record": tables.record_sections(content),
        "rig": tables.rig_pairs(content),
        "cameras": tables.camera_columns(content),
        "dropped_views": _dropped(content),
        "calibration_facts": tables.calibration_facts(content),
        "calibration_verdict": _calibration_verdict(content),
        "timing": tables.timing_pairs(content),
        "clocks": tables.camera_clocks(content),
        "phase_rows": tables.phase_rows(content),
        "figure_rows": tables.figure_rows(content),
        "dose_rows": tables.dose_rows(content),
        "orbit_rows": tables.orbit_rows(content),
        "transmissibility_rows": tables.transmissibility_rows(content),
        "decay_rows": tables.decay_rows(content),
        "rotation_rows": tables.rotation_rows(content),
        "deflection_rows": tables.deflection_rows(content),
        "motion_rows": tables.motion_rows(content),
        "outcome": tables.outcome_pairs(content),
        "distances": _distances(content),
        "states": [s.word for s in State],
        "state_rows": tables.state_rows(content),
        "comparisons": _comparisons(content),
        "frame": clean(content.trajectory.frame) if content.trajectory else "",
        "phases": _phases(content),
        "stages": tables.stage_rows(content),
        "command": clean(content.provenance.get("command", "")),
        "provenance": tables.provenance_pairs(content),
    }


def _old(content: ReportContent) -> dict[str, str]:
    """Of each stage whose result is not that of the trial as it is now: why."""
    stages = content.summary.get("stages") or {}
    return {name: clean(s["old"], LONG) for name, s in stages.items() if (s or {}).get("old")}


def _comparisons(content: ReportContent) -> list[tuple[Any, ...]]:
    """Of each sensor: verdict, reason, its numbers, its lines, what of them is left out."""
    return [
        (
            str(c.verdict),
            clean(c.reason, LONG),
            tables.comparison_pairs(content, c),
            *tables.comparison_lines(content, c),
        )
        for c in content.comparisons
    ]


def _phases(content: ReportContent) -> list[tuple[str, str]]:
    """Each phase and when it was."""
    return [
        (tables.phase_word(content, p.name), f"{p.start_s:.2f} – {p.end_s:.2f}\u00a0s")
        for p in content.phases
        if p.name != "whole"
    ]


def _calibration_verdict(content: ReportContent) -> str:
    """What the calibration says of itself in words."""
    return clean(content.calibration.verdict, LONG) if content.calibration else ""


def _heading(content: ReportContent) -> list[str]:
    """What identifies the trial: date, place, cultivar, machine, where they were typed."""
    wanted = {"session": ("date", "place", "operator"), "tree": ("id", "cultivar"),
              "machine": ("make", "type")}  # fmt: skip
    out = []
    for section, key in ((s, k) for s, keys in wanted.items() for k in keys):
        value = (content.record.get(section) or {}).get(key)
        if value not in (None, ""):
            out.append(f"tree {clean(value, 60)}" if key == "id" else clean(value, 60))
    return out


def _dropped(content: ReportContent) -> list[str]:
    """Views that the calibration left out, and why; the first twenty."""
    dropped = content.calibration.dropped_views if content.calibration else ()
    more = [f"and {len(dropped) - MOST_DROPPED} more"] if len(dropped) > MOST_DROPPED else []
    return [clean(line, 160) for line in dropped[:MOST_DROPPED]] + more


def _distances(content: ReportContent) -> list[tuple[str, str, str]]:
    """The table of distances, where it is short enough to be read."""
    pairs = pair_distances(content.trajectory) if content.trajectory is not None else []
    return tables.distance_rows(pairs) if len(pairs) <= MOST_PAIRS else []


def _advice(content: ReportContent) -> list[str]:
    """What to do another time, where it would make a frequency surer."""
    settled = all(line.status in SETTLED for line in content.lines().values())
    return [] if settled else [clean(advice, LONG) for advice in content.next_time]


def _reasons(content: ReportContent) -> list[tuple[str, str]]:
    """Why lines have their status: each reason once, with the markers that it holds for.

    Advice for another time is no reason; it stands apart, and only where it would change something.
    """
    found: dict[str, list[str]] = defaultdict(list)
    for marker_id, line in content.lines().items():
        for reason in (r for r in line.reasons if r not in content.next_time):
            found[clean(reason, LONG).rstrip(".")].append(str(marker_id))
    every = len(content.lines())
    word = {1: "Marker"}
    return [
        (
            "All markers"
            if len(ids) == every
            else f"{word.get(len(ids), 'Markers')} {', '.join(ids)}",
            why,
        )
        for why, ids in found.items()
    ]


def _has(content: ReportContent, section: Section, figures: bool) -> bool:
    """Whether a section has anything to show."""
    if section.name == "markers":
        return bool(content.summary.get("markers"))
    if section.name == "comparison":
        return bool(content.comparisons)
    return figures or (section.name == "calibration" and content.rig is not None)


def _why(content: ReportContent, section: Section) -> str:
    """Why a section has nothing to show: the state of the stage that it needs."""
    stage = (content.summary.get("stages") or {}).get(section.stage) or {}
    state, reason = clean(stage.get("state") or ""), clean(stage.get("reason") or "")
    if not state or state == "done":
        if section.name in _WANTING:
            return _WANTING[section.name]
        return f"the stage {section.stage} found nothing to show"
    return f"the stage {section.stage} is {state}" + (f" ({reason})" if reason else "")
