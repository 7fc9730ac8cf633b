"""A whole simulated trial on disk, exactly as a technician would have recorded it."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from olivevib.arrays import Floats, Grey
from olivevib.marker import MarkerLibrary
from olivevib.progress import Tick, silent
from olivevib.simulation.accelerometer import record
from olivevib.simulation.recording import MjpegWriter, jpeg, write_logger_csv, write_still
from olivevib.simulation.render import Renderer
from olivevib.simulation.scenarios import Scenario
from olivevib.simulation.scene import Scene
from olivevib.simulation.staging import SENSOR, Stage, build, stream
from olivevib.simulation.truth import Frames, board_frames, frames_of, write_truth

SIDES = ("left", "right")

Draw = Callable[[str, int], Grey]  # side and number of a frame or view


@dataclass(frozen=True)
class SimulatedTrial:
    """Where the recordings are and what the technician would tell ``olivevib new``.

    calibration_left, calibration_right: folders of stills, or videos. row_time_us is None under a
    global shutter, and where the technician does not know it. sizes_mm: outer side of each marker's
    dark square by id; size_mm is their median. ``stage`` holds the exact truth; the folder
    ``truth`` repeats it in files.
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
    exposure_ms: float
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
    same bytes. Each camera is drawn in a thread of its own; a tick counts one stereo pair. A
    ``Cancelled`` out of the tick leaves unfinished recordings behind.
    """
    stage = build(scenario, seed, codes)
    recordings, truth = folder / "recordings", folder / "truth"
    (recordings / "calibration").mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(len(SIDES)) as pool:
        crew = _Crew(pool, tick, scenario.frames + scenario.board.views)
        boards = _record_board(recordings / "calibration", stage, crew)
        videos = _record_tree(recordings, stage, crew)
    accelerometer = _record_sensor(recordings, stage)
    write_truth(truth, stage)
    return _told(stage, folder, videos, boards, accelerometer)


class _Crew:
    """Lets both cameras work side by side and counts stereo pairs for the tick."""

    def __init__(self, pool: ThreadPoolExecutor, tick: Tick, total: int) -> None:
        self._pool = pool
        self._tick = tick
        self._total = total
        self._done = 0
        self._rays: dict[str, Floats] = {}

    def renderers(self, scene: Scene) -> dict[str, Renderer]:
        """A renderer for each camera; every scene of a stage has the same two cameras."""
        made = self._pool.map(lambda side: Renderer(scene, side, self._rays.get(side)), SIDES)
        out = dict(zip(SIDES, made, strict=True))
        self._rays = {side: out[side].rays for side in SIDES}
        return out

    def pair(self, work: Callable[[str], bytes | None], note: str) -> list[bytes | None]:
        """``work`` for left and right; counts one pair."""
        out = list(self._pool.map(work, SIDES))
        self._done += 1
        self._tick(self._done, self._total, note)
        return out


def _record_tree(folder: Path, stage: Stage, crew: _Crew) -> tuple[Path, Path]:
    frames = {side: frames_of(stage, side) for side in SIDES}
    renderers = crew.renderers(stage.tree)

    def draw(side: str, n: int) -> Grey:
        return renderers[side].frame(n, float(frames[side].exposed_s[n]))

    return _record_videos(folder, stage.scenario, frames, draw, crew)


def _record_board(folder: Path, stage: Stage, crew: _Crew) -> tuple[Path, Path]:
    frames = {side: board_frames(stage, side) for side in SIDES}
    renderers = crew.renderers(stage.board_scene)
    views = stage.board_views

    def draw(side: str, n: int) -> Grey:
        view = views[n if len(views) > 1 else 0]
        return renderers[side].frame(n, float(frames[side].exposed_s[n]), (view,))

    if stage.scenario.board.video_fps is None:
        return _record_stills(folder, stage.scenario, draw, crew)
    return _record_videos(folder, stage.scenario, frames, draw, crew)


def _record_videos(
    folder: Path, scenario: Scenario, frames: dict[str, Frames], draw: Draw, crew: _Crew
) -> tuple[Path, Path]:
    """Both cameras' videos, pair by pair; dropped frames leave a gap in the stamps."""
    quality, size = scenario.encoding.video_quality, scenario.cameras.size_px
    fps = scenario.cameras.left.fps
    paths = (folder / "left.nut", folder / "right.nut")
    with MjpegWriter(paths[0], size, fps) as left, MjpegWriter(paths[1], size, fps) as right:
        for n in range(frames["left"].exposed_s.size):

            def picture(side: str, n: int = n) -> bytes | None:
                return jpeg(draw(side, n), quality) if frames[side].delivered[n] else None

            both = crew.pair(picture, "drawing frames")
            for side, writer, data in zip(SIDES, (left, right), both, strict=True):
                if data is not None:
                    writer.write(data, int(frames[side].stamp_us[n]))
    return paths


def _record_stills(folder: Path, scenario: Scenario, draw: Draw, crew: _Crew) -> tuple[Path, Path]:
    code = scenario.encoding
    paths = (folder / "left", folder / "right")
    for path in paths:
        path.mkdir(exist_ok=True)
    for n in range(scenario.board.views):

        def still(side: str, n: int = n) -> None:
            name = f"{side}_{n:02d}{code.still_suffix}"
            write_still(folder / side / name, draw(side, n), code.still_quality)

        crew.pair(still, "drawing the board")
    return paths


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
    folder: Path,
    videos: tuple[Path, Path],
    boards: tuple[Path, Path],
    accelerometer: Path | None,
) -> SimulatedTrial:
    scenario = stage.scenario
    sizes = {m.id: m.size_mm for m in stage.markers}
    rows = scenario.cameras.row_time_s
    told, sensor = scenario.cameras.row_times_told, scenario.sensor
    return SimulatedTrial(
        recordings=folder / "recordings",
        left=videos[0],
        right=videos[1],
        calibration_left=boards[0],
        calibration_right=boards[1],
        board=stage.board.spec,
        markers=scenario.markers.library,
        ids=scenario.markers.ids,
        size_mm=round(float(np.median(list(sizes.values()))), 3),
        sizes_mm=sizes,
        places={m.id: m.place for m in stage.markers},
        shutter="rolling" if any(rows) else "global",
        row_time_us=_in_us(rows) if any(rows) and told else None,
        exposure_ms=round(scenario.cameras.optics.exposure_s * 1e3, 9),
        band_hz=scenario.band_hz,
        accelerometer=accelerometer,
        accelerometer_marker=None if sensor is None else sensor.marker,
        truth=folder / "truth",
        stage=stage,
    )


def _in_us(rows_s: tuple[float, float]) -> tuple[float, float]:
    """Row times as a person writes them: without the last digits of a product."""
    left, right = rows_s
    return round(left * 1e6, 9), round(right * 1e6, 9)
