"""The season page: one row a trial, box plots by what the session records say."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import report_scene as scene
from test_report_page import HOSTILE, Reader

from olivevib.errors import UsageError
from olivevib.report import write_season_report
from olivevib.report.figures.agreement import CommonLine, agreement, counts
from olivevib.report.season import SeasonEntry, render_season, season_plates, season_row
from olivevib.report.season_trouble import trouble
from olivevib.trial import Trial
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
    assert rows[3][6] == "ambiguous"  # the marker with the largest line, not that without one
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


def visible(page: str) -> str:
    return re.sub(r"\s+", " ", Reader(page).visible.replace("\u00a0", " "))


def three_trials_with_a_harmonic() -> list[CommonLine]:
    """Main lines that agree to 0.02 %, and a second harmonic near the noise that does not."""
    lines = []
    for k in range(3):
        lines.append(CommonLine(f"T{k}", 11.3, 21.5188 + 1e-3 * k, 0.0019, 21.5221, 0.0025))
        lines.append(CommonLine(f"T{k}", 22.6, 0.1256, 0.0120, 0.0315, 0.0025))
    return lines


def test_a_harmonic_near_the_noise_does_not_set_the_limits_of_agreement():
    lines = three_trials_with_a_harmonic()
    page = visible(render_season([SeasonEntry("T", sensor_lines=tuple(lines))]))
    assert "3 lines of 3 trials count: those whose amplitude" in page
    assert "each know to 5 %" in page
    each = [200 * (x.optical_m_s2 - x.sensor_m_s2) / (x.optical_m_s2 + x.sensor_m_s2)
            for x in lines if x.f_hz < 12]  # fmt: skip
    assert abs(np.mean(each)) < 0.02
    middle = re.search("Camera less sensor: −?([0-9.]+) % on average", page)
    assert middle and float(middle[1]) == pytest.approx(abs(np.mean(each)), rel=0.05)
    limits = re.search("95 % of them from −?([0-9.]+) % to −?([0-9.]+) %", page)
    assert limits and max(float(v) for v in limits.groups()) < 0.05
    assert "3 weaker lines (drawn hollow) count in no limit" in page
    assert "differ by 0.094 m/s² at most" in page


def test_an_undecided_comparison_counts_in_no_limit_and_is_named():
    undecided = CommonLine("CUT", 11.07, 10.69, 0.2, 13.2, 0.4, decided=False)
    assert not counts(undecided)
    assert counts(replace(undecided, decided=True))
    lines = [*three_trials_with_a_harmonic(), undecided]
    page = visible(render_season([SeasonEntry("T", sensor_lines=tuple(lines))]))
    assert "3 lines of 3 trials count" in page
    assert "Nor does a trial whose comparison is undecided: CUT." in page


def test_only_weak_lines_give_no_limits_but_a_figure():
    lines = [line for line in three_trials_with_a_harmonic() if line.f_hz > 12]
    page = visible(render_season([SeasonEntry("T", sensor_lines=tuple(lines))]))
    assert "0 lines of 0 trials count" in page
    assert "Limits of agreement need 3 such lines." in page
    assert "<svg" in agreement(lines)


def stages(**states: str) -> dict[str, dict[str, str]]:
    return {name: {"state": state, "reason": f"why {name}"} for name, state in states.items()}


def test_a_failure_comes_before_what_it_blocks_and_before_what_is_stale():
    assert trouble("T", stages(calibrate="done", track="done", compare="skipped")) is None
    found = trouble("T", stages(calibrate="stale", reconstruct="failed", analyse="blocked"))
    assert found is not None
    assert (found.what, found.why) == ("reconstruct failed", "why reconstruct")


def test_a_failed_trial_is_named_and_its_failure_counted(entries):
    failed = SeasonEntry("SWAP", summary={"stages": stages(track="done", reconstruct="failed")})
    assert season_row(failed)[-1].replace("\u00a0", " ") == "reconstruct failed; 0 warnings"
    page = visible(render_season([*entries, failed]))
    assert "SWAP: reconstruct failed" in page
    assert "1 of 5 trials not up to date" in page
    assert "why reconstruct" in page
    assert "Mind this first" not in visible(render_season(entries))


def make(folder: Path, archived: bool) -> Trial:
    folder.mkdir()
    text = "[session]\narchived = true\n" if archived else ""
    (folder / "trial.toml").write_text(text, encoding="utf-8")
    return Trial.open(folder)


def test_archived_trials_are_left_out_of_page_and_table_unless_asked_for(tmp_path):
    trials = [(make(tmp_path / name, name == "A1"), None) for name in ("A1", "B2")]
    season = tmp_path / "season.html"
    write_season_report(trials, season)
    page = visible(season.read_text(encoding="utf-8"))
    assert "1 trial, 0 markers" in page
    assert "1 archived trial left out: A1" in page
    write_season_report(trials, season, archived=True)
    page = visible(season.read_text(encoding="utf-8"))
    assert "2 trials, 0 markers" in page
    assert "left out" not in page
    with pytest.raises(UsageError, match="archived"):
        write_season_report(trials[:1], season)
