"""What a capture is asked for, and what it says of itself while it runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from olivevib.arrays import Grey
from olivevib.calibration.guidance import Guidance
from olivevib.errors import Caution, OlivevibError
from olivevib.files.capture import CameraFacts, Controls, Mode
from olivevib.pipeline.capture.looks import Look
from olivevib.pipeline.capture.prompts import Prompt
from olivevib.pipeline.capture.verdict import Verdict

AS_IT_COMES = Mode()
RESERVE_BYTES = 200_000_000  # recording stops while so much of the disk is still free
WARM_UP_S = 1.0


@dataclass(frozen=True)
class CapturePlan:
    """What ``olivevib capture`` was told.

    left, right: camera names (``files.capture.open_camera``, or "simulated:demo"); seconds None:
    until somebody stops it; board: the SPEC of the calibration board where that is recorded;
    markers, ids: what hangs on the tree; preview False: nothing is decoded while recording.
    """

    left: str
    right: str
    seconds: float | None = None
    mode: Mode = AS_IT_COMES
    board: str | None = None
    markers: str = "olive49"
    ids: tuple[int, ...] = ()
    band_hz: tuple[float, float] | None = None
    preview: bool = True
    warm_up_s: float = WARM_UP_S
    reserve_bytes: int = RESERVE_BYTES


@dataclass(frozen=True)
class CameraState:
    """One camera while it records; look and picture: the last frame that was decoded."""

    facts: CameraFacts
    frames: int
    dropped: int
    fps: float
    size_bytes: int
    gone: str
    ended: str
    losses: int
    controls: Controls
    look: Look | None
    picture: Grey | None
    advice: tuple[str, ...]


@dataclass(frozen=True)
class CaptureState:
    """The whole capture, ten times a second.

    elapsed_s is 0 while cameras warm up; offset_s: right minus left by their stamps, modulo a
    frame, NaN while unknown; minutes_left: until the disk's reserve is reached at this rate.
    """

    recording: bool
    elapsed_s: float
    seconds: float | None
    cameras: Mapping[str, CameraState]
    offset_s: float
    free_bytes: int
    minutes_left: float
    prompt: Prompt | None
    coverage: Guidance | None


@dataclass(frozen=True)
class Captured:
    """What a capture left behind. error: why it was stopped early (disk full), after closing."""

    folder: Path
    videos: Mapping[str, Path]
    verdict: Verdict
    error: OlivevibError | None = None

    @property
    def cautions(self) -> tuple[Caution, ...]:
        """The warnings of the verdict."""
        return self.verdict.cautions


Watch = Callable[[CaptureState], None]
Hold = Callable[[], bool]


def at_once() -> bool:
    """Hold nothing back: record as soon as both cameras deliver."""
    return False


def unwatched(state: CaptureState) -> None:
    """A watch that looks at nothing and never stops the capture."""
