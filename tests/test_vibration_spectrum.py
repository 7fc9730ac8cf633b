"""Spectra: window constants, one-sided conventions, variance, even and uneven times alike."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from olivevib.errors import UsageError
from olivevib.vibration.clock import clock_of
from olivevib.vibration.lsscan import scan
from olivevib.vibration.spectrum import Grid, grid_of, spectra
from olivevib.vibration.sums import fourier_sums
from olivevib.vibration.windows import NAMES, window

KNOWN_ENBW = {  # vibration page 4.3
    "rectangular": 1.000,
    "hann": 1.500,
    "hamming": 1.363,
    "blackman": 1.727,
    "blackman-harris": 2.004,
    "flat-top": 3.770,
}


@pytest.mark.parametrize("name", NAMES)
def test_window_constants_agree_with_their_samples(name):
    w = window(name).at(np.arange(4096) / 4096)
    assert window(name).coherent_gain == pytest.approx(w.mean(), rel=1e-12)
    assert window(name).enbw_bins == pytest.approx(w.size * np.sum(w**2) / w.sum() ** 2, rel=1e-12)
    assert window(name).enbw_bins == pytest.approx(KNOWN_ENBW[name], abs=1e-3)


def test_unknown_window_is_refused_by_name():
    with pytest.raises(UsageError, match="hann"):
        window("hanning")


def test_gridded_sums_are_the_plain_sums():
    rng = np.random.default_rng(1)
    t, x = np.sort(rng.uniform(-3, 40, 700)), rng.normal(size=(700, 2))
    plain = np.exp(-2j * np.pi * np.outer(np.arange(900) * 0.013, t)) @ x
    gridded = fourier_sums(t, x, 0.013, 900)  # 700 x 900 is past the direct limit
    assert np.abs(gridded - plain).max() < 1e-10 * np.abs(x).sum()


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("n", [300, 301])
def test_a_tone_on_a_bin_reads_its_peak_amplitude(name, n):
    t = np.arange(n) / 30
    k = 71
    x = 5 + 2.5 * np.cos(2 * np.pi * k * t * 30 / n + 0.7)[:, None]
    grid = grid_of(clock_of(t))
    amplitude, _ = spectra(t, x, grid, window(name))
    assert grid.f_hz[-1] == pytest.approx(15.0, abs=0.051)
    assert amplitude[k, 0] == pytest.approx(2.5, rel=1e-10)
    assert amplitude[0, 0] == pytest.approx(0.0, abs=1e-10)  # the mean is removed


@pytest.mark.parametrize("name", NAMES)
def test_density_is_scipys_up_to_the_variance_of_the_record(name):
    rng = np.random.default_rng(2)
    t = np.arange(600) / 120
    x = rng.normal(size=(600, 1)) + 3 * np.cos(2 * np.pi * 17.3 * t)[:, None]
    grid = grid_of(clock_of(t))
    _, density = spectra(t, x, grid, window(name))
    w = window(name).at(np.arange(600) / 600)
    _, reference = signal.welch(x[:, 0], 120, window=w, nperseg=600, detrend="constant")
    ratio = density[1:, 0] / reference[1:]
    assert np.ptp(ratio) < 1e-9
    assert ratio.mean() == pytest.approx(1.0, abs=0.15)


@given(
    name=st.sampled_from(NAMES),
    n=st.integers(64, 700),
    rate=st.floats(5, 5000),
    scale=st.floats(1e-6, 1e6),
    segments=st.integers(1, 3),
    seed=st.integers(0, 10_000),
)
@settings(deadline=None, max_examples=60)
def test_the_integral_of_the_density_is_the_variance(name, n, rate, scale, segments, seed):
    t = np.arange(n) / rate
    x = scale * np.random.default_rng(seed).normal(size=(n, 3))
    grid = grid_of(clock_of(t), segments)
    _, density = spectra(t, x, grid, window(name))
    np.testing.assert_allclose(density.sum(axis=0) * grid.step_hz, x.var(axis=0), rtol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_unscaled_density_of_a_steady_tone_holds_its_power(name):
    """The scaling changes nothing for a steady motion: power about the line is A^2/2."""
    t = np.arange(3000) / 30
    x = 2 * np.cos(2 * np.pi * 7.0234 * t)[:, None]
    grid = grid_of(clock_of(t))
    amplitude, density = spectra(t, x, grid, window(name))
    near = np.abs(grid.f_hz - 7.0234) < 1.0
    assert density[near, 0].sum() * grid.step_hz == pytest.approx(2.0, rel=3e-3)
    enbw = window(name).enbw_bins * grid.step_hz
    line = amplitude[near, 0] ** 2 / 2 / enbw
    np.testing.assert_allclose(line, density[near, 0], rtol=1e-3)


@pytest.mark.parametrize("name", NAMES)
def test_uneven_records_read_a_tone_as_even_ones_do(name):
    """Ten per cent missing, 1 ms of true jitter, a burst lost: the tone keeps its height."""
    rng = np.random.default_rng(4)
    t = np.arange(450) / 30
    t = np.delete(t, np.concatenate([rng.choice(450, 45, replace=False), np.arange(200, 215)]))
    t = t + 1e-3 * rng.normal(size=t.size)
    grid = Grid(30.0, 450)
    f = grid.f_hz[100]
    amplitude, _ = spectra(t, 1.5 * np.sin(2 * np.pi * f * t + 1)[:, None], grid, window(name))
    assert amplitude[100, 0] == pytest.approx(1.5, rel=0.015)


def test_scan_on_even_times_finds_a_clean_tone_and_explains_all_of_it():
    t = np.arange(300) / 30
    found = scan(t, np.cos(2 * np.pi * 8.0 * t)[:, None], 15.0)
    at = int(np.argmax(found.power))
    assert found.f_hz[at] == pytest.approx(8.0, abs=0.03)
    assert found.explained[at, 0] / found.total[0] > 0.99


def test_scan_is_a_plain_least_squares_fit():
    rng = np.random.default_rng(6)
    t = np.sort(rng.uniform(0, 10, 120))
    x = rng.normal(size=(120, 2))
    found = scan(t, x, 9.0)
    for k in (3, 50, 200):
        turn = 2 * np.pi * found.f_hz[k] * t
        columns = np.stack([np.ones(120), np.cos(turn), np.sin(turn)], axis=1)
        left = x - columns @ np.linalg.lstsq(columns, x, rcond=None)[0]
        drop = np.sum((x - x.mean(axis=0)) ** 2, axis=0) - np.sum(left**2, axis=0)
        np.testing.assert_allclose(found.explained[k], drop, rtol=1e-8)


def test_long_even_records_are_scanned_by_fft_to_the_same_result():
    """Past 2 000 samples an even record takes another way: the same sums, another grid."""
    rng = np.random.default_rng(8)
    t = np.arange(2400) / 100 + 3.0
    x = rng.normal(size=(2400, 2)) + np.cos(2 * np.pi * 7.77 * t)[:, None]
    found = scan(t, x, 50.0)
    for k in (0, 40, 700, 3000, found.f_hz.size - 5):
        turn = 2 * np.pi * found.f_hz[k] * t
        columns = np.stack([np.ones(t.size), np.cos(turn), np.sin(turn)], axis=1)
        left = x - columns @ np.linalg.lstsq(columns, x, rcond=None)[0]
        drop = np.sum((x - x.mean(axis=0)) ** 2, axis=0) - np.sum(left**2, axis=0)
        np.testing.assert_allclose(found.explained[k], drop, rtol=1e-7)
