"""Simulated board recordings with known truth for the calibration tests: projected points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.calibration.views import BoardView
from olivevib.geometry import CameraModel, StereoRig, rotation_from_vector

SIZE = (1280, 720)


def camera(f=990.0, k1=0.1, k2=-0.2, cx=646.0, cy=354.0, aspect=1.0):
    K = np.array([[f, 0, cx], [0, f * aspect, cy], [0, 0, 1.0]])
    return CameraModel(SIZE, K, np.array([k1, k2, 0, 0, 0.0]))


def blank(size=SIZE):
    w, h = size
    return CameraModel(size, np.array([[w, 0, w / 2], [0, w, h / 2], [0, 0, 1.0]]), np.zeros(5))


def rig(base=420.0, distance=1000.0, left=None, right=None):
    """Two cameras converging at ``distance``, the right one to the right."""
    angle = 2 * np.arctan(base / 2 / distance)
    R = rotation_from_vector(np.array([0.01, angle, -0.015]))
    c = np.array([base * np.cos(angle / 2), 3.0, base * np.sin(angle / 2)])
    return StereoRig(left or camera(), right or camera(975.0, 0.08, -0.15, 631.0, 366.0), R, -R @ c)


def grid(n=5, pitch=45.0):
    x, y = np.meshgrid(np.arange(n) * pitch, np.arange(n) * pitch)
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(n * n)])


@dataclass(frozen=True)
class Wave:
    """A hand that waves the board: sums of sines in six freedoms about a middle pose."""

    middle_mm: np.ndarray
    amplitude: np.ndarray  # (6, 3)
    f_hz: np.ndarray
    phase: np.ndarray
    hold: np.ndarray  # stop-and-go: instants (n, 2) when the board stands still

    def pose(self, t, board):
        t = self.warp(np.atleast_1d(t))
        s = (self.amplitude * np.sin(2 * np.pi * self.f_hz * t[:, None, None] + self.phase)).sum(-1)
        R = rotation_from_vector(s[:, :3])
        centre = board.mean(axis=0)
        return R, self.middle_mm + s[:, 3:] - R @ centre

    def warp(self, t):
        if self.hold.size == 0:
            return t
        hold, move = self.hold
        n, rest = np.divmod(t, hold + move)
        x = np.clip((rest - hold) / move, 0, 1)
        return n * 0.7 + 0.7 * (x * x * x * (10 - 15 * x + 6 * x * x))


def wave(rng, distance=1000.0, hold=()):
    amplitude = np.zeros((6, 3))
    amplitude[:2] = rng.uniform(0.15, 0.3, (2, 3))
    amplitude[2] = rng.uniform(0.05, 0.2, 3)
    amplitude[3] = rng.uniform(40, 90, 3)
    amplitude[4] = rng.uniform(25, 60, 3)
    amplitude[5] = rng.uniform(40, 90, 3)
    f = rng.uniform(0.15, 0.6, (6, 3))
    middle = np.array([0.0, 0.0, distance - 80.0])
    return Wave(middle, amplitude, f, rng.uniform(0, 2 * np.pi, (6, 3)), np.array(hold))


def bent(board, bow):
    half = (board.max(axis=0) - board.min(axis=0))[:2].max() / 2
    x, y = ((board[:, :2] - board[:, :2].mean(axis=0)) / half).T
    out = board.copy()
    out[:, 2] += bow[0] * x * x + bow[1] * x * y + bow[2] * y * y
    return out


@dataclass(frozen=True)
class Recording:
    noise_px: float = 0.1
    seconds: float = 20.0
    fps: float = 6.0
    lag_s: float = 0.0
    jitter_s: float = 0.0
    readout_s: float = 0.0
    bow: tuple[float, float, float] = (0.0, 0.0, 0.0)
    hold: tuple[float, ...] = ()
    missing: float = 0.0
    stills: bool = False


def record(rig, rng, what=Recording(), board=None, motion=None):
    """BoardViews of both cameras of a waved board."""
    board = grid() if board is None else board
    motion = motion or wave(rng, hold=what.hold)
    stamps = np.arange(int(what.seconds * what.fps)) / what.fps
    out = []
    for right in (False, True):
        jitter = what.jitter_s * rng.standard_normal(stamps.size) if right else 0.0
        t = stamps - (what.lag_s if right else 0.0) - jitter
        views = []
        px_all = see(rig, right, motion, board, what, t)
        for k in range(stamps.size):
            px = px_all[k] + what.noise_px * rng.standard_normal((len(board), 2))
            ok = (
                np.isfinite(px).all(axis=1)
                & (px > 3).all(axis=1)
                & (px < np.array(SIZE) - 4).all(axis=1)
            )
            ok &= rng.random(len(board)) >= what.missing
            if ok.sum() >= 6:
                stamp = float("nan") if what.stills else stamps[k]
                ids = np.flatnonzero(ok)
                views.append(BoardView(k, stamp, ids, px[ok], board[ok], max(what.noise_px, 0.01)))
        out.append(views)
    return out[0], out[1]


def see(rig, right, motion, board, what, t):
    """Pixels (T, N, 2) with the rolling shutter's own instant for every point."""
    shape = bent(board, what.bow)
    px = project(rig, right, motion, shape, np.repeat(t[:, None], len(board), 1))
    for _ in range(3 if what.readout_s else 0):
        row = np.nan_to_num(px[:, :, 1], nan=0.0)
        px = project(rig, right, motion, shape, t[:, None] + what.readout_s * (row / SIZE[1] - 0.5))
    return px


def project(rig, right, motion, board, t):
    R, tr = motion.pose(t.ravel(), board)
    which = np.tile(np.arange(len(board)), t.shape[0])
    X = np.einsum("nij,nj->ni", R, board[which]) + tr
    cam = rig.right if right else rig.left
    px = cam.project(rig.to_right(X) if right else X)
    return px.reshape(*t.shape, 2)
