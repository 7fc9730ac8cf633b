"""Long jobs beside one trial's stages: many trials, a camera's row time, a preset, a season."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

from olivevib.progress import Tick
from olivevib.tui.harmless import harmless
from olivevib.tui.work import Result, Work
from olivevib.values import counted

if TYPE_CHECKING:
    from olivevib.batch import TrialResult
    from olivevib.marker import MarkerLibrary
    from olivevib.pipeline.new_library import NewLibrary
    from olivevib.pipeline.prints import Prints


def run_batch(
    folders: Sequence[Path], workers: int | None, show: Callable[[TrialResult], object]
) -> Work:
    """Measure and report many trials, a worker process a core; ``show`` gets each as it ends."""

    def do(tick: Tick) -> Result:
        from olivevib.batch import measure_here

        failed = warned = done = 0
        with closing(measure_here([f.resolve() for f in folders], workers, tick)) as coming:
            for result in coming:
                show(result)
                failed += result.failed
                warned += bool(result.cautions)
                done += not result.failed
        words = f"{done} of {len(folders)} trials done, {failed} failed, {warned} with warnings."
        return Result(f"{words} e makes the season's page.", warns=bool(failed or warned))

    return Work("batch", do)


def season_report(folders: Sequence[Path], place: Path) -> Work:
    """A page a trial and the season's page with its table, into ``place``."""

    def do(tick: Tick) -> Result:
        from olivevib import pipeline
        from olivevib.trial import Trial

        trials = [Trial.open(folder) for folder in folders]
        pages = list(pipeline.report(trials, str(place), tick))
        season = next((p for p in pages if p.name == "season.html"), pages[-1])
        return Result(f"{counted(len(pages), 'file')} written; begin with {harmless(season)}")

    return Work("season report", do)


def lamp_row_time(
    video: Path, led_hz: float, camera: str, workspace: Path, show: Callable[[str], object]
) -> Work:
    """The row time of a camera from a flashing lamp; kept in the workspace's book."""

    def do(tick: Tick) -> Result:
        from olivevib.pipeline.row_time import keep_row_time, measure_row_time

        found = measure_row_time(video, led_hz, camera or None, tick)
        show(found.words)
        for caution in found.cautions:
            show(f"{caution.text} {caution.remedy}")
        kept = keep_row_time(found.entry, workspace)
        show(kept)
        return Result(kept, found.cautions)

    return Work("row time", do)


def board_row_time(folder: Path, workspace: Path, show: Callable[[str], object]) -> Work:
    """Both cameras' row times from the board that was waved for a trial; kept in the book."""

    def do(tick: Tick) -> Result:
        from olivevib.pipeline.row_time import board_row_times, keep_row_time
        from olivevib.trial import Trial

        words = ""
        for found in board_row_times(Trial.open(folder)):
            words = keep_row_time(found.entry, workspace)
            show(found.words)
            show(words)
        return Result(words)

    return Work("row time", do)


def make_prints(prints: Prints, target: Path) -> Work:
    """Pages of markers, or a board, into a PDF or SVG files."""

    def do(tick: Tick) -> Result:
        from olivevib.pipeline.prints import ADVICE, write_prints

        first, *more = write_prints(prints, target)
        others = f" and {counted(len(more), 'file')} more" if more else ""
        return Result(f"{harmless(first)}{others}. {ADVICE}")

    return Work("print", do)


def draw_marker(library: MarkerLibrary, marker: int, target: Path) -> Work:
    """One marker with its quiet zone, as PNG."""

    def do(tick: Tick) -> Result:
        from olivevib.files.prints import marker_picture, write_picture

        path = write_picture(target, marker_picture(library, marker))
        return Result(f"Marker {marker} of {harmless(library.name)}: {harmless(path)}")

    return Work("picture", do)


def new_library(asked: NewLibrary, workspace: Path, output: str) -> Work:
    """A new library of codes, kept in the workspace."""

    def do(tick: Tick) -> Result:
        from olivevib.pipeline.new_library import drawn_words, write_library

        library, path = write_library(asked, workspace, output, tick)
        return Result(f"{harmless(path)}: {drawn_words(library, asked)}")

    return Work("new library", do)


def keep_preset(folder: Path, name: str, workspace: Path) -> Work:
    """How the trial's first accelerometer file is read, kept under a name for other trials."""

    def do(tick: Tick) -> Result:
        from olivevib import pipeline
        from olivevib.trial import Trial

        path = pipeline.keep_preset(Trial.open(folder), name, 1, workspace)
        return Result(f"Kept in {harmless(path)}; a new trial names it as its preset.")

    return Work("preset", do)
