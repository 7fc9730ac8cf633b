"""Amplitudes that grow while the machine runs, seen in the pixels or told by the fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_motion_parts import anchor_of, scene

from olivevib.reconstruction.motion import MotionSettings, fit_motion, uneven_words
from olivevib.studies.blind_scenes import Scene, rig, sight
from olivevib.vibration.types import LineStatus

NEAR = MotionSettings(band_hz=(16.0, 44.0), band_declared=True)


def fitted(s, seed=0):
    return fit_motion(sight(s, rig(), np.random.default_rng(seed)), rig(), anchor_of(s), NEAR)


class GrowingScene(Scene):
    """A shaker whose amplitude grows by a third from start to end."""

    def motion(self, marker, t_s):
        slow = replace(self, amplitude=np.zeros_like(self.amplitude))
        own = Scene.motion(self, marker, t_s) - Scene.motion(slow, marker, t_s)
        size = 1 + 0.3 * (t_s / self.span_s - 0.5)
        return Scene.motion(slow, marker, t_s) + size[..., None] * own


def test_a_growing_amplitude_is_followed():
    s = GrowingScene(**vars(scene(25.3)))
    fit = fitted(s)
    assert fit.status is LineStatus.CONFIRMED
    assert fit.growth == pytest.approx(0.15, abs=0.02)
    (told,) = uneven_words(fit)
    assert told.startswith("The amplitude grows by 3")  # 35 % = 1.15 / 0.85 - 1
    assert fit.chi2 < 1.3
    at = np.linspace(0.2, 3.8, 300)
    error = fit.evaluate(at).xyz_mm[:, 0] - s.motion(0, at)[:, :3]
    error -= error.mean(axis=0)
    assert error[:, :2].std() < 0.04
    e = 1e-4
    bend = (s.motion(0, at + e) - 2 * s.motion(0, at) + s.motion(0, at - e))[:, :3] / e**2 * 1e-3
    difference = fit.evaluate(at).acceleration_m_s2[:, 0] - bend
    assert difference[:, :2].std() < 0.02 * np.abs(bend).max()


def test_a_growth_that_looks_like_sway_does_not_shift_the_frequency():
    """At 31.1 Hz the line appears at 1.1 Hz: a spline hides the growth, the frequency pays."""
    s = replace(scene(31.1, mm=3.5, offset_s=-0.014, span_s=4.5), kind="growing")
    z, growth = [], []
    for seed in range(6):
        fit = fitted(s, seed)
        z.append((fit.f_hz - s.f_hz) / fit.timing.sigma("frequency_hz"))
        growth.append(fit.growth)
    assert np.sqrt(np.mean(np.square(z))) < 2.0
    assert np.mean(growth) == pytest.approx(0.1, abs=0.02)


def test_the_growths_own_sigma_widens_what_it_moves():
    even = fitted(replace(scene(31.1, mm=3.5, offset_s=-0.014, span_s=4.5), kind="steady"))
    grown = fitted(replace(scene(31.1, mm=3.5, offset_s=-0.014, span_s=4.5), kind="growing"))
    assert even.growth == 0.0
    assert grown.timing.sigma("frequency_hz") > 1.2 * even.timing.sigma("frequency_hz")
    assert grown.branches.f_hz[0] == grown.f_hz


def test_a_wandering_speed_is_told_and_an_even_run_needs_no_words():
    even = fitted(scene(25.3))
    assert uneven_words(even) == ()
    wandering = fitted(scene(21.3, kind="wandering"))
    (told,) = uneven_words(wandering)
    assert told.startswith("The speed wanders from 20.")
    assert "to 21." in told
