"""The long jobs of the app, each a verb of the pipeline: what the command line does too."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from olivevib.errors import Caution
from olivevib.progress import Tick
from olivevib.tui.harmless import harmless
from olivevib.tui.work import Result, Work
from olivevib.values import counted

if TYPE_CHECKING:
    from olivevib.calibration.guidance import Guidance
    from olivevib.calibration.sigma_map import SigmaMap
    from olivevib.pipeline import NewTrial


def run_all(folder: Path) -> Work:
    """Every stage that is missing or stale, in order."""

    def do(tick: Tick) -> Result:
        from olivevib import pipeline
        from olivevib.trial import Trial

        outcomes = list(pipeline.run(Trial.open(folder), tick))
        done = [o.stage for o in outcomes if o.words == "done"]
        cautions = Trial.open(folder).cautions  # also of stages that were up to date
        return Result(_ran(done, cautions), cautions)

    return Work(f"{_name(folder)}: run", do)


def run_one(folder: Path, stage: str) -> Work:
    """One stage, whether or not it is up to date."""

    def do(tick: Tick) -> Result:
        from olivevib import pipeline
        from olivevib.trial import Trial

        cautions = pipeline.run_stage(Trial.open(folder), stage, tick)
        return Result(_ran([stage], cautions), cautions)

    return Work(f"{_name(folder)}: {stage}", do)


def _ran(done: Sequence[str], cautions: Sequence[Caution]) -> str:
    warned = f"; {counted(len(cautions), 'warning')} to read" if cautions else ""
    if not done:
        return (
            f"Nothing to do: every stage that can run is up to date{warned}. v shows the results."
        )
    return f"{', '.join(done)} done{warned}. v shows the results, e makes the report."


def preview_board(folder: Path, show: Callable[[Guidance], None]) -> Work:
    """Go through the board recordings as a running camera would; nothing is written."""

    def do(tick: Tick) -> Result:
        from olivevib.pipeline.preview import preview
        from olivevib.trial import Trial

        last = preview(Trial.open(folder), lambda told, _: show(told), tick)
        show(last)
        return Result(f"{last.pairs} common views; {last.advice}.")

    return Work(f"{_name(folder)}: board", do)


def map_sigma(folder: Path, show: Callable[[SigmaMap], None]) -> Work:
    """The sigma to expect over the working volume; also as CSV into ``exports/``."""

    def do(tick: Tick) -> Result:
        from olivevib.pipeline.sigma import expected_sigma, write_sigma
        from olivevib.trial import Trial

        trial = Trial.open(folder)
        found = expected_sigma(trial)
        show(found)
        return Result(f"The map of sigma is also {harmless(write_sigma(trial, found))}")

    return Work(f"{_name(folder)}: sigma", do)


def make_report(folder: Path, kind: str = "report") -> Work:
    """One self-contained page beside the trial; "pdf" and "figures" come with the page."""

    def do(tick: Tick) -> Result:
        from olivevib import pipeline
        from olivevib.report import Also
        from olivevib.trial import Trial

        also = Also(pdf=kind == "pdf", figures=kind == "figures")
        pages = list(pipeline.report([Trial.open(folder)], None, tick, also))
        made = next((p for p in pages if p.suffix == ".pdf"), pages[0])
        more = f", and {len(pages) - 1} figures" if kind == "figures" else ""
        return Result(f"The report is {harmless(made)}{more}")

    return Work(f"{_name(folder)}: report", do)


def make_export(folder: Path, to: str, ids: tuple[int, ...] | None = None) -> Work:
    """The 3-D paths of these markers (None: all) for another program, into ``exports/``."""

    def do(tick: Tick) -> Result:
        from olivevib import pipeline
        from olivevib.trial import Trial

        trial = Trial.open(folder)
        target = pipeline.export_place(trial, to)
        tick(0, 1, f"writing {to}")
        cautions = pipeline.export(trial, to, target, ids)
        words = pipeline.export_words(trial, to, ids)
        told = f". {to}: {words}" if words else ""
        return Result(f"The export is {harmless(target)}{told}", tuple(cautions))

    return Work(f"{_name(folder)}: export {to}", do)


def make_trial(workspace: Path, name: str, plan: NewTrial, record: Mapping[str, object]) -> Work:
    """A new trial from recordings, with its session record; nothing is overwritten."""

    def do(tick: Tick) -> Result:
        from olivevib import pipeline
        from olivevib.trial.workspace import make_workspace, place_for_new

        make_workspace(workspace)
        trial = pipeline.new_trial(place_for_new(name, workspace), plan, tick)
        trial = trial.changed(record) if record else trial
        words = f"{harmless(trial.name)} is made. r runs every stage, s describes it."
        return Result(words, opens=trial.folder)

    return Work(f"{harmless(name, 40)}: new trial", do)


def make_demo(workspace: Path) -> Work:
    """A simulated trial with known truth, to try everything on."""

    def do(tick: Tick) -> Result:
        from olivevib.pipeline.simulated import simulated_trial
        from olivevib.trial.workspace import make_workspace, place_for_new

        make_workspace(workspace)
        trial = simulated_trial(place_for_new(DEMO, workspace), DEMO, 1, tick)
        words = "A simulated trial is made; its truth stands beside it. r runs every stage."
        return Result(words, opens=trial.folder)

    return Work("simulating a trial", do)


DEMO = "demo"


def check_trial(folder: Path) -> Work:
    """Read everything in the trial from end to end; nothing is changed."""

    def do(tick: Tick) -> Result:
        from olivevib import pipeline

        findings = pipeline.check(folder, tick)
        bad = [f for f in findings if f.state != "whole"]
        told = "; ".join(f"{f.what} {f.state}: {f.words}" for f in bad)
        return Result(f"{counted(len(findings), 'thing')} checked, {told or 'all whole'}.")

    return Work(f"{_name(folder)}: check", do)


def _name(folder: Path) -> str:
    return harmless(folder.resolve().name, 40)
