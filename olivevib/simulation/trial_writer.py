"""A whole simulated trial on disk, exactly as a technician would have recorded it."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from olivevib.arrays import Grey
from olivevib.marker import MarkerLibrary
from olivevib.progress import Tick, silent
from olivevib.simulation.accelerometer import record
from olivevib.simulation.recording import MjpegWriter, jpeg, write_logger_csv, write_still
from olivevib.simulation.render import Renderer
from olivevib.simulation.scenarios import Scenario
from olivevib.simulation.staging import SENSOR, Stage, build, stream
from olivevib.simulation.truth import Frames, frames_of, write_truth

SIDES = ("left", "right")


@dataclass(frozen=True)
class SimulatedTrial:
    """Where the recordings are and what the technician would tell ``olivevib new``.

    calibration_left, calibration_right: folders of stills, or videos. row_time_us is None under a
    global shutter. sizes_mm: outer side of each marker by id, where they differ from size_mm.
    ``stage`` holds the exact truth; ``truth`` is the folder that repeats it in files.
    """

    recordings: Path
    left: Path
    right: Path
    calibration_left: Path
    calibration_right: Path
    board: str
    markers: str
    ids: tuple[int, ...]
    size_mm: float
    sizes_mm: dict[int, float]
    places: dict[int, str]
    shutter: str
    row_time_us: tuple[float, float] | None
    band_hz: tuple[float, float] | None
    accelerometer: Path | None
    accelerometer_marker: int | None
    truth: Path
    stage: Stage


def simulate(
    folder: Path,
    scenario: Scenario,
    seed: int = 1,
    tick: Tick = silent,
    codes: MarkerLibrary | None = None,
) -> SimulatedTrial:
    """Record a scenario into ``folder/recordings``, its truth into ``folder/truth``.

    ``codes`` replaces the shipped library of our own markers. The same scenario and seed give the
    same bytes. The two cameras are drawn in two threads.
    """
    stage = build(scenario, seed, codes)
    recordings, truth = folder / "recordings", folder / "truth"
    (recordings / "calibration").mkdir(parents=True, exist_ok=True)
    total = scenario.frames + scenario.board.views
    with ThreadPoolExecutor(len(SIDES)) as pool:
        crew = _Crew(pool, tick, total)
        boards = _record_board(recordings / "calibration", stage, crew)
        videos = _record_tree(recordings, stage, crew)
    accelerometer = _record_sensor(recordings, stage)
    write_truth(truth, stage)
    return _told(stage, recordings, truth, (*videos, *boards), accelerometer)


class _Crew:
    """Draws and compresses both cameras' pictures side by side and keeps count for the tick."""

    def __init__(self, pool: ThreadPoolExecutor, tick: Tick, total: int) -> None:
        self._pool = pool
        self._tick = tick
        self._total = total
        self._done = 0

    def both(self, work: Callable[[str], bytes | None], note: str) -> list[bytes | None]:
        """``work`` for left and right; counts one pair."""
        out = list(self._pool.map(work, SIDES))
        self._done += 1
        self._tick(self._done, self._total, note)
        return out

    def pair(self, scene_renderers: Callable[[str], Renderer]) -> dict[str, Renderer]:
        """A renderer for each camera."""
        return dict(zip(SIDES, self._pool.map(scene_renderers, SIDES), strict=True))


def _record_tree(folder: Path, stage: Stage, crew: _Crew) -> tuple[Path, Path]:
    frames = {side: frames_of(stage, side) for side in SIDES}
    renderers = crew.pair(lambda side: Renderer(stage.tree, side))
    return _record_video(folder, stage, crew, frames, lambda s: renderers[s].frame)


def _record_video(
    folder: Path,
    stage: Stage,
    crew: _Crew,
    frames: dict[str, Frames],
    drawer: Callable[[str], Callable[[int, float], Grey]],
) -> tuple[Path, Path]:
    """Both cameras' videos, frame by frame; dropped frames leave a gap in the stamps."""
    quality = stage.scenario.encoding.video_quality
    fps, size = stage.scenario.cameras.left.fps, stage.scenario.cameras.size_px
    paths = (folder / "left.nut", folder / "right.nut")
    with MjpegWriter(paths[0], size, fps) as left, MjpegWriter(paths[1], size, fps) as right:
        for n in range(frames["left"].exposed_s.size):

            def one(side: str, n: int = n) -> bytes | None:
                if not frames[side].delivered[n]:
                    return None
                return jpeg(drawer(side)(n, float(frames[side].exposed_s[n])), quality)

            pictures = crew.both(one, "drawing frames")
            for side, writer, picture in zip(SIDES, (left, right), pictures, strict=True):
                if picture is not None:
                    writer.write(picture, int(frames[side].stamp_us[n]))
    return paths


def _record_board(folder: Path, stage: Stage, crew: _Crew) -> tuple[Path, Path]:
    renderers = crew.pair(lambda side: Renderer(stage.board_scene, side))
    plan = stage.scenario.board
    if plan.video_fps is None:
        return _record_stills(folder, stage, crew, renderers)
    times = np.arange(plan.views) / plan.video_fps
    stamps = np.rint(times * 1e6).astype(np.int64)
    every = np.ones(plan.views, dtype=np.bool_)
    frames = {
        s: Frames(times + getattr(stage.tree, s).clock.offset_s, stamps, every) for s in SIDES
    }
    body = stage.board_views

    def drawer(side: str) -> Callable[[int, float], Grey]:
        return lambda n, t: renderers[side].frame(n, t, body)

    return _record_video(folder, stage, crew, frames, drawer)


def _record_stills(
    folder: Path, stage: Stage, crew: _Crew, renderers: dict[str, Renderer]
) -> tuple[Path, Path]:
    code = stage.scenario.encoding
    for side in SIDES:
        (folder / side).mkdir(exist_ok=True)
    for n, body in enumerate(stage.board_views):

        def one(side: str, n: int = n, body: object = body) -> None:
            grey = renderers[side].frame(n, 0.0, (stage.board_views[n],))
            write_still(
                folder / side / f"{side}_{n:02d}{code.still_suffix}", grey, code.still_quality
            )

        crew.both(one, "drawing the board")
    return folder / "left", folder / "right"


def _record_sensor(folder: Path, stage: Stage) -> Path | None:
    sensor = stage.scenario.sensor
    if sensor is None:
        return None
    body = next(m.body for m in stage.markers if m.id == sensor.marker)
    rng = stream(stage.seed, SENSOR)
    stamps, force = record(sensor, body, stage.down, stage.scenario.seconds, rng)
    path = folder / "accelerometer.csv"
    write_logger_csv(path, stamps, force)
    return path


def _told(
    stage: Stage,
    recordings: Path,
    truth: Path,
    paths: tuple[Path, ...],
    accelerometer: Path | None,
) -> SimulatedTrial:
    scenario = stage.scenario
    sizes = {m.id: m.size_mm for m in stage.markers}
    rows = scenario.cameras.row_time_s
    rolling = any(rows)
    sensor = scenario.sensor
    return SimulatedTrial(
        recordings,
        *paths,
        board=stage.board.spec,
        markers=scenario.markers.library,
        ids=scenario.markers.ids,
        size_mm=float(np.median(list(sizes.values()))),
        sizes_mm=sizes,
        places={m.id: m.place for m in stage.markers},
        shutter="rolling" if rolling else "global",
        row_time_us=(rows[0] * 1e6, rows[1] * 1e6) if rolling else None,
        band_hz=scenario.band_hz,
        accelerometer=accelerometer,
        accelerometer_marker=None if sensor is None else sensor.marker,
        truth=truth,
        stage=stage,
    )
