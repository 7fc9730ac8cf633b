"""Small rendered scenes with known truth for the numeric tests."""

import cv2
import numpy as np

from olivevib.geometry import homography, rotation_from_vector


def square_pose(size_px: float, tilt_deg: float, rng: np.random.Generator) -> np.ndarray:
    """Corners (4, 2), clockwise, of a square of that frontal size, tilted and turned at random."""
    turn, azimuth = rng.uniform(0, 2 * np.pi, 2)
    axis = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    R = rotation_from_vector(np.radians(tilt_deg) * axis) @ rotation_from_vector([0, 0, turn])
    s = size_px / 2
    P = np.array([[-s, -s, 0], [s, -s, 0], [s, s, 0], [-s, s, 0]]) @ R.T + [0, 0, 900]
    return P[:, :2] / P[:, 2:] * 900


def draw_square(
    pattern: np.ndarray,
    corners: np.ndarray,
    size: tuple[int, int],
    rng: np.random.Generator,
    noise: float = 2.0,
    psf: float = 0.7,
    inverted: bool = False,
) -> np.ndarray:
    """An image (H, W) of a dark-on-light module pattern (True = dark) at those outer corners.

    Drawn at eight samples a pixel, blurred by the PSF, averaged, with Gaussian noise, 8 bit.
    """
    over, cell, margin = 8, 40, 2
    n = pattern.shape[0]
    card = np.pad(np.where(pattern, 0.0, 255.0), margin, constant_values=255.0)
    card = np.kron(card, np.ones((cell, cell))).astype(np.float32)
    near, far = margin * cell - 0.5, (margin + n) * cell - 0.5
    source = np.array([[near, near], [far, near], [far, far], [near, far]])
    H = homography(source, (corners + 0.5) * over - 0.5)
    width, height = size
    big = cv2.warpPerspective(card, H, (width * over, height * over), borderValue=255.0)
    big = cv2.GaussianBlur(big, (0, 0), psf * over)
    image = big.reshape(height, over, width, over).mean(axis=(1, 3))
    image = 40 + image / 255 * 170
    image = (250 - image if inverted else image) + rng.normal(0, noise, image.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


def aruco_pattern(marker: int, dictionary: int = cv2.aruco.DICT_4X4_50) -> np.ndarray:
    """The modules of an ArUco marker, True = dark."""
    table = cv2.aruco.getPredefinedDictionary(dictionary)
    n = table.markerSize + 2
    return cv2.aruco.generateImageMarker(table, marker, n) < 128
