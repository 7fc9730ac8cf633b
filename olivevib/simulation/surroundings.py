"""What is around the markers: leaves behind and before them, limbs, and the light on the scene."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Floats, floats
from olivevib.simulation.motion import Motion

Image = NDArray[np.float32]  # (H, W), grey levels or a factor
Project = Callable[[Floats], Floats]  # points (N, 3) of the left camera's frame to pixels (N, 2)

LARGEST_LEAF_PX = 40.0
SHIFT_BITS = 4  # cv2 draws on a grid of 1/16 px


@dataclass(frozen=True)
class Leaf:
    """An olive leaf before the markers: an ellipse that faces the camera and may sway."""

    centre_mm: Floats  # (3,) in the left camera's frame
    half_mm: tuple[float, float]  # half length, half width
    turn_rad: float
    dn: float
    motion: Motion = field(default_factory=Motion)

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre_mm", floats("centre_mm", self.centre_mm, (3,)))


@dataclass(frozen=True)
class Limb:
    """A piece of trunk or branch at rest, behind the markers: a thick line."""

    from_mm: Floats
    to_mm: Floats
    radius_mm: float
    dn: float


@dataclass(frozen=True)
class Dapple:
    """Sun through a moving crown: patches of shadow with soft edges that wander over the scene."""

    light_in_shadow: float = 0.35
    patch_px: float = 60.0
    edge_px: float = 4.0
    reach_px: float = 60.0  # how far the patches wander
    f_hz: float = 0.4


@dataclass(frozen=True)
class Surroundings:
    """All that is neither camera nor marker; the light is a factor on everything seen.

    gradient: the light runs from 1 - gradient to 1 + gradient across the picture, along
    gradient_rad.
    """

    backdrop_dn: float = 110.0
    leaves: int = 0  # behind the markers
    blur_px: float = 2.0  # defocus of what is behind the markers
    limbs: tuple[Limb, ...] = ()
    front: tuple[Leaf, ...] = ()
    gradient: float = 0.0
    gradient_rad: float = 0.0
    dapple: Dapple | None = field(default=None)


def backdrop(around: Surroundings, size_px: tuple[int, int], project: Project, seed: int) -> Image:
    """The still picture behind the markers, DN (H, W); the same leaves for every camera."""
    width, height = size_px
    rng = np.random.default_rng([seed, 11])
    picture = np.full((height, width), around.backdrop_dn, dtype=np.float32)
    picture += np.linspace(25, -25, height, dtype=np.float32)[:, None]
    leaves = _leaf_cloud(around.leaves, rng)
    for centre, half, turn, dn in leaves:
        _draw_leaf(picture, project, centre, half, turn, dn)
    for limb in around.limbs:
        _draw_limb(picture, project, limb)
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), around.blur_px), dtype=np.float32)


def _leaf_cloud(count: int, rng: np.random.Generator) -> list[tuple[Floats, Floats, float, float]]:
    centres = rng.uniform([-2600, -1500, 1700], [2600, 1500, 3200], (count, 3))
    halves = np.column_stack([rng.uniform(25, 45, count), rng.uniform(6, 11, count)])
    turns = rng.uniform(0, 180, count)
    tones = rng.uniform(35, 190, count)
    order = np.argsort(-centres[:, 2])
    return [(centres[i], halves[i], float(turns[i]), float(tones[i])) for i in order]


def _draw_leaf(
    picture: Image, project: Project, centre: Floats, half: Floats, turn_deg: float, dn: float
) -> None:
    ends = project(
        np.vstack([centre, centre + np.array([half[0], 0, 0]), centre + np.array([0, half[1], 0])])
    )
    if not np.isfinite(ends).all() or np.abs(ends).max() > 2e4:
        return
    axes = np.linalg.norm(ends[1:] - ends[0], axis=1)
    if axes.max() > LARGEST_LEAF_PX:  # so far off the axis that the lens model folds over
        return
    scale = 1 << SHIFT_BITS
    where = tuple(int(v) for v in np.rint(ends[0] * scale))
    size = tuple(max(int(v), 1) for v in np.rint(axes * scale))
    box = (where, size)
    cv2.ellipse(picture, *box, turn_deg, 0, 360, dn, cv2.FILLED, cv2.LINE_8, SHIFT_BITS)


def _draw_limb(picture: Image, project: Project, limb: Limb) -> None:
    ends = np.vstack([limb.from_mm, limb.to_mm])
    side = np.array([limb.radius_mm, 0.0, 0.0])
    px = project(np.vstack([ends, ends[:1] + side]))
    if not np.isfinite(px).all():
        return
    thick = max(round(2 * float(np.linalg.norm(px[2] - px[0]))), 1)
    a, b = (tuple(int(v) for v in np.rint(p)) for p in px[:2])
    cv2.line(picture, a, b, limb.dn, thick)


@dataclass(frozen=True)
class Outline:
    """The ellipse that a leaf fills in a picture: centre (2,), half axes and turn, px and rad."""

    centre_px: Floats
    a_px: float
    b_px: float
    turn_rad: float

    def inward(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """1 - radius (positive inside) and its slope per px, at pixels x, y of any shape."""
        x, y = x - self.centre_px[0], y - self.centre_px[1]
        c, s = np.cos(self.turn_rad), np.sin(self.turn_rad)
        u, v = (c * x + s * y) / self.a_px, (c * y - s * x) / self.b_px
        radius = np.hypot(u, v)
        return 1 - radius, np.hypot(u / self.a_px, v / self.b_px) / np.maximum(radius, 1e-9)


def outline(leaf: Leaf, t_s: float, project: Project) -> Outline | None:
    """Where a leaf is in a picture at time t; None: behind the camera."""
    centre = leaf.centre_mm + leaf.motion(t_s)[0, :3]
    spots = project(np.vstack([centre, centre + np.array([1.0, 0, 0])]))
    if not np.isfinite(spots).all():
        return None
    scale = float(np.linalg.norm(spots[1] - spots[0]))
    a, b = leaf.half_mm
    return Outline(spots[0], a * scale, b * scale, leaf.turn_rad)


def cover(leaf: Leaf, t_s: float, project: Project, psf_px: float) -> tuple[Floats, Image] | None:
    """How much a leaf covers at time t: corner (x, y) of a box and its alpha (h, w); None: unseen.

    The ellipse's edge is blurred with the lens: alpha = Phi(distance / psf), with the distance
    to first order.
    """
    from scipy.special import ndtr

    found = outline(leaf, t_s, project)
    if found is None:
        return None
    reach = int(np.ceil(max(found.a_px, found.b_px) + 4 * psf_px)) + 1
    corner = np.floor(found.centre_px) - reach
    steps = np.arange(2 * reach + 1, dtype=np.float64)
    inward, slope = found.inward(steps + corner[0], (steps + corner[1])[:, None])
    alpha = ndtr(inward / np.maximum(slope * psf_px, 1e-9))
    return corner, alpha.astype(np.float32)


def covered_share(leaves: tuple[Leaf, ...], t_s: float, project: Project, px: Floats) -> float:
    """Share of the pixels (N, 2) that lie under a leaf at time t."""
    hidden = np.zeros(len(px), dtype=np.bool_)
    for leaf in leaves:
        found = outline(leaf, t_s, project)
        if found is not None:
            hidden |= found.inward(px[:, 0], px[:, 1])[0] > 0
    return float(hidden.mean()) if len(px) else 0.0


def gradient_light(around: Surroundings, size_px: tuple[int, int]) -> Image | None:
    """The steady light as a factor (H, W), None where it is even."""
    if around.gradient == 0:
        return None
    width, height = size_px
    c, s = np.cos(around.gradient_rad), np.sin(around.gradient_rad)
    x = np.linspace(-1, 1, width)[None] * c + np.linspace(-1, 1, height)[:, None] * s
    light: Image = (1 + around.gradient * x / (abs(c) + abs(s))).astype(np.float32)
    return light


def dapple_canopy(dapple: Dapple, size_px: tuple[int, int], seed: int) -> Image:
    """The pattern of light under the crown, larger than the picture by the reach on each side."""
    from scipy.special import expit

    pad = int(np.ceil(dapple.reach_px)) + 2
    width, height = size_px[0] + 2 * pad, size_px[1] + 2 * pad
    rng = np.random.default_rng([seed, 12])
    step = max(dapple.patch_px / 4, 1.0)
    coarse = rng.standard_normal((int(height / step) + 2, int(width / step) + 2)).astype(np.float32)
    smoothed = np.asarray(cv2.GaussianBlur(coarse, (0, 0), 1.2), dtype=np.float32)
    fine = cv2.resize(smoothed / smoothed.std(), (width, height), interpolation=cv2.INTER_CUBIC)
    slope = 1.4 / dapple.patch_px  # typical change of the field per px
    lit = expit((fine - 0.1) / (slope * dapple.edge_px / 2))
    light: Image = (dapple.light_in_shadow + (1 - dapple.light_in_shadow) * lit).astype(np.float32)
    return light


def dapple_light(dapple: Dapple, canopy: Image, size_px: tuple[int, int], t_s: float) -> Image:
    """The light at time t (H, W): the canopy's pattern, wandering smoothly."""
    pad = int(np.ceil(dapple.reach_px)) + 2
    w = 2 * np.pi * dapple.f_hz * t_s
    dx = pad + 0.9 * dapple.reach_px * np.sin(w)
    dy = pad + 0.5 * dapple.reach_px * np.sin(0.63 * w + 1.0)
    move = np.array([[1.0, 0.0, dx], [0.0, 1.0, dy]])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpAffine(canopy, move, size_px, flags=flags), dtype=np.float32)
