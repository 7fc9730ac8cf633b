"""From a scenario and a seed to scenes: cameras, markers on a tree, board views."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats
from olivevib.calibration.boards import Board, parse_board
from olivevib.geometry import CameraModel, rotation_from_vector
from olivevib.marker import MarkerLibrary
from olivevib.simulation import motion
from olivevib.simulation.boards import board_planar
from olivevib.simulation.motion import Motion, Sway
from olivevib.simulation.planar import Planar, foreign_dictionary, marker_planar
from olivevib.simulation.scenarios import Release, Scenario, Shaking, ToyCars
from olivevib.simulation.scene import Body, Camera, Scene
from olivevib.simulation.surroundings import Leaf, Limb, Surroundings

# Where random streams part, so that one choice does not move the others.
RIG, PLACES, MOTION, BOARD, LEAVES, STAMPS, SENSOR = range(7)
PITCH_RAD = 0.05  # the left camera looks down a little


def stream(seed: int, what: int) -> np.random.Generator:
    """The random numbers for one purpose of one trial."""
    return np.random.default_rng([seed, 100 + what])


@dataclass(frozen=True)
class Marker:
    """One marker on the tree: what it is and where it sits."""

    id: int
    size_mm: float
    place: str  # "trunk", "branch", "fixed"
    body: Body


@dataclass(frozen=True)
class Stage:
    """The scenes of one trial: the tree with its markers, and the views of the board.

    ``board_views`` holds one body per still, or a single moving one for a video.
    """

    scenario: Scenario
    seed: int
    markers: tuple[Marker, ...]
    tree: Scene
    board: Board
    board_scene: Scene
    board_views: tuple[Body, ...]
    down: Floats  # direction of gravity in the left camera's frame


def build(scenario: Scenario, seed: int, codes: MarkerLibrary | None = None) -> Stage:
    """The stage of a scenario; the same scenario and seed give the same stage.

    ``codes`` is the library of our own markers; without it the shipped one is taken where the
    scenario or its board needs one.
    """
    board = parse_board(scenario.board.spec)
    if codes is None and (foreign_dictionary(scenario.markers.library) is None or _coded(board)):
        from olivevib.marker import load_library

        codes = load_library("olive49")
    left, right = cameras(scenario, stream(seed, RIG))
    markers = _markers(scenario, seed, codes)
    bodies = tuple(m.body for m in markers)
    tree = Scene(left, right, bodies, _around(scenario, markers, seed), seed)
    light = Surroundings(leaves=scenario.light.leaves, blur_px=scenario.light.blur_px)
    indoors = Scene(left, right, (), light, seed + 1)
    views = _board_views(scenario, board_planar(board, codes), indoors, stream(seed, BOARD))
    down = np.array([0.0, np.cos(PITCH_RAD), np.sin(PITCH_RAD)])
    return Stage(scenario, seed, markers, tree, board, indoors, views, down)


def _coded(board: Board) -> bool:
    return board.kind == "coded"


def cameras(scenario: Scenario, rng: np.random.Generator) -> tuple[Camera, Camera]:
    """Two webcams that look at the same spot, with their own small faults of lens and mounting."""
    plan, inward = scenario.cameras, _inward(scenario)
    tweak = rng.normal(0, 0.006, 3)
    R = rotation_from_vector(tweak) @ rotation_from_vector([0.0, 2 * inward, 0.0])
    centre = rotation_from_vector([0.0, -inward, 0.0]) @ np.array([plan.baseline_mm, 0.0, 0.0])
    centre = centre + rng.normal(0, 3.0, 3)
    models = [_lens(scenario, k, rng) for k in (0, 1)]
    left = Camera(models[0], plan.optics, plan.left)
    return left, Camera(models[1], plan.optics, plan.right, R, -R @ centre)


def _lens(scenario: Scenario, side: int, rng: np.random.Generator) -> CameraModel:
    plan = scenario.cameras
    width, height = plan.size_px
    f = plan.focal_px * (1 + rng.normal(0, 0.01))
    cx = (width - 1) / 2 + rng.normal(0, 6)
    cy = (height - 1) / 2 + rng.normal(0, 6)
    K = np.array([[f, 0, cx], [0, f * (1 + rng.normal(0, 0.001)), cy], [0, 0, 1]])
    bend = np.array([0.06 + rng.normal(0, 0.01), -0.12 + rng.normal(0, 0.02), 0, 0, 0])
    row_time = plan.row_time_s[side]
    source = "declared" if row_time else "global"
    return CameraModel(plan.size_px, K, bend, row_time, 0.0, source)


def _markers(scenario: Scenario, seed: int, codes: MarkerLibrary | None) -> tuple[Marker, ...]:
    plan, rng = scenario.markers, stream(seed, PLACES)
    wanders = stream(seed, MOTION)
    spots = _spots(len(plan.ids), plan.distance_mm, rng)
    out = []
    for k, number in enumerate(plan.ids):
        size = round(float(rng.uniform(*plan.size_mm)), 1)
        leant = _facing(rng.uniform(*plan.tilt_deg), rng.uniform(0, 360), rng.normal(0, 12))
        R0 = _towards_both(scenario) @ leant
        place = "trunk" if abs(spots[k, 0]) < 200 else "branch"
        moves = _motion(scenario, k, place, wanders)
        planar = marker_planar(plan.library, number, size, codes)
        shade = float(rng.uniform(0.9, 1.05))
        body = Body(planar, R0, spots[k], moves, shade)
        if isinstance(scenario.what, ToyCars):
            body, place = _car(scenario.what, k, planar, plan.distance_mm), "fixed"
        out.append(Marker(number, size, place, body))
    return tuple(out)


def _spots(count: int, distance_mm: float, rng: np.random.Generator) -> Floats:
    """Places (N, 3) in two rows around the spot at which both cameras look."""
    columns = (count + 1) // 2
    row, column = np.divmod(np.arange(count), columns)
    x = (column - (columns - 1) / 2) * 240.0
    y = (row - 0.5) * 300.0
    spots = np.column_stack([x, y, np.full(count, distance_mm)])
    out: Floats = spots + rng.uniform([-30, -25, -60], [30, 25, 60], (count, 3))
    return out


def _inward(scenario: Scenario) -> float:
    """How far each camera is turned in, rad."""
    half = scenario.cameras.baseline_mm / 2
    return float(np.arctan2(half, scenario.markers.distance_mm))


def _towards_both(scenario: Scenario) -> Floats:
    """The rotation of a print that faces the middle between the cameras."""
    out: Floats = rotation_from_vector([0.0, -_inward(scenario), 0.0])
    return out


def _common_x(scenario: Scenario, z_mm: float) -> float:
    """The x at distance z in the middle of what both cameras see."""
    return scenario.cameras.baseline_mm / 2 * (1 - z_mm / scenario.markers.distance_mm)


def _facing(tilt_deg: float, azimuth_deg: float, roll_deg: float) -> Floats:
    azimuth, tilt, roll = np.radians([azimuth_deg, tilt_deg, roll_deg])
    lean = rotation_from_vector(tilt * np.array([np.cos(azimuth), np.sin(azimuth), 0.0]))
    out: Floats = lean @ rotation_from_vector([0.0, 0.0, roll])
    return out


def _motion(scenario: Scenario, k: int, place: str, rng: np.random.Generator) -> Motion:
    what = scenario.what
    if isinstance(what, Shaking):
        return _shaken(what, place, rng)
    if isinstance(what, Release):
        gain = 0.5 + 0.5 * (k + 1) / len(scenario.markers.ids)
        aside = np.array([0.9, -0.3, 0.25]) * what.held_mm * gain
        turned = rng.normal(0, 0.02 * gain, 3)
        held = np.concatenate([aside, turned])
        return Motion((motion.Release(what.f_hz, what.damping, what.start_s, held),))
    return Motion()


def _shaken(what: Shaking, place: str, rng: np.random.Generator) -> Motion:
    """The trunk's orbit is mostly level; branches move more, later and in their own direction."""
    branch = place == "branch"
    gain = rng.uniform(1.2, 1.6) if branch else rng.uniform(0.95, 1.05)
    lag = rng.uniform(0.2, 0.9) if branch else rng.uniform(-0.03, 0.03)
    long = np.array([1.0, 0.2, 0.15]) + rng.normal(0, 0.15 if branch else 0.02, 3)
    short = np.array([0.1, 0.25, 0.5]) + rng.normal(0, 0.15 if branch else 0.02, 3)
    turn = what.rotation_rad * rng.normal(0, 0.6, (2, 3)) * gain
    one = np.concatenate([what.trunk_mm * gain * long, turn[0]])
    two = np.concatenate([what.trunk_mm * gain * short, turn[1]])
    c, s = np.cos(lag), np.sin(lag)
    cos, sin = one * c - two * s, one * s + two * c
    twice = what.harmonic * rng.uniform(-1, 1, (2, 6)) * np.hypot(cos, sin)
    terms: list[motion.Term] = [
        motion.Shake(what.f_hz, what.phases, cos, sin, twice[0], twice[1]),
        _sway(what.sway_mm * gain, rng.uniform(0.7, 1.1), rng),
    ]
    if branch and what.decay_mm > 0:
        swing = np.concatenate([what.decay_mm * rng.normal(0, 0.7, 3), rng.normal(0, 0.004, 3)])
        hz, damping = rng.uniform(2.2, 4.5), rng.uniform(0.03, 0.06)
        terms.append(motion.Decay(hz, damping, what.phases.stop_s, swing))
    return Motion(tuple(terms))


def _sway(size_mm: float, f_hz: float, rng: np.random.Generator) -> Sway:
    slow = np.array([1.0, 0.3, 0.6, 0, 0, 0]) * size_mm
    slow[3:] = 0.0005 * size_mm
    return Sway(f_hz, slow, rng.uniform(0, 2 * np.pi, 6))


def _car(what: ToyCars, k: int, planar: Planar, distance_mm: float) -> Body:
    """A car on a level table seen from 50° above it; the first track is the outer one."""
    flat = rotation_from_vector([np.radians(-40.0), 0.0, 0.0])
    axes = flat[:, :2].T
    radii = np.array([330.0, 210.0]) if k == 0 else np.array([190.0, 110.0])
    lap = motion.Lap(axes, radii, what.lap_s * (1 + 0.2 * k), 0.1 + 0.45 * k, 0.25)
    return Body(planar, flat, np.array([0.0, 0.0, distance_mm]), Motion((lap,)))


def _around(scenario: Scenario, markers: tuple[Marker, ...], seed: int) -> Surroundings:
    light = scenario.light
    return Surroundings(
        leaves=light.leaves,
        blur_px=light.blur_px,
        limbs=() if isinstance(scenario.what, ToyCars) else _limbs(markers),
        front=_front_leaves(markers, light.front_leaves, stream(seed, LEAVES)),
        gradient=light.gradient,
        gradient_rad=0.4,
        dapple=light.dapple,
    )


def _limbs(markers: tuple[Marker, ...]) -> tuple[Limb, ...]:
    """A trunk, and a branch from its fork to behind each marker."""
    fork = np.array([0.0, 150.0, 1560.0])
    behind = np.array([0.0, 0.0, 60.0])
    trunk = Limb(np.array([20.0, 1200.0, 1560.0]), fork, 75.0, 66.0)
    branches = [Limb(fork, m.body.t0_mm + behind, 16.0, 74.0) for m in markers]
    return (trunk, *branches)


def _front_leaves(
    markers: tuple[Marker, ...], each: int, rng: np.random.Generator
) -> tuple[Leaf, ...]:
    """Leaves on the way from the left camera to the rim of each marker, swaying in the wind."""
    out = []
    for marker in markers:
        for _ in range(each):
            turn = rng.uniform(0, 2 * np.pi)
            rim = (
                marker.size_mm * rng.uniform(0.35, 0.75) * np.array([np.cos(turn), np.sin(turn), 0])
            )
            spot = (marker.body.t0_mm + rim) * rng.uniform(0.82, 0.93)
            half = (float(rng.uniform(16, 28)), float(rng.uniform(4, 7)))
            sway = Motion((_sway(float(rng.uniform(4, 12)), rng.uniform(0.6, 1.4), rng),))
            out.append(Leaf(spot, half, float(rng.uniform(0, np.pi)), 75.0, sway))
    return tuple(out)


def _board_views(
    scenario: Scenario, planar: Planar, scene: Scene, rng: np.random.Generator
) -> tuple[Body, ...]:
    if scenario.board.video_fps is not None:
        return (_waved(scenario, planar, rng),)
    views: list[Body] = []
    while len(views) < scenario.board.views:
        body = _held(scenario, planar, rng)
        if all(_whole(camera, body) for camera in (scene.left, scene.right)):
            views.append(body)
    return tuple(views)


def _middle(planar: Planar) -> Floats:
    out: Floats = np.append((planar.card_mm[:2] + planar.card_mm[2:]) / 2, 0.0)
    return out


def _held(scenario: Scenario, planar: Planar, rng: np.random.Generator) -> Body:
    leant = _facing(rng.uniform(8, 38), rng.uniform(0, 360), rng.normal(0, 12))
    R0 = _towards_both(scenario) @ leant
    z = rng.uniform(*scenario.board.distance_mm)
    x = _common_x(scenario, z) + rng.uniform(-0.42, 0.42) * z
    centre = np.array([x, rng.uniform(-0.27, 0.27) * z, z])
    return Body(planar, R0, centre - R0 @ _middle(planar))


def _whole(camera: Camera, body: Body) -> bool:
    """Whether the whole card is in the picture, 12 px from its rim."""
    px = camera.project(body.points_mm(0.0, body.planar.card_corners_mm)[0])
    size = np.array(camera.model.size_px)
    return bool(np.isfinite(px).all() and (px > 12).all() and (px < size - 13).all())


def _waved(scenario: Scenario, planar: Planar, rng: np.random.Generator) -> Body:
    """A board waved slowly through the common field, turning about all three axes."""
    near, far = scenario.board.distance_mm
    z = (near + far) / 2
    middle = np.array([_common_x(scenario, z), 0.0, z])
    reach = np.array([0.30 * near, 0.10 * near, (far - near) / 2])
    phases = rng.uniform(0, 2 * np.pi, (3, 6))
    terms = (
        Sway(0.29, np.array([reach[0], 0, 0, 0.42, 0, 0]), phases[0]),
        Sway(0.43, np.array([0, reach[1], 0, 0, 0.45, 0]), phases[1]),
        Sway(0.17, np.array([0, 0, reach[2], 0, 0, 0.3]), phases[2]),
    )
    centred = planar.moved(-_middle(planar)[:2])
    return Body(centred, _towards_both(scenario), middle, Motion(terms))
