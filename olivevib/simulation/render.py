"""One camera's pictures of a scene: every row at its own time, every edge area-averaged.

A print is sampled on a grid of SUB x SUB points a pixel in each sub-exposure, each row with the
pose of its own time; the sum is filtered by the pixel's area and what the lens's blur
leaves after the texture's own, and laid over the backdrop. Light, noise, gamma and rounding follow.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Floats, Grey
from olivevib.simulation.planar import Planar
from olivevib.simulation.scene import Body, Camera, Scene
from olivevib.simulation.surroundings import (
    Image,
    Leaf,
    backdrop,
    cover,
    dapple_canopy,
    dapple_light,
    gradient_light,
)
from olivevib.simulation.texture import Texture, Textures

SUB = 4  # samples a pixel and axis
REACH = 4.5  # blur kernels end at this many sigma
BORDER_PX = 40  # how far beyond the picture viewing rays are tabulated

Box = tuple[int, int, int, int]  # x0, y0, x1, y1 in px, ends excluded


class Renderer:
    """Draws the frames of one camera; a frame depends on scene, frame number and time alone.

    ``rays`` may be those of another renderer of the same camera: they take a second to tabulate.
    """

    def __init__(self, scene: Scene, side: str, rays: Floats | None = None) -> None:
        self._scene = scene
        self._camera: Camera = scene.left if side == "left" else scene.right
        self._salt = 1 if side == "left" else 2
        self._textures: dict[int, Textures] = {}
        self.rays = _ray_table(self._camera) if rays is None else rays
        size, around = self._camera.model.size_px, scene.surroundings
        self._backdrop = backdrop(around, size, self._camera.project, scene.seed)
        self._gradient = gradient_light(around, size)
        dapple = around.dapple
        self._canopy = None if dapple is None else dapple_canopy(dapple, size, scene.seed)

    def frame(self, number: int, exposed_s: float, bodies: tuple[Body, ...] | None = None) -> Grey:
        """The picture (H, W) uint8 whose row 0 is exposed around ``exposed_s``.

        ``bodies`` stand in for the scene's own; ``number`` chooses the noise.
        """
        optics = self._camera.optics
        light = self.light(exposed_s, bodies)
        rng = np.random.Generator(np.random.SFC64([self._scene.seed, self._salt, number]))
        if optics.read_noise_dn > 0 or optics.shot_noise_dn > 0:
            noise = rng.standard_normal(light.shape, dtype=np.float32)
            sigma = np.maximum(light, 0)
            sigma *= optics.shot_noise_dn
            sigma += optics.read_noise_dn**2
            noise *= np.sqrt(sigma, out=sigma)
            light += noise
        if optics.gamma != 1:
            np.clip(light, 0, None, out=light)
            light /= 255
            np.power(light, np.float32(1 / optics.gamma), out=light)
            light *= 255
        np.rint(light, out=light)
        return np.clip(light, 0, 255, out=light).astype(np.uint8)

    def light(self, exposed_s: float, bodies: tuple[Body, ...] | None = None) -> Image:
        """The noise-free picture (H, W) in grey levels before gamma."""
        around = self._scene.surroundings
        picture = self._backdrop.copy()
        order = sorted(
            self._scene.bodies if bodies is None else bodies, key=lambda b: -float(b.t0_mm[2])
        )
        for body in order:
            self._lay(picture, body, exposed_s)
        for leaf in around.front:
            self._lay_leaf(picture, leaf, exposed_s)
        if self._gradient is not None:
            picture *= self._gradient
        if around.dapple is not None and self._canopy is not None:
            size = self._camera.model.size_px
            picture *= dapple_light(around.dapple, self._canopy, size, exposed_s)
        return picture

    def _lay_leaf(self, picture: Image, leaf: Leaf, exposed_s: float) -> None:
        found = cover(leaf, exposed_s, self._camera.project, self._camera.optics.psf_px)
        if found is None:
            return
        corner, alpha = found
        x0, y0 = int(corner[0]), int(corner[1])
        box = _inside((x0, y0, x0 + alpha.shape[1], y0 + alpha.shape[0]), self._camera)
        if box is None:
            return
        part = picture[box[1] : box[3], box[0] : box[2]]
        over = alpha[box[1] - y0 : box[3] - y0, box[0] - x0 : box[2] - x0]
        part += over * (np.float32(leaf.dn) - part)

    def _lay(self, picture: Image, body: Body, exposed_s: float) -> None:
        found = reach(self._camera, body, exposed_s)
        if found is None:
            return
        box, path_px = found
        white, card = self.card(body, exposed_s, box, path_px)
        optics = self._camera.optics
        dark = np.float32(optics.dark_dn * body.shade)
        contrast = np.float32((optics.white_dn - optics.dark_dn) * body.shade)
        part = picture[box[1] : box[3], box[0] : box[2]]
        part *= 1 - card
        part += dark * card + contrast * white

    def card(self, body: Body, exposed_s: float, box: Box, path_px: float) -> tuple[Image, Image]:
        """Share of white and share of card in each pixel of ``box``, exposure and blur included."""
        camera = self._camera
        stretch = _stretch(camera, body, exposed_s)
        texture = self._textures_of(body.planar).at(stretch)
        kernels, pad = _kernels(camera, texture, stretch)
        x0, y0, x1, y1 = box
        wide = (x0 - pad, y0 - pad, x1 + pad, y1 + pad)
        shape = (2, (wide[3] - wide[1]) * SUB, (wide[2] - wide[0]) * SUB)
        fine = np.zeros(shape, dtype=np.float32)
        offsets = camera.optics.moments_s(path_px)
        for offset in offsets:
            self._sample(fine, body, exposed_s + float(offset), wide, texture)
        fine /= np.float32(len(offsets))
        white, part = _to_pixels(fine, kernels, (y1 - y0, x1 - x0), pad)
        return white, part

    def _textures_of(self, planar: Planar) -> Textures:
        key = id(planar)  # Textures keeps the print alive, so no other takes its id
        if key not in self._textures:
            self._textures[key] = Textures(planar)
        return self._textures[key]

    def _sample(
        self, fine: NDArray[np.float32], body: Body, t_s: float, box: Box, texture: Texture
    ) -> None:
        """Add white and card of the print at one instant (per row) to the fine grid."""
        x0, y0, x1, y1 = (v + BORDER_PX for v in box)
        X, Y = self.rays[:, y0:y1, x0:x1]
        row_time = self._camera.model.row_time_s
        rows = np.arange(box[1], box[3], dtype=np.float64) if row_time else np.zeros(1)
        times: Floats = t_s + row_time * rows
        back = plane_from_ray(self._camera, body, times)[:, :, :, None]
        # Linear in X and Y, so that linear interpolation is exact but for the lens's curvature.
        size = fine.shape[:0:-1]
        mm = [back[:, i, 0] * X + back[:, i, 1] * Y + back[:, i, 2] for i in (0, 1, 2)]
        w = _upsampled(mm[2], size)
        maps = []
        for i in (0, 1):
            texels = (mm[i] - texture.origin_mm[i] * mm[2]) / texture.texel_mm[i]
            maps.append(_upsampled(texels, size) / w)
        for k, image in enumerate((texture.white, texture.card)):
            fine[k] += cv2.remap(image, maps[0], maps[1], cv2.INTER_LINEAR)


def _upsampled(values: Floats, size: tuple[int, ...]) -> Image:
    """Values at pixel centres, linearly at the SUB x SUB points of each pixel."""
    small = values.astype(np.float32)
    return np.asarray(cv2.resize(small, size, interpolation=cv2.INTER_LINEAR), dtype=np.float32)


def plane_from_ray(camera: Camera, body: Body, t_s: Floats) -> Floats:
    """Homographies (N, 3, 3) from viewing directions (X, Y, 1) to the print's plane, mm."""
    R, t = body.pose(t_s)
    R_camera, t_camera = camera.R @ R, t @ camera.R.T + camera.t_mm
    forward = np.concatenate([R_camera[:, :, :2], t_camera[:, :, None]], axis=2)
    out: Floats = np.linalg.inv(forward)
    return out


def _ray_table(camera: Camera) -> Floats:
    """X and Y (2, H, W) of the viewing directions of all pixel centres, border included."""
    width, height = camera.model.size_px
    x = np.arange(-BORDER_PX, width + BORDER_PX, dtype=np.float64)
    y = np.arange(-BORDER_PX, height + BORDER_PX, dtype=np.float64)
    px = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    rays = camera.model.ray(px)[:, :2].T.reshape(2, y.size, x.size)
    return np.ascontiguousarray(rays)


def _inside(box: Box, camera: Camera) -> Box | None:
    width, height = camera.model.size_px
    x0, y0, x1, y1 = max(box[0], 0), max(box[1], 0), min(box[2], width), min(box[3], height)
    return (x0, y0, x1, y1) if x1 > x0 and y1 > y0 else None


def reach(camera: Camera, body: Body, exposed_s: float) -> tuple[Box, float] | None:
    """The pixels that the card can reach during the exposure, and how far it goes in px.

    None: it is out of the picture.
    """
    corners = body.planar.card_corners_mm
    middle = camera.project(body.points_mm(exposed_s, corners)[0])
    if not np.isfinite(middle).all():
        return None
    rows = np.array([middle[:, 1].min(), middle[:, 1].max()])
    times = exposed_s + camera.model.row_time_s * rows
    moments = times + camera.optics.exposure_s * np.linspace(-0.5, 0.5, 5)[:, None]
    px = camera.project(body.points_mm(moments.ravel(), corners).reshape(-1, 3))
    if not np.isfinite(px).all():
        return None
    rim = 2 + REACH * camera.optics.psf_px
    low, high = np.floor(px.min(axis=0) - rim), np.ceil(px.max(axis=0) + rim) + 1
    if np.abs([low, high]).max() > 1e6:
        return None
    box = _inside((int(low[0]), int(low[1]), int(high[0]), int(high[1])), camera)
    steps = np.diff(px.reshape(5, 2, 4, 2), axis=0)
    path = float(np.linalg.norm(steps, axis=-1).sum(axis=0).max())
    return None if box is None else (box, path)


def _stretch(camera: Camera, body: Body, exposed_s: float) -> Floats:
    """Derivative (2 px, 2 mm) of the picture of the print's centre by the place on the print."""
    centre = body.points_mm(exposed_s, np.zeros((1, 2)))[0]
    row = float(camera.project(centre)[0, 1])
    t = np.array([exposed_s + camera.model.row_time_s * (row if np.isfinite(row) else 0.0)])
    R, place = body.pose(t)
    point = place @ camera.R.T + camera.t_mm
    by_point = camera.model.project_jacobian(point)[1][0]
    out: Floats = by_point @ camera.R @ R[0][:, :2]
    return out


def _kernels(
    camera: Camera, texture: Texture, stretch: Floats
) -> tuple[tuple[Floats, Floats], int]:
    """Filters along x and y on the fine grid: pixel area times the blur that is left to add."""
    done = (stretch**2 @ texture.variance_mm2)[:2]  # px² along x, y
    left = np.maximum(camera.optics.psf_px**2 - done + 1 / (12 * SUB**2), 0.05**2)
    kernels = tuple(_kernel(float(np.sqrt(v)) * SUB) for v in left)
    longest = max(k.size for k in kernels)
    return (kernels[0], kernels[1]), int(np.ceil((longest - SUB) / 2 / SUB)) + 1


def _kernel(sigma: float) -> Floats:
    """The sum of SUB samples, blurred with ``sigma`` samples; symmetric, its sum is 1."""
    ends = int(np.ceil(REACH * sigma))
    x = np.arange(-ends, ends + 1)
    blur = np.exp(-0.5 * (x / sigma) ** 2)
    kernel = np.convolve(blur, np.ones(SUB))
    out: Floats = kernel / kernel.sum()
    return out


def _to_pixels(
    fine: NDArray[np.float32], kernels: tuple[Floats, Floats], shape: tuple[int, int], pad: int
) -> NDArray[np.float32]:
    """Filter the fine grid (C, H, W) and keep one value a pixel, (C, h, w)."""
    rows, columns = shape
    start = pad * SUB - (kernels[1].size - SUB) // 2
    tall = np.zeros((fine.shape[0], rows, fine.shape[2]), dtype=np.float32)
    for k, weight in enumerate(kernels[1]):
        tall += np.float32(weight) * fine[:, start + k : start + k + SUB * rows : SUB]
    start = pad * SUB - (kernels[0].size - SUB) // 2
    out = np.zeros((fine.shape[0], rows, columns), dtype=np.float32)
    for k, weight in enumerate(kernels[0]):
        out += np.float32(weight) * tall[:, :, start + k : start + k + SUB * columns : SUB]
    return out
