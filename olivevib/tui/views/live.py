"""A running capture in words: what to do now, each camera, the board's coverage, the verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from rich.text import Text

from olivevib.planning import Setup, step_words
from olivevib.tui.harmless import harmless
from olivevib.tui.views.palette import Palette
from olivevib.tui.views.picture import Outline

if TYPE_CHECKING:
    from olivevib.calibration.guidance import Guidance
    from olivevib.errors import Caution
    from olivevib.pipeline.capture import CameraState, CaptureState

STEPS = (
    ("rest", ("rest",)),
    ("start", ("start", "starting")),
    ("steady", ("steady",)),
    ("stop", ("stop", "decay")),
    ("end", ("done",)),
)
DOT_PX = 3.0


def prompt_text(state: CaptureState, palette: Palette) -> Text:
    """What to do now, large enough to be read from a distance: one line, and the steps."""
    out = Text()
    if not state.recording:
        out.append("NOT RECORDING YET", palette.warn)
        out.append("  aim, focus, check the light; Space starts the recording")
        return out
    out.append("● REC ", palette.bad)
    minutes, seconds = divmod(int(state.elapsed_s), 60)
    out.append(f"{minutes:02d}:{seconds:02d}")
    if state.seconds is not None:
        out.append(f" of {state.seconds:g} s")
    if state.prompt is not None:
        _append_prompt(out, state, palette)
    if state.coverage is not None:
        style = palette.good if state.coverage.enough else palette.accent
        out.append(f"   {state.coverage.words}", style)
    return out


def _append_prompt(out: Text, state: CaptureState, palette: Palette) -> None:
    assert state.prompt is not None
    out.append(f"   {state.prompt.words}", palette.accent)
    if math.isfinite(state.prompt.left_s):
        out.append(f" {math.ceil(state.prompt.left_s)} s", palette.accent)
    out.append("\n")
    for name, phases in STEPS:
        here = state.prompt.phase in phases
        out.append(f" {'▶' if here else '·'} {name} ", palette.accent if here else palette.muted)


def state_text(state: CaptureState, palette: Palette) -> Text:
    """Both cameras, a line each with its advice, and what they have in common."""
    out = Text()
    if state.coverage is not None:  # first: who waves the board looks for it
        out.append_text(coverage_text(state.coverage, palette))
        out.append("\n")
    for side, camera in state.cameras.items():
        _append_camera(out, side, camera, palette)
    parts = []
    if math.isfinite(state.offset_s):
        rates = [c.fps for c in state.cameras.values() if math.isfinite(c.fps) and c.fps > 0]
        setup = Setup(fps=min(rates, default=30.0), offset_s=state.offset_s)
        parts.append(step_words(setup))
    parts.append(f"{state.free_bytes / 1e9:.0f} GB free")
    if math.isfinite(state.minutes_left):
        parts.append(f"{state.minutes_left:.0f} minutes left")
    out.append(" · ".join(parts), palette.muted)
    return out


def _append_camera(out: Text, side: str, camera: CameraState, palette: Palette) -> None:
    gone = camera.gone or camera.ended
    out.append(f"{side:<6}", palette.accent)
    out.append(camera_words(camera), palette.bad if gone else palette.text)
    for advice in camera.advice:
        out.append(f"\n       ⚠ {harmless(advice, 120)}", palette.warn)
    out.append("\n")


def camera_words(camera: CameraState) -> str:
    """Rate, drops, markers, sharpness, brightness, exposure of one camera."""
    if camera.gone or camera.ended:
        return f"GONE: {harmless(camera.gone or camera.ended, 80)}"
    rate = f"{camera.fps:.1f} fps" if math.isfinite(camera.fps) else "-- fps"
    parts = [rate, f"{camera.dropped} lost"]
    look = camera.look
    if look is not None:
        seen = "board seen" if look.board is not None else f"{len(look.ids)} markers"
        parts.append(seen)
        if math.isfinite(look.blur_px):
            parts.append(f"blur {look.blur_px:.1f} px")
        parts.append(f"white {look.white_dn:.0f}, {look.saturated:.0%} saturated")
    if camera.controls.exposure_us is not None:
        parts.append(f"exposure {camera.controls.exposure_us / 1000:g} ms")
    return " · ".join(parts)


def coverage_text(coverage: Guidance, palette: Palette) -> Text:
    """What to show next, tilts and distances, and where the board has been in both pictures."""
    out = Text()
    out.append(f"{coverage.advice}\n", palette.good if coverage.enough else palette.accent)
    still = f", never its {', '.join(coverage.still)} side nearer" if coverage.still else ""
    numbers = (
        f"{coverage.pairs} views in both cameras · {coverage.tilts} of 4 tilts{still} · "
        f"farthest {coverage.far_to_near:.1f} × nearest"
    )
    out.append(f"{numbers}\n", palette.muted)
    maps = {side: _map_lines(seen) for side, seen in coverage.seen.items()}
    height = max((len(lines) for lines in maps.values()), default=0)
    for row in range(height):
        out.append("  ".join(f"{side if row == 0 else '':>6} {maps[side][row]}" for side in maps))
        out.append("\n" if row < height - 1 else "")
    return out


def _map_lines(seen: np.ndarray[tuple[int, int], np.dtype[np.bool_]]) -> list[str]:
    return ["".join("██" if cell else "··" for cell in row) for row in seen]


def live_outlines(camera: CameraState) -> tuple[Outline, ...]:
    """A bracket about each marker that was seen, or a dot on each point of the board."""
    look = camera.look
    if look is None:
        return ()
    if look.board is not None:
        square = DOT_PX * np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
        return tuple(Outline(k, at + square, "") for k, at in enumerate(look.board.px))
    pairs = zip(look.ids, look.corners_px, strict=True)
    return tuple(Outline(i, corners, f"{i}") for i, corners in pairs)


def verdict_text(words: str, cautions: Sequence[Caution], next_: str, palette: Palette) -> Text:
    """What was recorded and what it is good for, each warning with its remedy, the next key."""
    out = Text()
    out.append(f"{harmless(words, 400)}\n", palette.warn if cautions else palette.good)
    for caution in cautions:
        out.append(f"⚠ {harmless(caution.text, 300)} ", palette.warn)
        out.append(f"{harmless(caution.remedy, 300)}\n")
    out.append(next_, palette.accent)
    return out
