"""What a fitted drawing reports of a marker that its rows see bent, against rendered pictures."""

from __future__ import annotations

import numpy as np
import pytest
from simulation_scenes import camera, lean, scene

from olivevib.detection.template_reader import TemplateReader
from olivevib.geometry import apply_homography, homography
from olivevib.marker import load_library
from olivevib.reconstruction.motion.drawing import Pattern, edges, nodes, reported
from olivevib.simulation import Body, Motion, Renderer
from olivevib.simulation.planar import marker_planar
from olivevib.simulation.scene import seen_at

LIBRARY = load_library("olive49")
STONES = LIBRARY.layout.cornerstones
DARK = LIBRARY.layout.pattern(LIBRARY.codes[4])
POSE = np.array([[3.9, 0.5, 300.0], [-0.3, 3.6, 220.0], [2e-4, -3e-4, 1.0]])


def test_edges_are_those_between_unlike_modules():
    square = np.ones((3, 3), dtype=np.bool_)
    places, along = edges(square)
    assert len(places) == 12
    upright = along[:, 1] == 1
    assert np.allclose(np.abs(places[upright, 0]), 1.5)
    assert np.allclose(np.abs(places[~upright, 1]), 1.5)


def test_a_move_that_a_homography_can_follow_is_reported_as_it_is():
    moved = POSE + np.array([[0.004, 0.002, 0.01], [0.003, -0.005, 0.02], [1e-6, 2e-6, 0]])
    places = nodes(len(DARK))
    by_node = apply_homography(moved, places) - apply_homography(POSE, places)
    by_stone = apply_homography(moved, STONES) - apply_homography(POSE, STONES)
    told = reported(POSE, DARK, STONES) @ by_node.ravel()
    assert np.abs(told - by_stone.ravel()).max() < 2e-3 * np.abs(by_stone).max()


def test_a_marker_needs_a_size():
    with pytest.raises(ValueError, match="module_mm"):
        Pattern(DARK, 0.0)


@pytest.mark.parametrize("tilt", [0.0, 40.0])
def test_a_bent_marker_is_reported_as_rendered_pictures_show(tilt):
    """75 m/s² and 0.5 m/s while rows of 28 µs pass: corners miss by several 0.001 px."""
    size_mm, place = 70.0, np.array([-40.0, 20.0, 1400.0])
    cam = camera(row_time_s=2.8e-5)
    middle = 2.8e-5 * cam.project(place[None])[0, 1]

    def shaken(t_s):
        t = np.asarray(t_s)[:, None] - middle
        return t * [500.0, 200, 0, 0, 0, 0] + 0.5 * t**2 * [75e3, 30e3, 0, 0, 0, 0]

    planar = marker_planar("olive49", int(LIBRARY.ids[4]), size_mm, LIBRARY)
    body = Body(planar, lean(tilt, 0.6, 0.2), place, Motion((shaken,)))
    grey = Renderer(scene(cam, body), "left").frame(0, 0.0)
    flat = STONES * size_mm / 11
    true = seen_at(cam, body, np.zeros(1), flat)[0][0]
    found = TemplateReader(LIBRARY).fit(grey, homography(STONES, true), (4, 0, 0))
    assert found is not None
    H = homography(STONES, TemplateReader(LIBRARY).detection(found).corners_px)
    places = nodes(len(DARK))
    at_nodes = seen_at(cam, body, np.zeros(1), places * size_mm / 11)[0][0]
    left = reported(H, DARK, STONES) @ (apply_homography(H, places) - at_nodes).ravel()
    plain = apply_homography(H, STONES) - true
    rms = np.sqrt(np.mean(plain**2)), np.sqrt(np.mean(left**2))
    assert rms[0] > 0.003
    assert rms[1] < 0.001
