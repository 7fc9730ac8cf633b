"""The form of a capture, the plan it means, and the recording while it runs in its thread."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from olivevib.errors import Caution, OlivevibError, UsageError
from olivevib.progress import Cancelled, Tick
from olivevib.tui.fields import Field, number_in
from olivevib.tui.plan import BANDS, BOARDS, IDS, LIBRARIES, SIZES, trial_name
from olivevib.tui.work import Result, Work

if TYPE_CHECKING:
    from olivevib.pipeline.capture import CapturePlan, CaptureState

SHOWN_HZ = 3.0  # a preview that is drawn more often costs the recording a core
REHEARSAL = "simulated:demo"
PICTURES = ("1280x720", "1920x1080", "640x480")

CAMERA = "number or part of its name; http://… of a stream"
NAMES = ("0", "1", "2", REHEARSAL)

FIELDS = (
    Field("trial", "trial", "its name, e.g. 2026-11-20_T04"),
    Field("left", "left camera", "number or part of its name; http://… of a stream", choices=NAMES),
    Field(
        "right", "right camera", "number or part of its name; http://… of a stream", choices=NAMES
    ),
    Field("board", "board", "empty: the tree; else the board that is recorded", choices=BOARDS),
    Field("seconds", "seconds", "empty: until Space is pressed again", choices=("20", "60")),
    Field("size", "picture size", "empty: what the camera does by itself", choices=PICTURES),
    Field("fps", "frames/s", "empty: what the camera does by itself", choices=("30", "60", "120")),
    Field("exposure", "exposure, ms", "fixed, with the focus (Linux)", choices=("1", "2", "5")),
    Field("ids", "marker ids", "1,2,5-9; empty: every id of the library", choices=IDS),
    Field("marker_size", "marker size, mm", "outer side of the dark square", choices=SIZES),
    Field("markers", "marker library", "olive49, aruco:…, a TOML file", choices=LIBRARIES),
    Field("band", "band, Hz", "where the shaker's frequency may lie: 5-45", choices=BANDS),
)


@dataclass(frozen=True)
class Told:
    """What the form says: the trial's name, the plan, the markers' size in mm."""

    name: str
    plan: CapturePlan
    size_mm: float | None


@dataclass(frozen=True)
class Recorded:
    """A capture that is over: verdict, warnings, the trial made of it (None: not yet one)."""

    words: str
    cautions: tuple[Caution, ...]
    trial: Path | None
    error: OlivevibError | None


def told_of(values: Mapping[str, str]) -> Told:
    """What the form means; UsageError names the field that cannot be read."""
    from olivevib import values as typed
    from olivevib.files.capture import Mode
    from olivevib.pipeline.capture import CapturePlan

    said = {name: text.strip() for name, text in values.items() if text.strip()}
    for name in ("left", "right"):
        if name not in said:
            remedy = "Choose one of the list, or rehearse with Ctrl+R."
            raise UsageError(f"the {name} camera is not named.", "", remedy)
    exposure = number_in(said, "exposure")
    size = typed.picture_size(said.get("size"))
    plan = CapturePlan(
        left=said["left"],
        right=said["right"],
        seconds=number_in(said, "seconds"),
        mode=Mode(size, number_in(said, "fps"), None if exposure is None else exposure * 1000),
        board=said.get("board"),
        markers=said.get("markers", "olive49"),
        ids=typed.id_list(said.get("ids")),
        band_hz=typed.band(said.get("band")),
    )
    return Told(trial_name(values), plan, number_in(said, "marker_size"))


class Recording:
    """One capture as work of the app: ``begin`` records, ``end`` stops, both from any thread.

    ``seen`` gets every state that is worth drawing, ``over`` the outcome, both in the work's
    thread.
    """

    def __init__(self, workspace: Path, told: Told) -> None:
        self.told = told
        self.seen: Callable[[CaptureState], object] = _nothing
        self.over: Callable[[Recorded], object] = _nothing
        self._workspace = workspace
        self._begun, self._ended = threading.Event(), threading.Event()

    @property
    def work(self) -> Work:
        """The work to start."""
        return Work(f"{self.told.name}: capture", self._do)

    def begin(self) -> None:
        """Record from now on."""
        self._begun.set()

    def end(self) -> None:
        """Stop recording; what was recorded is kept."""
        self._ended.set()

    def _do(self, tick: Tick) -> Result:
        from olivevib.pipeline.capture import capture, place_of, trial_from
        from olivevib.trial.workspace import make_workspace

        make_workspace(self._workspace)
        folder, plan = self._workspace / "trials" / self.told.name, self.told.plan
        place = place_of(folder, plan)
        watch = _Watch(tick, self._ended, self.seen)
        captured = capture(place, plan, watch, tick, lambda: not self._begun.is_set())
        trial, error = None, captured.error
        try:  # from here on nothing may be cancelled: the recording becomes a trial
            trial = trial_from(folder, plan, captured, self.told.size_mm)
        except OlivevibError as fault:
            error = error or fault
        made = trial.folder if trial is not None else None
        words, cautions = captured.verdict.words, captured.cautions
        self.over(Recorded(words, cautions, made, error))
        if error is not None:
            raise error
        return Result(words, cautions)


class _Watch:
    """Hands states on at most ``SHOWN_HZ`` times a second; ends the recording when asked."""

    def __init__(
        self, tick: Tick, ended: threading.Event, seen: Callable[[CaptureState], object]
    ) -> None:
        self._tick, self._ended, self._seen = tick, ended, seen
        self._shown_s = float("-inf")
        self._phase = ""

    def __call__(self, state: CaptureState) -> None:
        if self._ended.is_set():
            raise Cancelled
        frames = sum(camera.frames for camera in state.cameras.values())
        self._tick(frames, None, "recording" if state.recording else "not recording yet")
        now, phase = time.monotonic(), state.prompt.phase if state.prompt else ""
        if now - self._shown_s >= 1 / SHOWN_HZ or phase != self._phase:
            self._shown_s, self._phase = now, phase
            self._seen(state)


def _nothing(value: object) -> None:
    """Where nobody looks."""
