"""The calibration board in every frame of both board recordings, with stamps."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from olivevib.arrays import Grey
from olivevib.calibration.boards import Board, board_from_table, parse_board
from olivevib.calibration.finding import BoardFinder
from olivevib.calibration.views import BoardView
from olivevib.detection import Detector
from olivevib.errors import Caution, UsageError
from olivevib.files.stills import open_source
from olivevib.marker import load_library
from olivevib.pipeline.recordings import SIDES, stamps_of
from olivevib.pipeline.two_cameras import both
from olivevib.progress import Tick
from olivevib.trial import Trial
from olivevib.trial.fingerprints import library_file

SAMPLE_FRAMES = 24  # kept of each recording, spread over it, for the diagnosis of failures


@dataclass(frozen=True)
class BoardRecording:
    """What one camera saw of the board: views with stamps (NaN for stills), size, sample frames."""

    side: str
    path: Path
    size_px: tuple[int, int]
    frames: int
    views: tuple[BoardView, ...]
    sample: tuple[Grey, ...]
    cautions: tuple[Caution, ...]


def trial_board(trial: Trial) -> Board:
    """The board that trial.toml names: a SPEC or a TOML file."""
    spec = trial.settings.calibration.board
    if not spec:
        raise UsageError(
            "the calibration board is not known.",
            "",
            "Name it: --set calibration.board=SPEC (olivevib new --help lists the SPECs).",
        )
    if spec.endswith(".toml"):
        return board_from_table(tomllib.loads(trial.path(spec).read_text(encoding="utf-8")))
    return parse_board(spec)


def board_paths(trial: Trial) -> dict[str, Path]:
    """Both board recordings, or UsageError where trial.toml names none."""
    named = {s: getattr(trial.settings.calibration, s) for s in SIDES}
    missing = [side for side, name in named.items() if not name]
    if missing:
        raise UsageError(
            f"the {missing[0]} recording of the calibration board is not known.",
            "calibration.left and calibration.right of trial.toml name both.",
            "Name it: --set calibration.left=PATH --set calibration.right=PATH.",
        )
    return {s: trial.path(str(name)) for s, name in named.items()}


def board_finder(trial: Trial, board: Board) -> BoardFinder:
    """What finds the trial's board in a picture; one for each camera."""
    return BoardFinder(board, board_reader(trial, board))


def find_boards(trial: Trial, board: Board, tick: Tick) -> dict[str, BoardRecording]:
    """Look for the board in every frame of both recordings, one thread a camera."""
    paths = board_paths(trial)
    seen: dict[str, list[_Seen]] = {side: [] for side in SIDES}
    notes: dict[str, _Note] = {}
    makers = {side: partial(_look, trial, board, paths[side], side, notes) for side in SIDES}
    total = 0
    for side in SIDES:
        with open_source(paths[side], side) as source:
            total += source.count_hint or 0
    both(makers, lambda side, item: seen[side].append(item), tick, total or None, "finding boards")
    return {side: _recording(trial, side, paths[side], seen[side], notes[side]) for side in SIDES}


@dataclass(frozen=True)
class _Seen:
    """One frame: its stamp, the board where it was found, the picture where it is kept."""

    stamp_s: float
    view: BoardView | None
    sample: Grey | None


@dataclass(frozen=True)
class _Note:
    """What reading the whole recording told."""

    kind: str
    size_px: tuple[int, int]
    cautions: tuple[Caution, ...]


def _look(
    trial: Trial, board: Board, path: Path, side: str, notes: dict[str, _Note]
) -> Iterator[_Seen]:
    finder = board_finder(trial, board)
    with open_source(path, side) as source:
        every = max(1, (source.count_hint or 200) // SAMPLE_FRAMES)
        for frame in source.frames():
            if frame.grey is None:
                yield _Seen(frame.stamp_s, None, None)
                continue
            view = finder.find(frame.grey, frame.index, frame.stamp_s)
            keep = frame.index % every == 0
            yield _Seen(frame.stamp_s, view, frame.grey if keep else None)
        notes[side] = _Note(source.kind, source.size_px, tuple(source.cautions))


def board_reader(trial: Trial, board: Board) -> Detector | None:
    """The detector of the trial's own library, for boards of coded markers; None for others."""
    if board.kind != "coded":
        return None
    library = trial.settings.markers.library
    file = library_file(trial.folder, library)
    return Detector(load_library(str(file) if file else library), trial.settings.detection)


def _recording(
    trial: Trial, side: str, path: Path, seen: list[_Seen], note: _Note
) -> BoardRecording:
    views = [s.view for s in seen if s.view is not None]
    if note.kind == "video":
        stamp_file = getattr(trial.settings.calibration, f"{side}_stamps")
        file = trial.path(stamp_file) if stamp_file else None
        _, _, fit = stamps_of(file, path, [s.stamp_s for s in seen])
        views = [replace(v, t_s=float(fit.t_s[v.frame])) for v in views]
    else:
        views = [replace(v, t_s=float(np.nan)) for v in views]
    return BoardRecording(
        side=side,
        path=path,
        size_px=note.size_px,
        frames=len(seen),
        views=tuple(views),
        sample=tuple(s.sample for s in seen if s.sample is not None)[:SAMPLE_FRAMES],
        cautions=note.cautions,
    )
