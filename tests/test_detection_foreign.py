"""Foreign markers: ids, orientation, accuracy and honesty of the edges on rendered scenes."""

import numpy as np
import pytest
from scenes import aruco_pattern, draw_square, square_pose

from olivevib.detection import Detection, Detector
from olivevib.geometry import diagonal_crossing
from olivevib.marker import load_library

CENTRE = np.array([80.0, 80.0])


@pytest.fixture(scope="module")
def detector() -> Detector:
    return Detector(load_library("aruco:DICT_4X4_50"))


def view(rng, size_px, tilt_deg, marker=3, **kinds):
    corners = square_pose(size_px, tilt_deg, rng) + CENTRE + rng.uniform(-1, 1, 2)
    return corners, draw_square(aruco_pattern(marker), corners, (160, 160), rng, **kinds)


@pytest.mark.parametrize("inverted", [False, True])
def test_reads_the_id_and_keeps_the_printed_corner_order(detector, inverted):
    rng = np.random.default_rng(3)
    for marker in (0, 7, 31):
        corners, image = view(rng, 60, 30, marker, inverted=inverted)
        (found,) = detector.detect(image)
        assert found.id == marker
        assert np.abs(found.corners_px - corners).max() < 0.2
        assert found.localiser == "template"
        assert found.flags == ()


def collect(detector, size_px, tilt_deg, n=60) -> tuple[np.ndarray, np.ndarray, list[Detection]]:
    rng = np.random.default_rng(int(size_px * 100 + tilt_deg))
    errors, centres, found = [], [], []
    for _ in range(n):
        corners, image = view(rng, size_px, tilt_deg)
        for d in detector.detect(image):
            if d.flags:
                continue
            errors.append((d.corners_px - corners).ravel())
            centres.append(d.centre_px - diagonal_crossing(corners))
            found.append(d)
    return np.array(errors), np.array(centres), found


@pytest.mark.parametrize(("size_px", "tilt_deg"), [(32, 0), (48, 45), (64, 60)])
def test_edges_are_accurate_and_their_covariance_is_honest(detector, size_px, tilt_deg):
    errors, centres, found = collect(detector, size_px, tilt_deg)
    assert len(found) >= 58
    assert np.sqrt(np.mean(centres**2)) < 0.025  # cv2 contour: 0.05-0.08 px on such scenes
    z = errors / np.sqrt([np.diag(d.corners_cov_px2) for d in found])
    assert 0.6 < np.sqrt(np.mean(z**2)) < 1.7
    q = [c @ np.linalg.solve(d.centre_cov_px2, c) for c, d in zip(centres, found, strict=True)]
    assert 1.0 < np.mean(q) < 3.5  # 2 for an ideal 2 x 2 covariance


def test_a_covered_edge_is_flagged_not_hidden(detector):
    rng = np.random.default_rng(8)
    image = draw_square(
        aruco_pattern(3), np.array([[50, 50], [110, 50], [110, 110], [50, 110.0]]), (160, 160), rng
    )
    image[46:54, 50:110] = rng.integers(0, 255, (8, 60))
    for d in detector.detect(image):
        assert "unrefined" in d.flags


def test_wrong_arrays_are_refused(detector):
    with pytest.raises(ValueError, match="grey image"):
        detector.detect(np.zeros((10, 10, 3), np.uint8))


def test_nothing_in_noise(detector):
    rng = np.random.default_rng(0)
    assert detector.detect(rng.integers(0, 255, (240, 320)).astype(np.uint8)) == []
