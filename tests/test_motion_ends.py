"""Where the steady part of a record begins and ends, told from its pixels."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from test_motion_parts import anchor_of, scene

from olivevib.reconstruction.motion import fit_motion, steady_ends
from olivevib.reconstruction.motion.decide import CONFIRMED_LEAD
from olivevib.studies.blind_scenes import Scene, rig, sight
from olivevib.vibration.types import LineStatus


def stopping(s: Scene, stop_s: float) -> Scene:
    """The same machine, whose speed falls to nothing within 0.3 s of stop_s."""

    class Stopping(Scene):
        def phase(self, t_s):
            late = np.clip(t_s - stop_s, 0.0, 0.3)
            return 2 * np.pi * self.f_hz * (np.minimum(t_s, stop_s) + late - late**2 / 0.6)

    return Stopping(**{f.name: getattr(s, f.name) for f in fields(Scene)})


@pytest.mark.parametrize("f_hz", [10.703, 30.847])  # seen at 10.7 Hz, and at 0.85 Hz as sway is
def test_a_shut_down_at_the_end_is_cut_from_the_steady_record(f_hz):
    s = stopping(scene(f_hz, mm=2.0, offset_s=0.0105, kind="steady", span_s=5.0), 4.6)
    seen = sight(s, rig(), np.random.default_rng(0))
    ends = steady_ends(seen)
    assert ends is not None
    for span in (ends.left, ends.right):
        assert span[0] == pytest.approx(0.0, abs=0.02)
        assert 4.2 < span[1] < 4.65
    fit = fit_motion(ends.of(seen), rig(), anchor_of(s))
    assert abs(fit.f_hz - f_hz) < 5e-3
    assert fit.chi2 < 1.3


def test_nothing_is_cut_from_a_record_that_is_steady_to_its_ends():
    for f_hz in (10.703, 25.3, 30.847):
        s = scene(f_hz, mm=2.0, kind="steady", span_s=5.0)
        assert steady_ends(sight(s, rig(), np.random.default_rng(0))) is None


@pytest.mark.parametrize("far_s", [4.4, 3.9])
def test_of_a_slow_line_only_the_ramp_is_cut(far_s):
    """A ramp spoils half a second of its neighbours: what is cut at once would be too much."""
    s = stopping(scene(5.471, mm=3.0, offset_s=0.010, kind="steady", span_s=5.0), far_s)
    ends = steady_ends(sight(s, rig(), np.random.default_rng(0)))
    assert ends is not None
    for span in (ends.left, ends.right):
        assert far_s - 0.6 < span[1] < far_s + 0.1


def starting(s: Scene, start_s: float) -> Scene:
    """The same machine, at rest until start_s and at full size 0.8 s later."""

    class Starting(Scene):
        def motion(self, marker, t_s):
            still = Scene(**{f.name: getattr(self, f.name) for f in fields(Scene)})
            whole = still.motion(marker, t_s)
            size = np.clip((t_s - start_s) / 0.8, 0.0, 1.0)[..., None]
            slow = Scene(**{**vars(still), "amplitude": np.zeros_like(still.amplitude)})
            sway = slow.motion(marker, t_s)
            return sway + size * (whole - sway)

    return Starting(**{f.name: getattr(s, f.name) for f in fields(Scene)})


def test_rest_that_was_taken_for_steady_is_left_out():
    """At 32.58 Hz the line looks like sway: the search by windows takes all of it for steady."""
    sharp = scene(32.578, mm=1.1, offset_s=0.0, span_s=9.0, noise_px=0.006, common_px=0.0)
    s = starting(sharp, 1.5)
    seen = sight(s, rig(), np.random.default_rng(0))
    ends = steady_ends(seen)
    assert ends is not None
    for span in (ends.left, ends.right):
        assert 1.9 < span[0] < 4.0
        assert span[1] - span[0] > 4.0
    fit = fit_motion(ends.of(seen), rig(), anchor_of(s))
    assert fit.status is not LineStatus.CHIRP
    assert abs(fit.f_hz - 32.578) < 0.01
    assert fit.branches.lead > CONFIRMED_LEAD
