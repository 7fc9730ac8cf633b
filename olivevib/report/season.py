"""Several trials on one page: one table, and box plots by what the session records say."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from olivevib.progress import Tick, silent
from olivevib.report.clean import clean
from olivevib.report.figures.agreement import (
    FEWEST,
    MOST_SIGMA,
    CommonLine,
    agreement,
    counts,
    limits_of_agreement,
)
from olivevib.report.figures.boxes import boxes
from olivevib.report.outliers import outliers
from olivevib.report.page import environment
from olivevib.report.plates import Plate
from olivevib.report.season_trouble import Trouble, problems, trouble, trouble_words
from olivevib.report.tables import frequency_sigma
from olivevib.report.words import NOT_KNOWN, count, known, measure

QUANTITIES = (
    ("displacement_pp_mm", "displacement, peak to peak, mm"),
    ("acceleration_rms_m_s2", "acceleration, rms of all axes, m/s²"),
    ("frequency_hz", "frequency of the dominant line where it is known, Hz"),
    ("transmissibility_percent", "transmissibility from the trunk, %"),
    ("removed_percent", "fruit removed, % (entered by hand)"),
)
OF_A_TRIAL = ("removed_percent",)  # one value a trial, not a marker
SURE = ("direct", "confirmed")
MOST_GROUPS = 30  # rows of one box plot


@dataclass(frozen=True)
class SeasonEntry:
    """What a season needs of one trial: its session record, its summary, places of markers.

    link: address of the trial's own page relative to the season page; empty: none. table: the
    rows of the season's table (``season_table.trial_rows``). sensor_lines: what camera and
    accelerometer both saw.
    """

    name: str
    record: Mapping[str, Any] = field(default_factory=dict)
    summary: Mapping[str, Any] = field(default_factory=dict)
    places: Mapping[int, str] = field(default_factory=dict)
    simulated: bool = False
    link: str = ""
    table: tuple[Mapping[str, Any], ...] = ()
    sensor_lines: tuple[CommonLine, ...] = ()

    def typed(self, section: str, key: str) -> str:
        """A value of the session record as text; "not known" where nobody typed it."""
        value = (self.record.get(section) or {}).get(key)
        return clean(value, 40) if value not in (None, "") else NOT_KNOWN

    @property
    def trouble(self) -> Trouble | None:
        """What of it failed, has not run or is out of date."""
        return trouble(self.name, self.summary.get("stages") or {})

    def markers(self) -> list[Mapping[str, Any]]:
        """The summary of each marker, with what the table knows beyond it."""
        more = {row["marker"]: row for row in self.table if row["headline"]}
        return [_beyond(m, more.get(m["id"])) for m in self.summary.get("markers") or []]


def _beyond(marker: Mapping[str, Any], row: Mapping[str, Any] | None) -> Mapping[str, Any]:
    if row is None:
        return marker
    ratio = row["transmissibility"]
    percent = None if ratio is None else 100 * ratio
    removed = row["removed_percent"]
    return {**marker, "transmissibility_percent": percent, "removed_percent": removed}


Factor = Callable[[SeasonEntry, int], str]
FACTORS: tuple[tuple[str, Factor], ...] = (
    ("marker place", lambda e, i: clean(e.places.get(i, ""), 40) or NOT_KNOWN),
    ("cultivar", lambda e, _: e.typed("tree", "cultivar")),
    ("machine", lambda e, _: e.typed("machine", "make")),
    ("set frequency", lambda e, _: _set_hz(e)),
    ("trial", lambda e, _: clean(e.name, 40)),
)


def _set_hz(entry: SeasonEntry) -> str:
    """The machine's set frequency as a group; equal lengths, so that names sort as numbers."""
    value = (entry.record.get("machine") or {}).get("set_frequency_hz")
    return f"{value:5.1f} Hz" if known(value) else NOT_KNOWN


def render_season(
    entries: Sequence[SeasonEntry], tick: Tick = silent, left_out: Sequence[str] = ()
) -> str:
    """All trials as one HTML document; the table first, then the box plots.

    left_out: names of archived trials, which are told and not shown.
    """
    template = environment().get_template("season.html.j2")
    by_quantity: dict[str, list[Plate]] = defaultdict(list)
    for plate in season_plates(entries, tick):
        by_quantity[plate.section].append(plate)
    markers = sum(len(e.markers()) for e in entries)
    lines = [line for e in entries for line in e.sensor_lines]
    links = {clean(e.name, 60): clean(e.link) for e in entries}
    troubled = [e.trouble for e in entries if e.trouble]
    return template.render(
        name=f"{count(len(entries), 'trial')}, {count(markers, 'marker')}",
        rows=[season_row(e) for e in entries],
        plates=by_quantity,
        agreement=agreement(lines) if lines else "",
        agreement_words=_agreement_words(lines),
        outliers=outliers(row for e in entries for row in e.table),
        links=links,
        troubled=troubled,
        trouble_words=trouble_words(troubled, len(entries)),
        left_out=", ".join(clean(name, 60) for name in left_out),
        left_out_count=count(len(left_out), "archived trial"),
        simulated=sum(e.simulated for e in entries),
        total=len(entries),
    )


def _agreement_words(lines: Sequence[CommonLine]) -> str:
    """What the figure of all trials says: which lines count, the limits, and what the rest does."""
    strong = [line for line in lines if counts(line)]
    trials = len({line.trial for line in strong})
    known_to = f"{100 * MOST_SIGMA:.0f} %"
    words = (
        f"{count(len(strong), 'line')} of {count(trials, 'trial')} count: those whose amplitude"
        f" camera and accelerometer each know to {known_to}."
    )
    if len(strong) < FEWEST:
        words += f" Limits of agreement need {FEWEST} such lines."
    else:
        middle, low, high = (measure(v, "%", digits=2) for v in limits_of_agreement(strong))
        words += f" Camera less sensor: {middle} on average, 95 % of them from {low} to {high}."
    weak = [abs(x.optical_m_s2 - x.sensor_m_s2) for x in lines if x.decided and not counts(x)]
    if weak:
        words += (
            f" {count(len(weak), 'weaker line')} (drawn hollow) count in no limit: there both"
            f" differ by {measure(max(weak), 'm/s2', digits=2)} at most."
        )
    undecided = dict.fromkeys(clean(line.trial, 60) for line in lines if not line.decided)
    if undecided:
        words += f" Nor does a trial whose comparison is undecided: {', '.join(undecided)}."
    return words


def season_row(entry: SeasonEntry) -> tuple[str, ...]:
    """One trial in the table: record, the marker that moves most, calibration, verdict."""
    moving = [m for m in entry.markers() if entry.places.get(int(m["id"])) != "fixed"]
    best = max(moving, key=_moved, default=None)
    calibration = entry.summary.get("calibration") or {}
    comparison = entry.summary.get("comparison") or {}
    line, moved, shaken = NOT_KNOWN, NOT_KNOWN, NOT_KNOWN
    if best is not None:
        status = clean(best.get("frequency_status") or NOT_KNOWN, 20)
        hz = measure(best.get("frequency_hz"), "Hz", frequency_sigma(best))
        line = f"{hz} ({status})" if status in SURE else status
        moved = f"{measure(best.get('displacement_pp_mm'), 'mm', digits=3)} (marker {best['id']})"
        shaken = measure(best.get("acceleration_rms_m_s2"), "m/s2", digits=3)
    return (
        clean(entry.name, 60) + (" (simulated)" if entry.simulated else ""),
        clean(entry.link),
        entry.typed("session", "date"),
        entry.typed("session", "place"),
        entry.typed("tree", "cultivar"),
        entry.typed("machine", "make"),
        line,
        moved,
        shaken,
        measure(calibration.get("holdout_rms_percent"), "%", digits=2),
        clean(comparison.get("verdict") or "not compared", 30),
        problems(entry.trouble, len(entry.summary.get("warnings") or [])),
    )


def _moved(marker: Mapping[str, Any]) -> float:
    value = marker.get("amplitude_largest_mm")
    return float(value) if value is not None and known(value) else -1.0


def season_plates(entries: Sequence[SeasonEntry], tick: Tick = silent) -> list[Plate]:
    """A box plot for each quantity and factor that splits the markers into two groups or more."""
    jobs = [(q, f) for q in QUANTITIES for f in FACTORS
            if not (q[0] in OF_A_TRIAL and f[0] in ("marker place", "trial"))]  # fmt: skip
    out = []
    for done, ((key, quantity), (factor, of)) in enumerate(jobs):
        tick(done, len(jobs), f"drawing: {quantity} by {factor}")
        groups = _groups(entries, key, of)
        if 1 < len(groups) <= MOST_GROUPS:
            svg = boxes(f"{key}-{factor.replace(' ', '')}", quantity, groups)
            each = "a trial" if key in OF_A_TRIAL else "a marker and trial"
            out.append(Plate(quantity, svg, f"By {factor}: one dot {each}."))
    tick(len(jobs), len(jobs), "figures drawn")
    return out


def _groups(entries: Sequence[SeasonEntry], key: str, of: Factor) -> dict[str, list[float]]:
    """Known values of one quantity by group; groups in order of their name."""
    found: dict[str, list[float]] = defaultdict(list)
    for entry in entries:
        markers = entry.markers()
        for marker in markers[:1] if key in OF_A_TRIAL else markers:
            value = marker.get(key)
            sure = key != "frequency_hz" or marker.get("frequency_status") in SURE
            if sure and value is not None and known(value):
                found[of(entry, int(marker["id"]))].append(float(value))
    return dict(sorted(found.items()))
