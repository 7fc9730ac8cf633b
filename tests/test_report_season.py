"""The season page: one row a trial, box plots by what the session records say."""

from __future__ import annotations

import re

import pytest
import report_scene as scene
from test_report_page import HOSTILE, Reader

from olivevib.report.season import SeasonEntry, render_season, season_plates, season_row
from olivevib.vibration import LineStatus


def entry(name: str, cultivar: str, status: LineStatus = LineStatus.DIRECT) -> SeasonEntry:
    content = scene.content([1, 3, 17], status)
    record = dict(content.record) | {"tree": {"cultivar": cultivar}}
    return SeasonEntry(name, record, content.summary, content.places, link=f"{name}.html")


@pytest.fixture(scope="module")
def entries() -> list[SeasonEntry]:
    names = [("T1", "Coratina"), ("T2", "Coratina"), ("T3", "Leccino")]
    return [entry(*n) for n in names] + [entry("T4", "", LineStatus.AMBIGUOUS)]


def test_one_row_a_trial_with_status_and_unit(entries):
    rows = [season_row(e) for e in entries]
    assert [r[0] for r in rows] == ["T1", "T2", "T3", "T4"]
    assert rows[0][4] == "Coratina"
    assert rows[3][4] == "not known"
    assert rows[3][6] == "none"  # the marker that moves most in this scene shows no line
    assert rows[0][9].endswith("%")


def test_box_plots_only_where_groups_can_be_compared(entries):
    plates = season_plates(entries)
    assert any("cultivar" in p.caption for p in plates)
    assert not any("machine" in p.caption for p in plates)  # all trials had the same


def test_unknown_frequencies_enter_no_statistic(entries):
    only = [e for e in entries if e.name == "T4"]
    for marker in only[0].markers():
        assert marker["frequency_status"] != "direct"
    assert not [p for p in season_plates(only) if "Hz" in p.section]


def test_page_is_well_formed_self_contained_and_deterministic(entries):
    page = render_season(entries)
    reader = Reader(page)
    assert reader.open == []
    assert 'href="T1.html"' in page
    assert page == render_season(entries)
    assert not re.search(r"\b(nan|None)\b", reader.visible)
    assert not re.search(r"(https?:)?//\w", re.sub(r'xmlns(:\w+)?="[^"]*"', "", page))


def test_hostile_records_are_harmless():
    page = render_season([SeasonEntry(HOSTILE, {"tree": {"cultivar": HOSTILE}})])
    reader = Reader(page)
    assert reader.open == []
    assert not {"script", "img"} & {tag for tag, _ in reader.tags}
    assert "not known" in reader.visible
