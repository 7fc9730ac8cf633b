"""Fixed markers take the cameras' motion out; markers together show a deflection shape."""

from __future__ import annotations

import numpy as np
import pytest

from olivevib.studies.vibration.records import Tone, displacement
from olivevib.vibration import SamplingFacts, deflection_shape, dominant_line
from olivevib.vibration.fixed import without_camera_motion

T = np.arange(300) / 30
SHAKE = Tone(3.1, np.array([0.4, 0.2, 0.1]), np.array([0.0, 0.5, 1.0]))
TREE = Tone(9.3, np.array([3.0, 1.0, 0.5]), np.zeros(3))
FACTS = SamplingFacts(30.0, band_hz=(2.0, 14.0))


def test_what_the_fixed_markers_show_is_taken_out_of_all():
    motion = {
        1: displacement(T, TREE.at(T) + SHAKE.at(T)),
        8: displacement(T, SHAKE.at(T)),
        9: displacement(T[::2], SHAKE.at(T[::2])),
    }
    free = without_camera_motion(motion, [8])
    np.testing.assert_allclose(free[1].values, TREE.at(T) + SHAKE.at(T).mean(axis=0), atol=1e-12)
    np.testing.assert_allclose(free[8].values, SHAKE.at(T).mean(axis=0) + 0 * T[:, None], atol=1e-9)
    both = without_camera_motion(motion, [8, 9])
    line = dominant_line(both[1], FACTS)
    np.testing.assert_allclose(line.amplitude, TREE.amplitude, atol=5e-3)


def test_frames_without_a_fixed_marker_are_left_out_not_made_up():
    keep = np.ones(300, bool)
    keep[50:80] = False
    motion = {
        1: displacement(T + 0.002, TREE.at(T)),
        8: displacement(T[keep], 0 * TREE.at(T)[keep]),
    }
    free = without_camera_motion(motion, [8])
    np.testing.assert_allclose(free[1].t_s, (T + 0.002)[keep])


def test_unknown_fixed_markers_are_refused_and_none_changes_nothing():
    motion = {1: displacement(T, TREE.at(T))}
    with pytest.raises(ValueError, match=r"\[5\]"):
        without_camera_motion(motion, [5])
    assert without_camera_motion(motion, [])[1] is motion[1]


def test_the_deflection_shape_joins_markers_seen_at_different_times():
    lines = {}
    for marker, (size, lag) in {1: (1.0, 0.0), 2: (0.5, 0.3), 3: (2.0, -1.2)}.items():
        t = T + 0.005 * marker
        tone = Tone(9.3, size * np.array([1.0, 0.2, 0.1]), np.full(3, -lag))
        lines[marker] = dominant_line(displacement(t, tone.at(t)), FACTS)
    found = deflection_shape(lines)
    assert found.ids == (1, 2, 3)
    ratio = found.shape[:, 0] / found.shape[0, 0]
    np.testing.assert_allclose(ratio, [1.0, 0.5 * np.exp(-0.3j), 2 * np.exp(1.2j)], atol=1e-6)
    assert found.shape[2, 0].imag == pytest.approx(0.0, abs=1e-9)


def test_one_marker_has_no_shape():
    assert deflection_shape({1: dominant_line(displacement(T, TREE.at(T)), FACTS)}) is None
