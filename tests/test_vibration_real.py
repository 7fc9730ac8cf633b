"""Real recordings with known answers: a calibrated shaker, two sensors on one body."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from olivevib.signals import GRAVITY_M_S2, fit_stamps
from olivevib.studies.vibration.records import acceleration
from olivevib.vibration import (
    LineSettings,
    LineStatus,
    SamplingFacts,
    dominant_line,
    find_sensor_phases,
)
from olivevib.vibration.clock import between

pytestmark = pytest.mark.shared
SENSOR = LineSettings(sway=False)


@pytest.fixture(scope="module")
def shaker(shared_data: Path):
    path = shared_data / "accelerometer" / "endaq_ide" / "SSX70065_derived_en.csv"
    table = np.genfromtxt(path, delimiter=",", skip_header=1)
    return acceleration(table[:, 0], table[:, 1:4] * GRAVITY_M_S2)


def test_the_shakers_line_is_99_998_hz_and_10_196_g(shaker):
    rate = fit_stamps(shaker.t_s).rate_hz
    assert rate == pytest.approx(3072.14, abs=0.05)
    facts = SamplingFacts(rate, stamps_true=True, band_hz=(5.0, 200.0))
    line = dominant_line(between(shaker, 4.0, 8.8), facts, SENSOR)
    assert line.status is LineStatus.DIRECT
    assert line.f_hz == pytest.approx(99.998, rel=5e-5)
    assert line.amplitude[1] / GRAVITY_M_S2 == pytest.approx(10.196, rel=5e-4)


def test_the_shakers_slow_ramps_at_its_own_frequency_are_not_all_steady(shaker):
    """It holds 10.2 g from 4.0 to 8.8 s and ramps over 1.5 s before and after, always at 100 Hz."""
    steady = [p for p in find_sensor_phases(shaker) if p.name == "steady"]
    assert len(steady) == 1
    assert 3.2 < steady[0].start_s < 4.0
    assert 8.8 < steady[0].end_s < 9.9


@pytest.mark.parametrize("name", ["chainsaw_1", "machete_1"])
def test_a_tree_under_the_saw_yields_no_false_certainty(shared_data: Path, name: str):
    """333 Hz of integer milliseconds: lines below 45 Hz are direct or none, never a candidate."""
    path = shared_data / "accelerometer" / "tree_mpu6050" / f"{name}.csv"
    table = np.genfromtxt(path, delimiter=",", skip_header=1, usecols=(0, 2, 3, 4))
    fit = fit_stamps(table[:, 0] * 1e-3)
    sensor = acceleration(fit.t_s, table[:, 1:4] / 17050 * GRAVITY_M_S2)
    line = dominant_line(sensor, SamplingFacts(fit.rate_hz, stamps_true=True), SENSOR)
    assert line.status in (LineStatus.DIRECT, LineStatus.NONE)
    if line.status is LineStatus.DIRECT:
        assert 5.0 <= line.f_hz <= 45.0
        assert line.f_sigma_hz < 0.2
