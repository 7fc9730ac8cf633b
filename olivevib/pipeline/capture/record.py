"""The one door to a capture: cameras in, a recorded trial (or board) out."""

from __future__ import annotations

import functools
import shutil
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path

import tomlkit

from olivevib import __version__
from olivevib.calibration.boards import parse_board
from olivevib.errors import InputError, UsageError
from olivevib.files.atomic import write_text_atomic
from olivevib.files.capture import Camera, CameraRunner, open_camera
from olivevib.marker import load_library
from olivevib.pipeline.capture.looker import Looker
from olivevib.pipeline.capture.plan import (
    Captured,
    CapturePlan,
    Hold,
    Watch,
    at_once,
    unwatched,
)
from olivevib.pipeline.capture.rehearsal import PREFIX, simulated_cameras
from olivevib.pipeline.capture.session import SIDES, Session, nearly_full
from olivevib.pipeline.capture.verdict import Verdict
from olivevib.pipeline.libraries import only_known
from olivevib.progress import Tick, silent

RECORD = "capture.toml"
LIVE = ("v4l2", "dshow", "avfoundation", "http", "pipe")  # kinds that may come back


def capture(
    folder: Path,
    plan: CapturePlan,
    watch: Watch = unwatched,
    tick: Tick = silent,
    hold: Hold = at_once,
) -> Captured:
    """Record both cameras into ``folder`` as left.nut and right.nut, each with its side-car.

    ``watch`` gets the state ten times a second and stops the recording by raising Cancelled; while
    ``hold`` is true the cameras run and are watched, and nothing is recorded yet. What
    was recorded is kept whatever happens; a fault that ended it early is in the result. Raises
    UsageError or InputError before anything is recorded: a name that means no camera, a camera that
    delivers nothing, recordings that are there already, no room on the disk.
    """
    library = only_known(load_library(plan.markers), () if plan.board else plan.ids)
    board = None if plan.board is None else parse_board(plan.board)
    made = [place for place in (folder, *folder.parents) if not place.exists()]
    _check(folder, plan)
    try:
        cameras, reopen = _open(plan, tick)
    except BaseException:
        _leave(made)
        raise

    def looker(runners: Mapping[str, CameraRunner]) -> Looker:
        return Looker(runners, library, board)

    session = Session(plan, cameras, looker if plan.preview else None, reopen)
    videos: dict[str, Path] = {}
    try:
        session.start(watch, hold)
        videos = session.record(folder)
        _write_record(folder, plan, cameras, None)
        session.watch_until_done(watch)
    finally:
        session.finish()
        if not videos:
            _leave(made)
    session.join(tick)
    verdict = session.judge()
    with suppress(InputError):  # no room: what was written at the start stays
        _write_record(folder, plan, cameras, verdict)
    there = {side: video for side, video in videos.items() if video.is_file()}
    return Captured(folder, there, verdict, session.error)


def _leave(made: Sequence[Path]) -> None:
    """Take away the folders that were made for nothing; one with anything in it stays."""
    with suppress(OSError):
        for folder in made:
            folder.rmdir()


def _check(folder: Path, plan: CapturePlan) -> None:
    """Whatever can be told before a camera is touched."""
    for name, value in (("--seconds", plan.seconds), ("--fps", plan.mode.fps)):
        if value is not None and not value > 0:
            raise UsageError(f"{name} {value:g} is too little.", "", "Give a number above 0.")
    for side in SIDES:
        for found in sorted(folder.glob(f"{side}*")) if folder.is_dir() else ():
            raise UsageError(
                f"{found} is there already.",
                "A recording never overwrites another.",
                "Choose another trial name, or move the old recording away yourself.",
            )
    folder.mkdir(parents=True, exist_ok=True)
    if shutil.disk_usage(folder).free < plan.reserve_bytes:
        raise nearly_full(folder, plan.reserve_bytes)


def _open(
    plan: CapturePlan, tick: Tick
) -> tuple[dict[str, Camera], dict[str, Callable[[], Camera]]]:
    """Both cameras, opened side by side, and how to open those again that may come back."""
    names = {"left": plan.left, "right": plan.right}
    drawn: dict[str, Camera] = {}
    for name in dict.fromkeys(names.values()):
        if name.startswith(PREFIX):
            pair = simulated_cameras(name, plan.mode, board=plan.board is not None, tick=tick)
            drawn |= {side: pair[side] for side in SIDES if names[side] == name}
    again: dict[str, Callable[[], Camera]] = {
        s: functools.partial(open_camera, names[s], plan.mode, s) for s in SIDES
    }
    cameras: dict[str, Camera] = {}
    with ThreadPoolExecutor(len(SIDES)) as pool:
        opening = {s: pool.submit(again[s]) for s in SIDES if s not in drawn}
        try:
            cameras = {s: drawn[s] if s in drawn else opening[s].result() for s in SIDES}
            _check_pair(cameras)
        except BaseException:
            for future in opening.values():
                with suppress(BaseException):
                    future.result().close()
            raise
    reopen = {s: again[s] for s in SIDES if cameras[s].facts.kind in LIVE}
    return cameras, reopen


def _check_pair(cameras: Mapping[str, Camera]) -> None:
    """UsageError where both names mean one device, or their pictures have different sizes."""
    left, right = (cameras[side].facts for side in SIDES)
    if left.kind in ("v4l2", "dshow", "avfoundation") and left.name == right.name:
        raise UsageError(
            "both names mean the same camera.", f"It is {left.title} ({left.name}).", "Name two."
        )
    if left.size_px != right.size_px:
        sizes = ["{} x {}".format(*facts.size_px) for facts in (left, right)]
        raise UsageError(
            f"the left camera delivers {sizes[0]} px, the right one {sizes[1]} px.",
            "Both must run in the same mode.",
            "Name a size that both offer, such as --size 1280x720 (olivevib doctor lists modes).",
        )


def _write_record(
    folder: Path, plan: CapturePlan, cameras: Mapping[str, Camera], verdict: Verdict | None
) -> None:
    """capture.toml: what was recorded with, and at the end what became of it."""
    doc = tomlkit.document()
    doc["software"] = f"olivevib {__version__}"
    doc["recorded"] = "board" if plan.board else "tree"
    if plan.board:
        doc["board"] = plan.board
    for side in SIDES:
        facts = {k: v for k, v in asdict(cameras[side].facts).items() if v not in (None, "")}
        fit = verdict.fits.get(side) if verdict else None
        if fit is not None:
            facts |= {"frames": fit.t_s.size, "dropped": fit.dropped.size, "rate_hz": fit.rate_hz}
            facts["jitter_ms"] = fit.jitter_s * 1e3
        doc[side] = facts
    if verdict is not None:
        doc["verdict"] = {"words": verdict.words, "warnings": [c.code for c in verdict.cautions]}
    write_text_atomic(folder / RECORD, tomlkit.dumps(doc))
