"""Blind trials on projected points: shaken markers before two rolling-shutter webcams, no images.

What the solver is given is drawn about the truth with the sigma that it is told.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats, Ints
from olivevib.geometry import CameraModel, StereoRig, rotation_from_vector
from olivevib.reconstruction.motion.observe import gather
from olivevib.reconstruction.motion.sightings import MarkerSightings, Observations, Sightings
from olivevib.reconstruction.motion.types import Anchor

RATE_HZ = 30.0
ROWS = 720
GROWTH = 0.1
KINDS = {"steady": 0.87, "wandering": 0.08, "growing": 0.05}  # shares of the trials
FAR_SHARE, FAR_S = 1 / 6, 0.15  # of trials whose offset nobody knows, and how far it may be
HALF_MM = 27.3  # corner from centre along each axis: 60 mm marker, cornerstones 10/11 apart


@dataclass(frozen=True)
class Scene:
    """The truth of one trial. readout_s of the whole picture, left and right, signed.

    amplitude (M, H, 6) complex of each marker's harmonics; sway: slow sines (f, complex (6,)).
    kind: "steady", "wandering" (speed) or "growing" (by a tenth from the middle to the end).
    """

    f_hz: float
    span_s: float
    readout_s: tuple[float, float]
    offset_s: float
    drift: float
    amplitude: Floats
    sway: tuple[tuple[float, Floats], ...]
    noise_px: float
    common_px: float
    drops: float
    kind: str = "steady"
    offset_known: bool = True

    def phase(self, t_s: Floats) -> Floats:
        """Phase of the machine, rad."""
        wander = 2 * np.pi * 0.4 * (np.cos(2 * np.pi * t_s / self.span_s) * self.span_s / 6.0)
        bend = wander if self.kind == "wandering" else 0.0
        return np.asarray(2 * np.pi * self.f_hz * t_s + bend)

    @property
    def mean_hz(self) -> float:
        """The slope of the phase over the record, as a fit of it finds it."""
        t = np.linspace(0.0, self.span_s - 1 / RATE_HZ, 400)
        return float(np.polyfit(t, self.phase(t), 1)[0] / (2 * np.pi))

    def motion(self, marker: int, t_s: Floats) -> Floats:
        """Xi (..., 6) mm and rad at t_s."""
        out = np.zeros((*t_s.shape, 6))
        phase = self.phase(t_s)
        size = 1.0 + (GROWTH * (2 * t_s / self.span_s - 1) if self.kind == "growing" else 0.0 * t_s)
        for h, a in enumerate(self.amplitude[marker], start=1):
            out += size[..., None] * np.real(a * np.exp(1j * h * phase)[..., None])
        for f, a in self.sway:
            out += np.real(a * np.exp(2j * np.pi * f * t_s)[..., None])
        return out


def rig() -> StereoRig:
    """The standard pair: 950 px, 1280 x 720, 420 mm apart, 1400 mm away, a little distorted."""
    K = np.array([[950.0, 0, 640], [0, 950.0, 360], [0, 0, 1]])
    lens = np.array([-0.08, 0.03, 0.0, 0.0, 0.0])
    R = rotation_from_vector(np.array([0.01, -0.28, 0.005])).T
    t = -R @ np.array([420.0, 3.0, 40.0])
    left, right = (CameraModel((1280, 720), K, lens) for _ in range(2))
    return StereoRig(left, right, R.T.T, t)


def poses(draws: np.random.Generator, count: int) -> list[tuple[Floats, Floats]]:
    """Mean turns and places of the markers within both views."""
    out = []
    for _ in range(count):
        place = np.array(
            [draws.uniform(0, 250), draws.uniform(-250, 250), draws.uniform(1200, 1600)]
        )
        turn = rotation_from_vector(
            np.array([draws.normal(0, 0.3), draws.normal(-0.15, 0.3), draws.normal(0, 0.3)])
        )
        out.append((turn, place))
    return out


def sight(scene: Scene, pair: StereoRig, draws: np.random.Generator) -> Observations:
    """Project every corner at its own instant (fixed point on its row), with noise and drops."""
    places = poses(draws, len(scene.amplitude))
    points = HALF_MM * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype=np.float64)
    frames = np.arange(round(scene.span_s * RATE_HZ))
    views: list[list[Sightings]] = []
    for side in range(2):
        seen = frames[draws.random(frames.size) >= scene.drops]
        zero = seen / RATE_HZ
        views.append(
            [
                _view(scene, pair, (m, side), place, points, (seen, zero), draws)
                for m, place in enumerate(places)
            ]
        )
    markers = tuple(
        MarkerSightings(m, points, views[0][m], views[1][m]) for m in range(len(places))
    )
    return gather(markers)


def _view(
    scene: Scene,
    pair: StereoRig,
    which: tuple[int, int],
    place: tuple[Floats, Floats],
    points: Floats,
    frames: tuple[Ints, Floats],
    draws: np.random.Generator,
) -> Sightings:
    marker, side = which
    seen, zero = frames
    row_time = scene.readout_s[side] / ROWS
    late = scene.offset_s + scene.drift * (zero - scene.span_s / 2)
    start = zero if side == 0 else zero + late
    camera = (pair.left, pair.right)[side]
    row = np.full((seen.size, 4), ROWS / 2.0)
    for _ in range(4):
        xi = scene.motion(marker, start[:, None] + row * row_time)
        q = np.einsum("npij,pj->npi", rotation_from_vector(xi[..., 3:]), points @ place[0].T)
        X = (q + place[1] + xi[..., :3]).reshape(-1, 3)
        px = camera.project(X if side == 0 else pair.to_right(X)).reshape(seen.size, 4, 2)
        row = px[..., 1]
    px = px + draws.normal(0, scene.noise_px, px.shape)
    px = px + draws.normal(0, 1, (seen.size, 1, 2)) * scene.common_px
    cov = np.broadcast_to(np.eye(8) * scene.noise_px**2, (seen.size, 8, 8))
    nothing = np.full(seen.size, np.nan)
    return Sightings(seen, zero, px[..., 1].copy(), px, cov, nothing)


def orbit(draws: np.random.Generator, mm: float, rad: float) -> Floats:
    """A random elliptic orbit in the six axes: complex amplitudes, translation of peak mm."""
    a = draws.normal(size=6) + 1j * draws.normal(size=6)
    a[:3] *= mm / np.linalg.norm(np.abs(a[:3]))
    a[3:] *= rad / np.linalg.norm(np.abs(a[3:]))
    return np.asarray(a)


def draw_scene(draws: np.random.Generator, seconds: float) -> Scene:
    """One blind trial: everything of the knowledge page's numeric validation, zones included."""
    markers = int(draws.choice([1, 1, 2, 3]))
    mm = float(np.exp(draws.uniform(np.log(0.2), np.log(5.0))))
    rad = mm * draws.uniform(0.0, 3e-3)
    second = draws.uniform(0.0, 0.3) if draws.random() < 0.75 else 0.0
    amplitude = np.array(
        [
            [orbit(draws, mm * s, rad * s), second * orbit(draws, mm * s, rad * s)]
            for s in np.exp(draws.normal(0, 0.3, markers))
        ]
    )
    sway = tuple(
        (float(draws.uniform(0.2, 2.0)), orbit(draws, draws.uniform(0, 6), 0.01)) for _ in range(2)
    )
    base = draws.uniform(8e-3, 33e-3)
    near = draws.choice([0.0, draws.uniform(8e-3, 13e-3), draws.uniform(-0.0167, 0.0167)])
    far = draws.uniform(-FAR_S, FAR_S) if draws.random() < FAR_SHARE else None
    readout = (base, base if draws.random() < 0.5 else draws.uniform(8e-3, 33e-3))
    return Scene(
        f_hz=float(draws.uniform(5, 45)),
        span_s=seconds,
        readout_s=readout,
        offset_s=float(near if far is None else far),
        offset_known=far is None,
        drift=float(draws.normal(0, 3e-5)),
        amplitude=amplitude,
        sway=sway,
        noise_px=float(draws.uniform(0.02, 0.1)),
        common_px=float(draws.uniform(0.0, 0.1)) if draws.random() < 0.5 else 0.0,
        drops=float(draws.choice([0.0, 0.0, 0.1])),
        kind=str(draws.choice(list(KINDS), p=list(KINDS.values()))),
    )


def draw_anchor(scene: Scene, draws: np.random.Generator) -> Anchor:
    """Row times and offset as a technician would know them: drawn with the sigma stated."""
    share = float(draws.choice([0.01, 0.02, 0.05]))
    left, right = (r / ROWS for r in scene.readout_s)
    offset_sigma = float(draws.choice([5e-5, 5e-4, 2e-3]))
    offset = scene.offset_s + offset_sigma * draws.normal()
    return Anchor(
        left_row_time_s=left * (1 + share * draws.normal()),
        left_row_time_sigma_s=share * left,
        right_row_time_s=right * (1 + share * draws.normal()),
        right_row_time_sigma_s=share * right,
        row_time_source="led",
        right_offset_s=offset if scene.offset_known else 0.0,
        right_offset_sigma_s=offset_sigma if scene.offset_known else np.inf,
        reference_row=0.0,
        offset_source="calibration" if scene.offset_known else "unknown",
    )
