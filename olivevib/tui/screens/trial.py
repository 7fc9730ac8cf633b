"""One trial: its stages with state and reason, run and cancel, warnings with remedies."""

from __future__ import annotations

from functools import partial
from typing import ClassVar

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, VerticalScroll
from textual.coordinate import Coordinate
from textual.widgets import DataTable, Static

from olivevib.tui import jobs, tool_jobs
from olivevib.tui.harmless import cut, harmless, plain
from olivevib.tui.loader import STAGE_NAMES, TrialFacts, result_stamps, trial_facts
from olivevib.tui.screens.edit import EditScreen
from olivevib.tui.screens.page import Command, Help, Jump, Page
from olivevib.tui.views.faults import error_text
from olivevib.tui.widgets.row_table import RowTable
from olivevib.tui.widgets.title import Title

TOLD_ABOVE = "stage-failed"  # the faults stand there whole
BESIDE = 32  # columns of the table of stages beside the reason
LOOK_S = 0.5  # how often the results are looked at while work runs
FOUND_ON = {
    "calibrate": "calibration",
    "track": "pictures",
    "reconstruct": "results",
    "analyse": "results",
    "compare": "compare",
}

PAPER_WORDS = {
    "calibrate": "calibrate",
    "track": "track (INITIALIZE and TRACK of the paper)",
    "reconstruct": "reconstruct (STEREO 3D of the paper)",
    "analyse": "analyse",
    "compare": "compare",
}


class TrialPage(Page):
    """The trial's own screen: from here everything of it is reached."""

    NAME = "trial"
    HELP_TEXT = Help(
        "The five stages of the measurement. Each writes one file; its state is computed from the "
        "files: done, stale (an input or setting changed since), missing, failed, blocked by an "
        "earlier stage, skipped for want of an input. Running never changes a recording, and "
        "cancelling keeps what is finished: the next run goes on from there.",
        "A webcam calibrated well fits to 0.1–0.3 px and measures distances on unused views to "
        "0.5 mm or 0.3 %. Markers should be seen in 95 % of the frames. Each warning says what "
        "to do.",
    )
    JUMPS = (Jump("s", "#stages"), Jump("w", "#warnings"), Jump("f", "#facts"))
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "open", "Show what the stage found, or why it failed", show=False),
        Binding("r", "run", "Run all"),
        Binding("t", "run_one", "Run one"),
        Binding("v", "page('results')", "Results"),
        Binding("e", "page('report')", "Report"),
        Binding("s", "page('settings')", "Settings"),
        Binding("b", "page('calibration')", "Board and calibration", show=False),
        Binding("m", "page('motion')", "Motion over time", show=False),
        Binding("g", "page('spectrogram')", "Spectrogram", show=False),
        Binding("o", "notes", "Notes", show=False),
        Binding("c", "page('compare')", "Compare with accelerometer", show=False),
        Binding("k", "page('pictures')", "Pictures with markers", show=False),
        Binding("x", "check", "Check every file", show=False),
        Binding("A", "preset", "Keep how the accelerometer is read", show=False),
        Binding("W", "row_time", "Row times that the waved board showed", show=False),
    ]

    _stamps: tuple[tuple[str, int], ...] = ()
    _marked = ""  # the stage that is shown as running

    def body(self) -> ComposeResult:
        """Stages above, warnings and facts below."""
        yield RowTable(id="stages")
        with Horizontal(id="below"):
            with VerticalScroll(id="warnings", classes="pane"):
                yield Static("reading …", id="warning-text", classes="waits", markup=False)
            with VerticalScroll(id="facts", classes="pane"):
                yield Static("", id="fact-text", markup=False)

    def on_mount(self) -> None:
        """Name the panes."""
        for name, title in (("stages", "Stages"), ("warnings", "Warnings"), ("facts", "Known")):
            self.query_one(f"#{name}").border_title = title
        table = self.query_one("#stages", DataTable)
        table.add_columns("stage", "state", "reason")
        for name in STAGE_NAMES:
            table.add_row(name, "…", "")
        table.focus()
        self.set_interval(LOOK_S, self._follow_files)
        self.watch(self.app, "progress", self._follow_work, init=False)

    def _follow_files(self) -> None:
        """Read again when a stage of the work that runs has written its result."""
        if self.olive.progress is not None:
            stamps = result_stamps([self.folder])
            if stamps != self._stamps:
                self._stamps = stamps
                self.reload()

    def _follow_work(self) -> None:
        """Mark the stage that is at work."""
        facts = getattr(self, "_facts", None)
        if facts is not None and self._at_work(facts) != self._marked:
            self._show_stages(facts)

    def _at_work(self, facts: TrialFacts) -> str:
        """The stage that is at work on this trial; "" for none."""
        progress, name = self.olive.progress, harmless(self.folder.resolve().name, 40)
        if progress is None or not progress.title.startswith(f"{name}: "):
            return ""
        verb = progress.title.removeprefix(f"{name}: ")
        to_do = (s.name for s in facts.stages if s.state not in ("done", "skipped"))
        return next(to_do, "") if verb == "run" else verb

    def read(self) -> TrialFacts:
        """Summary and settings from the files."""
        return trial_facts(self.folder)

    def show(self, value: object) -> None:
        """States, warnings, facts; where a result is damaged, what to do about it."""
        if not isinstance(value, TrialFacts):
            return
        self._facts = value
        self.query_one(Title).say(value.name, "simulated" if value.simulated else "")
        self._show_stages(value)
        self._show_words(value)

    def _show_words(self, facts: TrialFacts) -> None:
        from olivevib.tui.views.tables import facts_text, warnings_text

        palette, summary = self.olive.palette, facts.summary
        if summary is None:
            warnings, known, count = error_text(facts.fault), Text(""), 1
        else:
            run = any(stage.state in ("done", "stale", "failed") for stage in facts.stages)
            cautions = [w for w in summary["warnings"] if w["code"] != TOLD_ABOVE]
            warnings = warnings_text(cautions, run or bool(facts.faults), palette, facts.faults)
            count = len(cautions)
            known = facts_text(summary, palette)
        self.query_one("#warning-text", Static).update(warnings)
        self.query_one("#fact-text", Static).update(known)
        title = f"Warnings ({count})" if count else "Warnings"
        wrong = any(fault.state == "failed" for fault in facts.faults)
        self.query_one("#warnings").border_title = f"What failed · {title}" if wrong else title

    def _show_stages(self, facts: TrialFacts) -> None:
        from olivevib.tui.views.tables import state_cell

        table = self.query_one("#stages", DataTable)
        self._marked = self._at_work(facts)
        for at, stage in enumerate(facts.stages):
            running = stage.name == self._marked
            reason = "at work" if running else stage.reason
            if stage.name == "track" and facts.resume and stage.state != "done":
                reason = f"{reason}; {facts.resume}"
            state = state_cell("running" if running else stage.state, self.olive.palette)
            table.update_cell_at(Coordinate(at, 1), state, update_width=True)
            table.update_cell_at(Coordinate(at, 2), self._reason_cell(reason), update_width=True)

    def _reason_cell(self, reason: str) -> Text:
        """The reason as far as the table is wide; whole it stands below, and behind Enter."""
        return plain(cut(harmless(reason, 160), max(20, self.size.width - BESIDE)))

    def on_resize(self) -> None:
        """The reasons depend on the width."""
        facts = getattr(self, "_facts", None)
        if facts is not None:
            self._show_stages(facts)

    def recolour(self) -> None:
        """Draw again in the new theme."""
        self.show(getattr(self, "_facts", None))

    # -- keys -----------------------------------------------------------------------------------

    def action_run(self) -> None:
        """Run every stage that is missing or stale."""
        self.olive.start(jobs.run_all(self.folder))

    @on(DataTable.RowSelected, "#stages")
    def action_open(self) -> None:
        """Show what the marked stage found, or the whole error that it failed with."""
        stage = STAGE_NAMES[self.query_one("#stages", DataTable).cursor_row]
        facts = getattr(self, "_facts", None)
        fault = next((f for f in facts.faults if f.stage == stage), None) if facts else None
        if fault is not None:
            self.olive.show_error(fault.error)
        else:
            self.action_page(FOUND_ON[stage])

    def action_run_one(self) -> None:
        """Run the marked stage, whatever its state."""
        stage = STAGE_NAMES[self.query_one("#stages", DataTable).cursor_row]
        self._run_stage(stage)

    def commands(self) -> list[Command]:
        """Each stage, with the paper's word for it."""
        return [
            Command(f"Run {words}", partial(self._run_stage, stage))
            for stage, words in PAPER_WORDS.items()
        ]

    def _run_stage(self, stage: str) -> None:
        self.olive.start(jobs.run_one(self.folder, stage))

    def action_notes(self) -> None:
        """Write down what should be known later."""
        facts = getattr(self, "_facts", None)
        if facts is not None:
            hint = "anything worth knowing later; stands in the report"
            screen = EditScreen("session.notes", hint, facts.notes)
            self.app.push_screen(screen, self._noted)

    def _noted(self, text: str | None) -> None:
        if text is not None:
            self.save_settings({"session.notes": text})

    def action_check(self) -> None:
        """Read every file from end to end."""
        self.olive.start(jobs.check_trial(self.folder))

    def action_preset(self) -> None:
        """Keep how this trial's accelerometer file is read, for other trials."""
        hint = "a name, letters, digits, - and _; a new trial takes it as its preset"
        self.app.push_screen(EditScreen("keep as preset", hint, "logger"), self._named)

    def _named(self, name: str | None) -> None:
        if name is not None:
            self.olive.start(tool_jobs.keep_preset(self.folder, name, self.olive.workspace))

    def action_row_time(self) -> None:
        """Measure the row times of this trial's cameras."""
        from olivevib.tui.screens.row_time import RowTimePage

        self.app.push_screen(RowTimePage(self.olive.workspace, self.folder.name))

    def action_page(self, name: str) -> None:
        """Show another page of this trial."""
        self.olive.show_page(name, self.folder)
