"""Stamps to counts and times: drops, jitter, late stamps, rates that vary."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from olivevib.signals import Samples, fit_stamps

PERIOD = 1001 / 30000


def kept_counts(rng: np.random.Generator, n: int, drop: float) -> np.ndarray:
    """Counts of the frames that arrive; the first and the last two always do."""
    keep = rng.random(n) >= drop
    keep[[0, -2, -1]] = True
    return np.flatnonzero(keep)


@given(
    n=st.integers(3, 400),
    drop=st.floats(0, 0.3),
    start=st.floats(-1e3, 1e6),
    seed=st.integers(0, 10_000),
)
@settings(deadline=None, max_examples=60)
def test_even_stamps_with_drops_give_the_true_counts(n, drop, start, seed):
    counts = kept_counts(np.random.default_rng(seed), n, drop)
    counts = np.union1d(counts, np.arange(min(n, 2)))
    fit = fit_stamps(start + PERIOD * counts)
    steps = np.diff(counts)
    if np.median(steps) > 1 or steps.min() > 1:
        return  # every second frame lost everywhere: a slower clock explains the stamps as well
    assert fit.method == "line"
    np.testing.assert_array_equal(fit.sequence, counts)
    np.testing.assert_array_equal(fit.dropped, np.setdiff1d(np.arange(counts[-1]), counts))
    np.testing.assert_allclose(fit.t_s, start + PERIOD * counts, atol=1e-7)
    assert fit.rate_hz == pytest.approx(1 / PERIOD, rel=1e-7)


@given(jitter=st.floats(0, 0.09), drop=st.floats(0, 0.1), seed=st.integers(0, 10_000))
@settings(deadline=None, max_examples=40)
def test_jitter_is_no_drop(jitter, drop, seed):
    rng = np.random.default_rng(seed)
    counts = kept_counts(rng, 300, drop)
    noise = np.clip(rng.normal(size=counts.size), -3, 3)
    fit = fit_stamps(PERIOD * (counts + jitter * noise))
    np.testing.assert_array_equal(fit.sequence, counts)
    assert fit.jitter_s <= 1.3 * jitter * PERIOD + 1e-12


def test_a_late_stamp_that_is_made_up_for_is_jitter():
    counts = np.arange(200)
    stamps = PERIOD * counts
    stamps[60] += 0.9 * PERIOD
    stamps[120:123] += np.array([1.8, 1.2, 0.6]) * PERIOD
    fit = fit_stamps(stamps)
    np.testing.assert_array_equal(fit.sequence, counts)
    assert fit.dropped.size == 0
    assert fit.worst_s > PERIOD


def test_lasting_lateness_is_a_drop_even_under_jitter():
    rng = np.random.default_rng(3)
    counts = np.delete(np.arange(250), [80, 81, 170])
    fit = fit_stamps(PERIOD * (counts + np.clip(0.12 * rng.normal(size=counts.size), -0.4, 0.4)))
    np.testing.assert_array_equal(fit.dropped, [80, 81, 170])


def test_rate_sigma_covers_the_truth():
    rng = np.random.default_rng(5)
    z = []
    for _ in range(200):
        fit = fit_stamps(PERIOD * (np.arange(150) + 0.05 * rng.normal(size=150)))
        z.append((fit.rate_hz - 1 / PERIOD) / fit.rate_sigma_hz)
    assert np.std(z) == pytest.approx(1.0, abs=0.15)


def test_a_slowly_varying_rate_keeps_its_stamps():
    n = np.arange(600)
    stamps = PERIOD * (n + 1.5 * np.sin(2 * np.pi * n / 400))
    fit = fit_stamps(stamps)
    assert fit.method == "stamps"
    np.testing.assert_array_equal(fit.t_s, stamps)
    np.testing.assert_array_equal(fit.sequence, n)


def test_milliseconds_of_a_whole_number_stay_a_line():
    n = np.arange(4000)
    fit = fit_stamps(np.round(1e3 * n / 333.0) * 1e-3)
    assert fit.method == "line"
    assert fit.rate_hz == pytest.approx(333.0, rel=1e-5)  # the rounding beats with the clock
    assert fit.worst_s < 0.6e-3


@pytest.mark.parametrize("stamps", [[], [1.0], [0.0, 1.0, 1.0], [0.0, 2.0, 1.0]])
def test_stamps_that_cannot_be_times_are_refused(stamps):
    with pytest.raises(ValueError, match="increasing"):
        fit_stamps(stamps)


def test_samples_refuse_times_that_do_not_increase():
    with pytest.raises(ValueError, match="sample 2"):
        Samples(np.array([0.0, 1.0, 1.0]), np.zeros((3, 1)), "displacement", "mm", ("x",))


@pytest.mark.shared
@pytest.mark.parametrize("camera", range(4))
def test_real_webcams_lose_no_frame_and_run_at_six_a_second(shared_data: Path, camera: int):
    path = shared_data / "calibration" / "webcam4_charuco_A" / "timestamps.csv"
    table = np.genfromtxt(path, delimiter=",", names=True)
    stamps = np.sort(table["frame_time"][table["cam_id"] == camera])
    fit = fit_stamps(stamps)
    assert fit.method == "line"
    assert fit.dropped.size == 0
    assert fit.rate_hz == pytest.approx(6.0, rel=2e-4)
    assert 0.0024 < fit.jitter_s < 0.0060  # host stamps scatter by milliseconds


@pytest.mark.shared
@pytest.mark.parametrize("name", ["chainsaw_1", "machete_1", "ambient_1"])
def test_a_real_logger_that_pauses_and_catches_up_drops_nothing(shared_data: Path, name: str):
    path = shared_data / "accelerometer" / "tree_mpu6050" / f"{name}.csv"
    stamps = np.genfromtxt(path, delimiter=",", skip_header=1, usecols=0) * 1e-3
    fit = fit_stamps(stamps)
    assert fit.method == "line"
    assert fit.dropped.size == 0
    assert fit.rate_hz == pytest.approx(333.0, abs=0.05)


@pytest.mark.shared
def test_a_real_logger_whose_rate_sinks_keeps_its_stamps(shared_data: Path):
    path = shared_data / "accelerometer" / "endaq_ide" / "S2-D8D16_16g_derived.csv"
    stamps = np.genfromtxt(path, skip_header=1, usecols=0) * 1e-6
    fit = fit_stamps(stamps)
    assert fit.method == "stamps"
    assert fit.rate_hz == pytest.approx(393.76, abs=0.02)
    assert 1e3 * fit.worst_s == pytest.approx(2.2, abs=0.1)
