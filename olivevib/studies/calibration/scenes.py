"""Board recordings with known truth: points of a hand-held board projected into two cameras."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Bools, Floats
from olivevib.calibration import BoardView
from olivevib.geometry import CameraModel, StereoRig, rotation_from_vector

SIZE = (1280, 720)
LENSES = {"none": (0.0, 0.0), "0.10/-0.20": (0.10, -0.20), "-0.33/0.10": (-0.33, 0.10)}
BASE_MM, DISTANCE_MM = 420.0, 1200.0


def camera(f: float, k1: float, k2: float, centre: tuple[float, float]) -> CameraModel:
    """A camera of 1280 x 720 px."""
    K = np.array([[f, 0, centre[0]], [0, f, centre[1]], [0, 0, 1.0]])
    return CameraModel(SIZE, K, np.array([k1, k2, 0, 0, 0.0]))


def grid(columns: int = 5, rows: int = 5, pitch_mm: float = 45.0) -> Floats:
    """Board points (N, 3) mm, row by row."""
    x, y = np.meshgrid(np.arange(columns) * pitch_mm, np.arange(rows) * pitch_mm)
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])


def converging(lens: str) -> StereoRig:
    """Two cameras 420 mm apart that look at a point 1.2 m away."""
    k1, k2 = LENSES[lens]
    angle = 2 * np.arctan(BASE_MM / 2 / DISTANCE_MM)
    R = rotation_from_vector([0.01, angle, -0.015])
    c = np.array([BASE_MM * np.cos(angle / 2), 3.0, BASE_MM * np.sin(angle / 2)])
    left, right = camera(990, k1, k2, (646, 354)), camera(978, k1, k2, (632, 366))
    return StereoRig(left, right, R, -R @ c)


def tilted(
    lens: CameraModel, board: Floats, count: int, noise_px: float, rng: np.random.Generator
) -> list[BoardView]:
    """Stills of one camera: tilts of 8 to 35 degrees to all sides, 500 to 900 mm away, in view."""
    views: list[BoardView] = []
    middle, tries = board.mean(axis=0), 0
    while len(views) < count and tries < 500 * count:
        tries += 1
        R = tilt(rng)
        px_at = rng.uniform([0.2 * SIZE[0], 0.2 * SIZE[1]], [0.8 * SIZE[0], 0.8 * SIZE[1]])
        t = lens.ray(px_at[None])[0] * rng.uniform(500, 900) - R @ middle
        px = lens.project(board @ R.T + t)
        if np.isfinite(px).all() and (px > 2).all() and (px < np.array(SIZE) - 3).all():
            noisy = px + noise_px * rng.standard_normal(px.shape)
            ids, nan = np.arange(len(board)), float("nan")
            views.append(
                BoardView(len(views), nan, ids, noisy, board, np.full(len(board), noise_px))
            )
    return views


def tilt(rng: np.random.Generator) -> Floats:
    """A rotation that tilts by 8 to 35 degrees to a random side, and rolls a little."""
    angle, side = np.radians(rng.uniform(8, 35)), rng.uniform(0, 2 * np.pi)
    lean = rotation_from_vector([angle * np.cos(side), angle * np.sin(side), 0.0])
    return lean @ rotation_from_vector([0.0, 0.0, rng.uniform(-0.4, 0.4)])


@dataclass(frozen=True)
class Waving:
    """How a board is waved before two cameras; hold, move: stop-and-go, s (0: never stops)."""

    seconds: float = 20.0
    fps: float = 30.0
    noise_px: float = 0.1
    lag_s: float = 0.0
    readout_s: float = 0.0
    hold_s: float = 0.0
    move_s: float = 0.0


def waved(
    rig: StereoRig, how: Waving, rng: np.random.Generator
) -> tuple[list[BoardView], list[BoardView]]:
    """Board views of both cameras, with stamps; the right camera is late by ``lag_s``."""
    board = grid()
    hand = _Hand.of(rng, how)
    stamps = np.arange(int(how.seconds * how.fps)) / how.fps
    sides = []
    for right in (False, True):
        t = stamps - (how.lag_s if right else 0.0)
        px = _seen(rig, right, hand, board, t, how.readout_s)
        px = px + how.noise_px * rng.standard_normal(px.shape)
        with np.errstate(invalid="ignore"):
            ok: Bools = np.asarray(((px > 2) & (px < np.array(SIZE) - 3)).all(axis=2))
        sides.append([
            BoardView(k, float(stamps[k]), np.flatnonzero(ok[k]), px[k][ok[k]], board[ok[k]],
                      np.full(int(ok[k].sum()), how.noise_px))
            for k in range(stamps.size) if ok[k].sum() >= 8
        ])  # fmt: skip
    return sides[0], sides[1]


@dataclass(frozen=True)
class _Hand:
    amplitude: Floats  # (6, 3) rad, mm
    f_hz: Floats
    phase: Floats
    how: Waving

    @classmethod
    def of(cls, rng: np.random.Generator, how: Waving) -> _Hand:
        reach = np.array([0.28, 0.28, 0.12, 130, 80, 130])[:, None]
        amplitude = reach * rng.uniform(0.5, 1.0, (6, 3))
        return cls(amplitude, rng.uniform(0.15, 0.6, (6, 3)), rng.uniform(0, 6.28, (6, 3)), how)

    def pose(self, t_s: Floats) -> tuple[Floats, Floats]:
        """Rotations (N, 3, 3) and places (N, 3) of the board's middle."""
        t = self._held(t_s)
        s = (self.amplitude * np.sin(2 * np.pi * self.f_hz * t[:, None, None] + self.phase)).sum(-1)
        return rotation_from_vector(s[:, :3]), s[:, 3:] + np.array([0.0, 0, DISTANCE_MM - 100])

    def _held(self, t_s: Floats) -> Floats:
        hold, move = self.how.hold_s, self.how.move_s
        if hold == 0:
            return t_s
        n, rest = np.divmod(t_s, hold + move)
        x = np.clip((rest - hold) / move, 0, 1)
        return np.asarray(0.7 * (n + x**3 * (10 - 15 * x + 6 * x * x)), dtype=np.float64)


def _seen(
    rig: StereoRig, right: bool, hand: _Hand, board: Floats, t_s: Floats, readout_s: float
) -> Floats:
    """Pixels (T, N, 2); each point at its own row's instant."""
    at = np.repeat(t_s[:, None], len(board), axis=1)
    px = _project(rig, right, hand, board, at)
    for _ in range(4 if readout_s else 0):
        row = np.nan_to_num(px[:, :, 1], nan=SIZE[1] / 2)
        px = _project(rig, right, hand, board, at + readout_s * (row / SIZE[1] - 0.5))
    return px


def _project(rig: StereoRig, right: bool, hand: _Hand, board: Floats, t_s: Floats) -> Floats:
    R, place = hand.pose(t_s.ravel())
    local = np.tile(board - board.mean(axis=0), (len(t_s), 1))
    X = np.einsum("nij,nj->ni", R, local) + place
    px = rig.right.project(rig.to_right(X)) if right else rig.left.project(X)
    return px.reshape(*t_s.shape, 2)
