"""Twelve faults that technicians make, seeded into sound recordings: named, and no false alarm."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Floats, Grey
from olivevib.calibration import (
    Board,
    BoardView,
    Calibration,
    CalibrationSettings,
    calibrate,
    diagnose,
    parse_board,
)
from olivevib.calibration.trust import cautions_of, judge_rig, sides_mm
from olivevib.errors import Caution, InputError
from olivevib.geometry import CameraModel, StereoRig, rotation_from_vector
from olivevib.pipeline.recordings import check_counts, check_sizes
from olivevib.progress import Tick
from olivevib.signals import fit_stamps
from olivevib.simulation.boards import board_planar
from olivevib.simulation.render import Renderer
from olivevib.simulation.scene import Body, Camera, Optics, Scene
from olivevib.simulation.surroundings import Surroundings
from olivevib.studies.calibration import scenes
from olivevib.studies.study import Cell, Effort, Goal, Study, Table

CHARUCO = "charuco:4x5,square=54,marker=40.5,dict=DICT_4X4_1000"
PICTURES = 6


@dataclass(frozen=True)
class Seeded:
    """One fault: the codes or causes that name it, what was said, and the remedy."""

    fault: str
    wanted: tuple[str, ...]
    said: tuple[str, ...]
    text: str
    remedy: str

    @property
    def named(self) -> bool:
        """Whether one of the wanted words was said, with a remedy (or none is needed)."""
        return bool(set(self.wanted) & set(self.said)) and bool(self.remedy)


def run(effort: Effort, tick: Tick) -> Study:
    """Seed every fault; then look for alarms on sound recordings."""
    seeded = []
    faults = _faults()
    for n, (name, fault) in enumerate(faults.items()):
        tick(n, len(faults), name)
        seeded.append(fault(effort))
    from olivevib.studies.calibration.alarms import sound_recordings

    alarms = sound_recordings(effort, tick)
    named = sum(s.named for s in seeded)
    false = sum(bool(a.false) for a in alarms)
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (s.fault, "yes" if s.named else "NO", ", ".join(s.said), s.text, s.remedy) for s in seeded
    )
    sound: tuple[tuple[Cell, ...], ...] = tuple(
        (a.recording, ", ".join(a.false) or "none", "; ".join(a.right) or "none") for a in alarms
    )
    return Study(
        name="calibration-faults",
        title="Twelve seeded faults, and alarms on sound recordings",
        tables=(
            Table("Faults", ("fault", "named", "as", "told", "remedy"), rows),
            Table("Sound recordings", ("recording", "false alarms", "right, and why"), sound),
        ),
        goals=(
            Goal("seeded faults named with a remedy", "12 of 12", f"{named} of {len(seeded)}",
                 named == len(seeded)),
            Goal("false alarms", "none", f"{false} of {len(alarms)} recordings", false == 0),
        ),
    )  # fmt: skip


def _faults() -> dict[str, Callable[[Effort], Seeded]]:
    return {
        "mirrored video": _looked("mirrored video", _flip, CHARUCO, CHARUCO, ("mirrored",)),
        "turned by 90 degrees": _turned,
        "inverted board": _looked(
            "inverted board", _same, CHARUCO + ",inverted", CHARUCO, ("inverted",)
        ),
        "wrong rows and columns": _looked(
            "wrong rows and columns", _same, CHARUCO, CHARUCO.replace("4x5", "5x4"),
            ("wrong-counts",),
        ),
        "wrong square size": _wrong_size,
        "cameras swapped": _swapped,
        "other resolution": _other_size,
        "frame counts differ": _counts,
        "late camera": _late,
        "all frontal": _frontal,
        "bent board": _bent,
        "focus changed": _focus,
    }  # fmt: skip


# --- faults that pictures show


def pictures(board: Board, count: int, rng: np.random.Generator) -> list[Grey]:
    """Rendered stills of a board in various tilts, 640 x 480 px."""
    planar = board_planar(board)
    size = (640, 480)
    K = np.array([[620.0, 0, 318.0], [0, 620.0, 242.0], [0, 0, 1]])
    camera = Camera(CameraModel(size, K, np.zeros(5)), Optics(psf_px=0.7))
    middle = board.points_mm.mean(axis=0)
    out = []
    for k in range(count):
        R = scenes.tilt(rng)
        place = np.array([*rng.uniform(-30, 30, 2), rng.uniform(650, 850)]) - R @ middle
        scene = Scene(camera, camera, (Body(planar, R, place),), Surroundings(), k + 1)
        out.append(Renderer(scene, "left").frame(k, 0.0, scene.bodies))
    return out


def _same(grey: Grey) -> Grey:
    return grey


def _flip(grey: Grey) -> Grey:
    return np.ascontiguousarray(grey[:, ::-1])


def _looked(
    fault: str,
    change: Callable[[Grey], Grey],
    printed: str,
    declared: str,
    wanted: tuple[str, ...],
) -> Callable[[Effort], Seeded]:
    def seed(effort: Effort) -> Seeded:
        some = pictures(parse_board(printed), PICTURES, effort.draws(len(fault)))
        found = diagnose(parse_board(declared), [change(grey) for grey in some])
        return Seeded(fault, wanted, (found.cause,), found.text, found.remedy)

    return seed


def _turned(effort: Effort) -> Seeded:
    try:
        check_sizes({"left": (1280, 720), "right": (720, 1280)})
    except InputError as error:
        return _told("turned by 90 degrees", ("turned",), error)
    return Seeded("turned by 90 degrees", ("turned",), (), "", "")


def _other_size(effort: Effort) -> Seeded:
    try:
        check_sizes({"left": (1280, 720), "right": (640, 480)})
    except InputError as error:
        return _told("other resolution", ("other modes",), error)
    return Seeded("other resolution", ("other modes",), (), "", "")


def _told(fault: str, wanted: tuple[str, ...], error: InputError) -> Seeded:
    said = tuple(
        word
        for word, sign in (("turned", "turned by 90"), ("other modes", "different modes"))
        if sign in error.why
    )
    return Seeded(fault, wanted, said, f"{error.what} {error.why}", error.remedy)


# --- faults that the numbers show


def _cautioned(fault: str, wanted: tuple[str, ...], cautions: Sequence[Caution]) -> Seeded:
    mine = [c for c in cautions if c.code in wanted] or list(cautions)
    text, remedy = (mine[0].text, mine[0].remedy) if mine else ("", "")
    return Seeded(fault, wanted, tuple(c.code for c in cautions), text, remedy)


def recording(effort: Effort, where: int, rig: StereoRig | None = None, **how: float):  # type: ignore[no-untyped-def]
    """Board views of a simulated pair; ``how`` changes the waving."""
    waving = replace(scenes.Waving(15.0, 6.0), **how)
    return scenes.waved(rig or scenes.converging("0.10/-0.20"), waving, effort.draws(80, where))


def solved(left: Sequence[BoardView], right: Sequence[BoardView], **more: object) -> Calibration:
    """The calibration of a simulated pair."""
    settings = replace(CalibrationSettings(), **more)  # type: ignore[arg-type]
    return calibrate(left, right, scenes.SIZE, scenes.SIZE, settings)


def _wrong_size(effort: Effort) -> Seeded:
    """The trial's own markers, of known size, contradict a board whose squares are 3 % smaller."""
    left, right = recording(effort, 1)
    wrong = [[replace(v, board_mm=1.03 * v.board_mm) for v in views] for views in (left, right)]
    rig = solved(wrong[0], wrong[1]).rig
    told = cautions_of(judge_rig(rig, *_markers(effort)))
    return _cautioned("wrong square size", ("marker-size-contradicts",), told)


def _markers(effort: Effort) -> tuple[Floats, Floats, Floats]:
    """Corners (6, 4, 2) of a trial's markers in the left and the right image, sides (6, 4)."""
    true, rng = scenes.converging("0.10/-0.20"), effort.draws(81)
    corners = 30.0 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    places = rng.uniform([-250, -150, 1000], [250, 150, 1300], (6, 3))
    xyz = np.array([corners @ scenes.tilt(rng).T + place for place in places])
    flat = xyz.reshape(-1, 3)
    a, b = true.left.project(flat), true.right.project(true.to_right(flat))
    return a.reshape(-1, 4, 2), b.reshape(-1, 4, 2), sides_mm(xyz)


def _swapped(effort: Effort) -> Seeded:
    """The trial's recordings are exchanged; the rig is that of the pair as it stands."""
    rig = solved(*recording(effort, 2)).rig
    left, right, true_mm = _markers(effort)
    told = cautions_of(judge_rig(rig, right, left, true_mm))
    return _cautioned("cameras swapped", ("recordings-swapped",), told)


def _counts(effort: Effort) -> Seeded:
    fits = {"left": fit_stamps(np.arange(100) / 30), "right": fit_stamps(np.arange(80) / 30)}
    told = check_counts({"left": 100, "right": 80}, fits)
    return _cautioned("frame counts differ", ("frame-counts-differ",), told)


def _late(effort: Effort) -> Seeded:
    return _cautioned(
        "late camera", ("late-camera",), solved(*recording(effort, 3, lag_s=0.04)).cautions
    )


def _frontal(effort: Effort) -> Seeded:
    rig, board, rng = scenes.converging("0.10/-0.20"), scenes.grid(), effort.draws(82)
    sides: list[list[BoardView]] = [[], []]
    for k in range(24):
        R = rotation_from_vector([*(0.03 * rng.standard_normal(2)), 0.0])
        X = (board - board.mean(axis=0)) @ R.T + [*rng.uniform(-150, 150, 2), 1150.0]
        for side, px in zip(
            sides, (rig.left.project(X), rig.right.project(rig.to_right(X))), strict=True
        ):
            noisy = px + 0.1 * rng.standard_normal(px.shape)
            side.append(BoardView(k, float("nan"), np.arange(25), noisy, board, np.full(25, 0.1)))
    told = solved(sides[0], sides[1]).cautions
    return _cautioned("all frontal", ("frontal-views", "focal-uncertain"), told)


def _bent(effort: Effort) -> Seeded:
    """A board that bulges by 1.5 mm at its edge."""
    rig, board, rng = scenes.converging("0.10/-0.20"), scenes.grid(), effort.draws(83)
    bulge = board.copy()
    bulge[:, 2] += 1.5 * ((board[:, 0] - 90) / 90) ** 2
    sides: list[list[BoardView]] = [[], []]
    for k in range(40):
        R = scenes.tilt(rng)
        X = (bulge - board.mean(axis=0)) @ R.T + [
            *rng.uniform(-150, 150, 2),
            rng.uniform(800, 1300),
        ]
        for side, px in zip(
            sides, (rig.left.project(X), rig.right.project(rig.to_right(X))), strict=True
        ):
            noisy = px + 0.1 * rng.standard_normal(px.shape)
            side.append(BoardView(k, float("nan"), np.arange(25), noisy, board, np.full(25, 0.1)))
    return _cautioned("bent board", ("bent-board",), solved(sides[0], sides[1]).cautions)


def _focus(effort: Effort) -> Seeded:
    """The right camera's focus changes by 2 % in the middle of the recording."""
    rig = scenes.converging("0.10/-0.20")
    lens = rig.right.lens * np.array([1.02, 1.02, 1, 1, 1, 1])
    other = replace(rig, right=rig.right.with_lens(lens))
    left, right = recording(effort, 4)
    _, later = recording(effort, 4, other)
    middle = right[len(right) // 2].frame
    mixed = [v for v in right if v.frame < middle] + [v for v in later if v.frame >= middle]
    told = solved(left, mixed).cautions
    return _cautioned("focus changed", ("halves-contradict",), told)
