"""What the app does beside drawing: harmless text, the tick, the form, settings, what is kept."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.cells import cell_len
from small_videos import make_video

from olivevib.errors import InputError, UsageError
from olivevib.pipeline import SensorPlan
from olivevib.progress import Cancelled
from olivevib.trial.quality import StageLine
from olivevib.tui.app import OlivevibApp
from olivevib.tui.harmless import REPLACEMENT, harmless, plain
from olivevib.tui.kept import Kept, place_of, read_kept, write_kept
from olivevib.tui.loader import TrialRow
from olivevib.tui.look import look_at
from olivevib.tui.plan import form_fields, guesses, plan_of, trial_name
from olivevib.tui.themes import palette_of
from olivevib.tui.views.faults import error_text
from olivevib.tui.views.palette import Palette
from olivevib.tui.views.progress import Progress
from olivevib.tui.views.setting_rows import SettingRow, change_of, setting_rows, typed
from olivevib.tui.views.trial_list import columns_of, empty_text, matching, trial_cells, why_text
from olivevib.tui.work import PostedTick, Result, Work, perform

EVIL = [
    "\x1b[2J\x1b]0;title\x07",
    "[red]markup[/red] [link=x]",
    "right\u202eto left\u2066",
    "zero\u200bwidth\ufeff",
    "two\nlines\r\tand tabs",
    "Z" + "\u0300" * 500 + "algo",
    "橄榄" * 3000,
    "\udce4 surrogate",
    "x" * 10_000,
]


@pytest.mark.parametrize("text", EVIL)
def test_evil_text_becomes_one_short_printable_line(text):
    shown = harmless(text, 40)
    assert cell_len(shown) <= 40
    assert not any(ord(c) < 32 or 127 <= ord(c) < 160 for c in shown)
    assert not set(shown) & set("\u202e\u2066\u200b\ufeff\x1b\n\udce4")
    assert plain(text, 40).plain == shown


def test_what_was_taken_out_leaves_a_trace_and_markup_stays_text():
    assert harmless("a\x1b[31mb") == f"a{REPLACEMENT}[31mb"
    assert harmless("[b]bold[/b]") == "[b]bold[/b]"
    assert harmless("x" * 300, 10) == "x" * 9 + "…"


@given(st.text(max_size=300), st.integers(1, 60))
@settings(deadline=None, max_examples=150)
def test_any_text_is_harmless(text, cells):
    shown = harmless(text, cells)
    assert cell_len(shown) <= cells
    assert "\n" not in shown
    assert "\x1b" not in shown


# -- work -----------------------------------------------------------------------------------------


class Clock:
    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def test_the_tick_posts_at_most_twenty_times_a_second():
    posted: list[Progress] = []
    clock = Clock()
    tick = PostedTick("run", posted.append, threading.Event(), clock)
    for k in range(1000):
        clock.now = k / 1000
        tick(k, 1000, "tracking")
    assert 19 <= len(posted) <= 21


def test_rate_and_time_left_count_from_where_the_work_resumed():
    posted: list[Progress] = []
    clock = Clock()
    tick = PostedTick("run", posted.append, threading.Event(), clock)
    for k in range(600, 701):
        clock.now = (k - 600) / 25
        tick(k, 1000, f"frame {k}")
    last = posted[-1]
    assert last.rate == pytest.approx(25.0, rel=0.01)
    assert last.left_s == pytest.approx((1000 - last.done) / 25, rel=0.01)
    clock.now += 1
    tick(0, 40, "marker 1")
    assert posted[-1].rate is None


def test_a_cancelled_tick_stops_the_work():
    cancel = threading.Event()
    tick = PostedTick("run", lambda p: None, cancel)
    done = []

    def do(tick):
        for k in range(10):
            tick(k, 10, "")
            done.append(k)
            if k == 3:
                cancel.set()
        return Result("all")

    ended = perform(Work("x", do), tick)
    assert ended.cancelled
    assert done == [0, 1, 2, 3]
    with pytest.raises(Cancelled):
        tick(0, None, "")


def test_however_work_ends_it_is_told():
    def fails(tick):
        raise InputError("no video", "it is dark", "add light")

    def breaks(tick):
        raise ZeroDivisionError("1/0")

    def ignore(done, total, note):
        """A tick that nobody looks at."""

    assert perform(Work("x", lambda tick: Result("ok")), ignore).result == Result("ok")
    assert perform(Work("x", fails), ignore).error.remedy == "add light"
    told = perform(Work("x", breaks), ignore).error
    assert "ZeroDivisionError" in told.what
    assert "--debug" in told.remedy


def test_an_error_is_shown_with_cause_and_remedy_and_without_escapes():
    text = error_text(InputError("bad \x1b[31m name", "two\nfaults", "[b]do[/b] this")).plain
    assert text == f"bad {REPLACEMENT}[31m name\n\ntwo\nfaults\n\nNext: [b]do[/b] this"


# -- what is kept ---------------------------------------------------------------------------------


def test_what_was_kept_comes_back(tmp_path):
    (tmp_path / "trials").mkdir()
    kept = Kept(theme="sunlight", trial="T04", screen="results", marker=9)
    assert write_kept(tmp_path, kept)
    assert read_kept(tmp_path) == kept


def test_nothing_is_written_outside_a_workspace(tmp_path):
    assert not write_kept(tmp_path, Kept(trial="T04"))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{", '{"theme": 3, "marker": "x", "foreign": 1}', "x" * 30_000, '{"marker": true}'],
)
def test_a_damaged_file_gives_the_defaults(tmp_path, text):
    place_of(tmp_path).parent.mkdir()
    place_of(tmp_path).write_text(text, encoding="utf-8")
    assert read_kept(tmp_path) == Kept()


# -- the trial list -------------------------------------------------------------------------------


def row(name: str, word: str = "clean", about: str = "Bari") -> TrialRow:
    stages = (StageLine("track", "stale", "the setting detection.fill changed"),)
    return TrialRow(Path(name), name, stages, word, "why", about)


def test_search_takes_every_word_anywhere():
    rows = [row("T04"), row("T05", "warnings"), row("T06", about="Lecce")]
    assert [r.name for r in matching(rows, "t0 bari")] == ["T04", "T05"]
    assert [r.name for r in matching(rows, "WARN")] == ["T05"]
    assert len(matching(rows, "  ")) == 3


def test_small_terminals_get_glyphs_and_large_ones_words():
    names = ("calibrate", "track", "reconstruct", "analyse", "compare")
    assert columns_of(80, names) == ("trial", "quality", "cal", "trk", "rec", "ana", "cmp")
    assert columns_of(120, names)[-1] == "about"
    assert [c.plain for c in trial_cells(row("T04"), 80, Palette())] == ["T04", "clean", "◐"]
    assert "◐ stale" in [c.plain for c in trial_cells(row("T04"), 120, Palette())]


def test_the_marked_trial_says_what_is_wrong_with_it():
    told = why_text(row("T04", "stale"), Palette()).plain
    assert "track stale: the setting detection.fill changed" in told


def test_an_empty_place_says_what_to_do_first():
    told = empty_text("/home/ana", is_workspace=False, palette=Palette()).plain
    assert "is no workspace yet" in told
    assert "n  make a trial from two recordings" in told


# -- the form of a new trial ----------------------------------------------------------------------


def test_the_form_becomes_a_plan():
    plan = plan_of(
        {
            "left": "a.mkv", "right": "b.mkv", "size": "60", "ids": "1,2,5-7", "band": "5-45",
            "row_time": "27.8,-27.8", "shutter": "rolling",
            "accelerometer": "a.csv", "accelerometer_marker": "3",
            "accelerometer2": "b.csv", "accelerometer2_axes": "x,-z,y",
            "accelerometer2_lever": "0,25,-8",
            "link": "yes", "board": "coded:5x5,pitch=60,size=44",
        }
    )  # fmt: skip
    assert (plan.left, plan.right, plan.size_mm) == ("a.mkv", "b.mkv", 60.0)
    assert plan.ids == (1, 2, 5, 6, 7)
    assert plan.band_hz == (5.0, 45.0)
    assert plan.row_time_us == (27.8, -27.8)
    second = SensorPlan("b.csv", None, ("x", "-z", "y"), (0.0, 25.0, -8.0))
    assert plan.every_sensor == (SensorPlan("a.csv", 3), second)
    assert plan.link
    assert plan.markers == "olive49"
    assert plan.rig is None


@pytest.mark.parametrize(
    ("field", "text", "words"),
    [
        ("left", "", "“left recording”: the left recording is not named"),
        ("left", "gone.avi", "“left recording”: gone.avi is missing"),
        ("size", "wide", "“marker size, mm”: 'wide' cannot be read"),
        ("size", "60,900:5", "“marker size, mm”: library olive49 has no marker 900"),
        ("size", "-1", "“marker size, mm” -1.0 is no size"),
        ("shutter", "fast", "“shutter”: 'fast' is not known"),
        ("ids", "1,x", "“marker ids”: '1,x' cannot be read"),
        ("band", "45-5", "“band, Hz”: '45-5' cannot be read"),
        ("row_time", "a", "“row time, µs”: 'a' cannot be read"),
        ("exposure", "0", "“exposure, ms” 0 is no exposure"),
        ("board", "coded:", "“board”"),
        ("markers", "aruco:NONE", "“marker library”"),
        ("calibration_left", "stills", "“right board”: only one side"),
        ("accelerometer_marker", "1.5", "“its marker”: '1.5' cannot be read"),
        ("accelerometer_axes", "x,y", "“its axes”: 'x,y' cannot be read"),
        ("accelerometer_axes", "x,y", "Give them as x,-z,y"),
        ("accelerometer_lever", "25", "“its lever, mm”: '25' cannot be read"),
        ("accelerometer2_marker", "3", "“accelerometer 2”: the file of this accelerometer is not"),
        ("accelerometer2", "gone.csv", "“accelerometer 2”: gone.csv is missing"),
        ("accelerometer_marker", "900", "“its marker”: the accelerometer's marker 900 is none"),
    ],
)
def test_a_fault_names_its_line_in_the_words_of_the_form(field, text, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for side in ("left", "right"):
        make_video(tmp_path / f"{side}.avi", frames=2)
    values = {"trial": "T01", "left": "left.avi", "right": "right.avi", field: text}
    values |= {"accelerometer": "logger.csv"} if field == "accelerometer_marker" else {}
    looked = look_at(values, whole=True)
    assert looked.error is not None
    assert words in str(looked.error)
    assert "--" not in str(looked.error)
    assert "trial.toml" not in str(looked.error)
    elsewhere = {
        "calibration_left": "calibration_right",
        "accelerometer2_marker": "accelerometer2",
    }
    assert looked.field == elsewhere.get(field, field)


@pytest.mark.parametrize("name", ["", "  ", "..", "a/b", "a\\b", "a:b"])
def test_a_trial_needs_a_name_that_can_be_a_folder(name):
    with pytest.raises(UsageError):
        trial_name({"trial": name})


def test_one_side_tells_the_other_and_what_lies_beside(tmp_path):
    for name in ("left.mkv", "right.mkv", "accelerometer.csv"):
        (tmp_path / name).touch()
    (tmp_path / "calibration" / "left").mkdir(parents=True)
    (tmp_path / "calibration" / "right").mkdir()
    found = guesses("left", tmp_path / "left.mkv", {})
    assert found == {
        "right": str(tmp_path / "right.mkv"),
        "calibration_left": str(tmp_path / "calibration" / "left"),
        "calibration_right": str(tmp_path / "calibration" / "right"),
        "accelerometer": str(tmp_path / "accelerometer.csv"),
    }
    assert "right" not in guesses("left", tmp_path / "left.mkv", {"right": "mine.mkv"})
    assert guesses("rig", tmp_path / "left.mkv", {}) == {}
    assert {f.name for f in form_fields(1)} >= set(found)


# -- settings -------------------------------------------------------------------------------------


def test_settings_become_rows_that_can_be_typed_back():
    rows = setting_rows(
        {
            "session": {"notes": "a \"quoted\" note", "date": None},
            "vibration": {"band_hz": [5.0, 45.0]},
            "markers": {"marker": [{"id": 1, "place": "trunk", "size_mm": None}]},
            "detection": {"paper_centre": False, "fill": 0.7},
        }
    )  # fmt: skip
    values = {r.key: r.value for r in rows}
    assert values["session.notes"] == 'a "quoted" note'
    assert values["session.date"] == ""
    assert values["vibration.band_hz"] == "[5.0, 45.0]"
    assert values["markers.marker"] == '[{id = 1, place = "trunk"}]'
    assert values["detection.paper_centre"] == "false"
    for wanted in rows:
        if wanted.value:
            change = change_of(wanted, wanted.value)[wanted.key]
            plain_value = change.unwrap() if hasattr(change, "unwrap") else change
            assert typed(plain_value) == wanted.value


def test_nothing_typed_takes_a_setting_out():
    assert change_of(SettingRow("tree.id", "A-12"), "  ") == {"tree.id": None}


def test_kept_file_is_plain_json(tmp_path):
    (tmp_path / "trials").mkdir()
    write_kept(tmp_path, Kept())
    assert json.loads(place_of(tmp_path).read_text(encoding="utf-8"))["marker"] == -1


def test_the_first_picture_waits_for_nothing_heavy():
    heavy = ("numpy", "scipy", "cv2", "h5py", "pandas", "matplotlib", "pydantic", "av")
    code = f"import sys, olivevib.tui.app; print(*[m for m in {heavy!r} if m in sys.modules])"
    found = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert found == []


def test_every_theme_gives_plot_styles():
    themes = OlivevibApp(Path()).available_themes
    assert {"olive-dark", "sunlight", "ansi-dark"} <= set(themes)
    for theme in themes.values():
        palette = palette_of(theme)
        assert palette.accent.bold
        assert palette.good != palette.bad != palette.warn
