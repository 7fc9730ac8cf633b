"""Simulated cameras to rehearse with: a drawn tree that rests, is shaken and rests again."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

from olivevib.files.capture import CameraFacts, Controls, Mode, Shot
from olivevib.files.capture.replay import Pace
from olivevib.progress import Tick, silent
from olivevib.simulation import Body, Renderer, Scenario, build, scenario
from olivevib.simulation.recording import jpeg
from olivevib.simulation.staging import Stage
from olivevib.simulation.truth import board_frames, frames_of

PREFIX = "simulated:"
SIZE = (640, 360)
SEED = 1
REST_FRAMES, SHAKEN_FRAMES, BOARD_FRAMES = 6, 45, 48
BOARD_HOLD = 6  # frames that each view of the board is shown
REST_S, SHAKEN_S = 5.0, 14.0

_Drawn = tuple[int, float, tuple[Body, ...] | None]  # number, exposure, bodies


@dataclass(frozen=True)
class _Film:
    """Coded pictures of one camera, shown to and fro."""

    rest: tuple[bytes, ...]
    shaken: tuple[bytes, ...]

    def at(self, number: int, fps: float) -> bytes:
        """The picture of a frame: rest, shaking, and rest again from then on."""
        t_s = number / fps
        film = self.shaken if REST_S <= t_s < REST_S + SHAKEN_S else self.rest
        turn = number % max(1, 2 * len(film) - 2)
        return film[min(turn, 2 * len(film) - 2 - turn)] if len(film) > 1 else film[0]


class SimulatedCamera:
    """One of a drawn pair of cameras; it is labelled simulated wherever it appears."""

    def __init__(self, facts: CameraFacts, film: _Film, late_s: float) -> None:
        self._facts = facts
        self._film = film
        self._late_ns = round(late_s * 1e9)

    @property
    def facts(self) -> CameraFacts:
        """What is known of it."""
        return self._facts

    def shots(self, stop: threading.Event) -> Iterator[Shot]:
        """Pictures at an even rate, without end; both cameras stamp by the computer's clock."""
        pace, fps = Pace(stop), self._facts.fps or 30.0
        period_ns = round(1e9 / fps)
        start_ns = (time.monotonic_ns() // period_ns) * period_ns + self._late_ns
        number = 0
        while pace.wait(number * period_ns):
            stamp = start_ns + number * period_ns
            yield Shot(self._film.at(number, fps), stamp, max(stamp, time.monotonic_ns()))
            number += 1

    def controls(self) -> Controls:
        """Nothing: nobody drives it."""
        return Controls()

    def close(self) -> None:
        """Nothing to release."""


def simulated_cameras(
    name: str, mode: Mode, *, board: bool, tick: Tick = silent
) -> dict[str, SimulatedCamera]:
    """A drawn pair of the scenario that ``name`` ("simulated:demo") means, before the tree or,
    with ``board``, before the calibration board. Drawing takes some seconds; a tick counts frames.
    """
    chosen = _fitted(scenario(name.removeprefix(PREFIX) or "demo"), mode)
    stage = build(chosen, SEED)
    fps = chosen.cameras.left.fps
    total = 2 * (BOARD_FRAMES if board else REST_FRAMES + SHAKEN_FRAMES)
    done = [0]

    def counted(side: str) -> _Film:
        film = _draw(stage, side, board=board)
        done[0] += total // 2
        return film

    with ThreadPoolExecutor(2) as pool:
        tick(0, total, "drawing the simulated cameras")
        films = dict(zip(("left", "right"), pool.map(counted, ("left", "right")), strict=True))
        tick(total, total, "drawing the simulated cameras")
    out = {}
    for side, film in films.items():
        facts = CameraFacts(
            name=name,
            title=f"simulated {side} camera",
            serial="",
            kind="simulated",
            codec="mjpeg",
            pixel_format="",
            size_px=chosen.cameras.size_px,
            fps=fps,
            stamp_kind="simulated",
        )
        late = getattr(chosen.cameras, side).offset_s
        out[side] = SimulatedCamera(facts, film, late)
    return out


def _fitted(chosen: Scenario, mode: Mode) -> Scenario:
    """The scenario in the asked size and rate; a smaller picture shows the same scene."""
    cameras, size = chosen.cameras, mode.size_px or SIZE
    scale = size[0] / cameras.size_px[0]
    fps = mode.fps or cameras.left.fps
    cameras = replace(
        cameras,
        size_px=size,
        focal_px=cameras.focal_px * scale,
        left=replace(cameras.left, fps=fps),
        right=replace(cameras.right, fps=fps),
    )
    return replace(chosen, cameras=cameras)


def _draw(stage: Stage, side: str, *, board: bool) -> _Film:
    quality = stage.scenario.encoding.video_quality
    scene = stage.board_scene if board else stage.tree
    renderer = Renderer(scene, side)

    def film(frames: Sequence[_Drawn]) -> tuple[bytes, ...]:
        return tuple(jpeg(renderer.frame(n, t, bodies), quality) for n, t, bodies in frames)

    if board:
        drawn = film(_board(stage, side))
        held = tuple(picture for picture in drawn for _ in range(BOARD_HOLD))
        return _Film(held, held)
    exposed = frames_of(stage, side).exposed_s
    middle = exposed.size // 2
    rest = [(n, float(exposed[0]), None) for n in range(REST_FRAMES)]
    shaken = [(n, float(exposed[n]), None) for n in range(middle, middle + SHAKEN_FRAMES)]
    return _Film(film(rest), film(shaken))


def _board(stage: Stage, side: str) -> list[_Drawn]:
    """Views of the board over its whole recording."""
    views, exposed = stage.board_views, board_frames(stage, side).exposed_s
    every = max(1, exposed.size // BOARD_FRAMES)
    return [
        (n, float(exposed[n]), (views[n if len(views) > 1 else 0],))
        for n in range(0, exposed.size, every)
    ]
