"""Forms: lines that say where their values come from, keys from line to line, no cut words."""

from __future__ import annotations

from pathlib import Path

import pytest
import tui_scene as scene
from textual.coordinate import Coordinate
from textual.widgets import DataTable, Input, Static
from tui_app import press, screen_text, settle, shown, started

from olivevib.trial import Trial
from olivevib.tui.form_words import taken_words
from olivevib.tui.libraries import FIELDS as LIBRARY_FIELDS
from olivevib.tui.planned import FIELDS
from olivevib.tui.screens.choose import ChooseScreen

SIZES = pytest.mark.parametrize("size", [(120, 40), (80, 24)], ids=["120x40", "80x24"])


@pytest.fixture(scope="session")
def two(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("forms") / "olive"
    scene.measured_trial(folder / "trials/A4")
    scene.new_trial(folder / "trials/B1")
    return folder


@pytest.fixture
def workspace(two, tmp_path, monkeypatch) -> Path:
    folder = scene.at_work(two, tmp_path, monkeypatch)
    Trial.open(folder / "trials/A4").changed({"markers.size_mm": 100.0})  # written last
    return folder


def row_of(app, name: str) -> str:
    """The line of the form on screen, all of its row."""
    y = app.screen.query_one(f"#{name}", Input).region.y
    return screen_text(app).split("\n")[y]


# -- where values come from -----------------------------------------------------------------------


@SIZES
async def test_what_a_new_trial_takes_over_is_said_at_each_line_and_below(workspace, size):
    async with started(workspace, size) as (app, pilot):
        await press(pilot, "n")
        below = str(app.screen.query_one("#taken", Static).render())
        assert below.startswith("Taken from A4, check it: ")
        assert "marker size 100 mm" in below
        assert "marker size 100 mm" in screen_text(app)  # without scrolling to the line
        app.screen.query_one("#size", Input).focus()
        await settle(pilot)
        assert "100" in row_of(app, "size")
        assert "from A4" in row_of(app, "size")
        await press(pilot, "end", *["backspace"] * 3, "text:60")
        assert "from A4" not in row_of(app, "size")
        assert "from A4" in row_of(app, "ids")
        assert "marker size" not in str(app.screen.query_one("#taken", Static).render())


async def test_the_marked_trial_gives_its_calibration_too_and_help_says_so(workspace):
    async with started(workspace) as (app, pilot):
        await press(pilot, "question_mark")
        text = " ".join(screen_text(app).replace("│", " ").split())
        assert "N takes them from the marked trial, and its calibration too" in text
        await press(pilot, "escape", "N")
        below = str(app.screen.query_one("#taken", Static).render())
        assert "or a rig" in below
        await press(pilot, "escape", "n")
        assert "or a rig" not in str(app.screen.query_one("#taken", Static).render())


def test_taken_values_carry_their_units():
    told = taken_words("A4", [("marker size, mm", "100"), ("marker ids", "1-8")])
    assert told == "Taken from A4, check it: marker size 100 mm · marker ids 1-8"
    assert taken_words("A4", []) == ""


# -- keys -----------------------------------------------------------------------------------------


@SIZES
async def test_arrows_go_from_line_to_line_and_the_line_is_in_view(workspace, size):
    async with started(workspace, size) as (app, pilot):
        await press(pilot, "n", "down")
        assert app.focused.id == "left"
        await press(pilot, *["down"] * 6)
        assert app.focused.id == "size"
        form = app.screen.query_one("#form")
        assert form.region.contains_region(app.focused.region)
        await press(pilot, "ctrl+o")
        assert isinstance(app.screen, ChooseScreen)
        assert "marker size, mm" in screen_text(app)
        await press(pilot, "escape", "up", "pagedown")
        assert app.focused.id != "size"
        assert form.region.contains_region(app.focused.region)
        await press(pilot, *["pagedown"] * 6)
        assert app.focused.id == "make"
        await press(pilot, "down", *["pageup"] * 8)
        assert app.focused.id == "trial"


@SIZES
async def test_the_list_goes_to_its_ends_and_tells_that_enter_opens(workspace, size):
    async with started(workspace, size) as (app, pilot):
        table = app.screen.query_one("#trials", DataTable)
        await press(pilot, "end")
        assert table.cursor_row == table.row_count - 1 > 0
        await press(pilot, "home")
        assert table.cursor_row == 0
        footer = screen_text(app).split("\n")[-1]
        for words in ("Open", "New trial", "Search", "Capture", "Run", "Help"):
            assert words in footer


@pytest.mark.parametrize("new", [False, True])
async def test_a_row_drawn_before_its_column_was_widened_is_drawn_again(workspace, new):
    async with started(workspace) as (app, pilot):
        await press(pilot, "enter")
        table = app.screen.query_one("#stages", DataTable)
        long = "x" * 40
        if new:
            table.add_row("", long)
        else:
            table.update_cell_at(Coordinate(0, 1), long, update_width=True)
        for y in range(table.size.height):
            table.render_line(y)  # as the screen may, before the table is idle
        await settle(pilot)
        assert long in screen_text(app)


# -- words that are not cut -----------------------------------------------------------------------


@SIZES
async def test_the_table_of_a_plan_is_not_wrapped_and_its_hints_are_whole(workspace, size):
    async with started(workspace, size) as (app, pilot):
        await press(pilot, "P")
        rows = [line.strip("│ ▁▂▃▄▅▆▇█▊▎") for line in screen_text(app).split("\n")]
        told = str(app.screen.query_one("#outlook-text", Static).render()).split("\n")
        table = [line.strip() for line in told if line[:7].strip().replace(".", "").isdigit()]
        assert len(table) == 17
        seen = [row for row in rows if row in table]
        assert len(seen) == (17 if size[1] == 40 else len(seen)) > 0
        for field in FIELDS:
            line = app.screen.query_one(f"#{field.name}", Input)
            line.value = ""
            line.focus()
            await shown(pilot, field.hint)


@SIZES
async def test_the_form_of_libraries_cuts_no_hint_and_no_button(workspace, size):
    async with started(workspace, size) as (app, pilot):
        await press(pilot, "L")
        for field in LIBRARY_FIELDS:
            line = app.screen.query_one(f"#{field.name}", Input)
            line.value = ""
            line.focus()
            await shown(pilot, field.hint, field.label)
        await press(pilot, "down")
        await shown(pilot, "Write the picture", "Draw a new library")


async def test_the_buttons_for_accelerometers_are_whole(workspace):
    async with started(workspace) as (app, pilot):
        await press(pilot, "n")
        for name, words in (("add_sensor", "+ one more  F2"), ("drop_sensor", "− out  F3")):
            assert app.screen.query_one(f"#{name}").region.width >= len(words)


async def test_a_trial_of_which_nothing_has_run_says_what_to_do(workspace):
    async with started(workspace) as (app, pilot):
        await press(pilot, "down", "enter")
        assert "Nothing has run yet." in screen_text(app)
