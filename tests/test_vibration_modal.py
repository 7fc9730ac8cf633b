"""Free decay: bias, scatter against the predicted sigma, a real beam on two instruments."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from olivevib.vibration.modal import fit_decay


def decaying(t, f_hz, damping, amplitudes, phase=0.7):
    omega = 2 * np.pi * f_hz
    wave = np.exp(-damping * omega * t) * np.cos(omega * np.sqrt(1 - damping**2) * t + phase)
    return wave[:, None] * np.asarray(amplitudes)


@pytest.mark.parametrize("damping", [0.003, 0.01, 0.03, 0.10])
def test_clean_decays_are_exact(damping):
    t = np.arange(150) / 30
    found = fit_decay(t, decaying(t, 7.3, damping, [1.0, 0.4]) + 2.0)
    assert found.converged
    assert found.f_hz[0] == pytest.approx(7.3, rel=1e-7)
    assert found.damping[0] == pytest.approx(damping, rel=1e-6)
    assert found.share == pytest.approx(1.0, abs=1e-9)
    assert found.decrement[0] == pytest.approx(2 * np.pi * damping / np.sqrt(1 - damping**2))
    tenth = found.time_to_tenth_s[0]
    assert np.exp(-damping * 2 * np.pi * 7.3 * tenth) == pytest.approx(0.1, rel=1e-6)


@pytest.mark.parametrize("damping", [0.01, 0.03])
def test_scatter_is_as_predicted_and_intervals_cover(damping):
    rng = np.random.default_rng(1)
    t, got, sigma, covered = np.arange(120) / 30, [], [], 0
    clean = decaying(t, 7.3, damping, [1.0])
    for _ in range(100):
        found = fit_decay(t, clean + 0.07 * rng.normal(size=clean.shape))
        got.append([found.f_hz[0], found.damping[0]])
        sigma.append([found.f_sigma_hz[0], found.damping_sigma[0]])
        reach = found.student() * found.damping_sigma[0]
        covered += abs(found.damping[0] - damping) <= reach
    np.testing.assert_allclose(np.std(got, axis=0), np.mean(sigma, axis=0), rtol=0.25)
    assert abs(np.mean(got, axis=0)[1] / damping - 1) < 0.03
    assert 88 <= covered <= 100


def test_uneven_times_and_two_modes_with_slow_motion_under_them():
    rng = np.random.default_rng(2)
    t = np.sort(rng.uniform(0, 4, 500))
    x = decaying(t, 6.0, 0.02, [1.0, 0.3, 0.1]) + decaying(t, 11.0, 0.03, [0.2, 0.5, 0.1], 1.5)
    slow = 3 * np.sin(2 * np.pi * 0.4 * t)[:, None]
    found = fit_decay(t, x + slow + 0.01 * rng.normal(size=x.shape), modes=2, slow_hz=1.5)
    order = np.argsort(found.f_hz)
    np.testing.assert_allclose(found.f_hz[order], [6.0, 11.0], rtol=1e-3)
    np.testing.assert_allclose(found.damping[order], [0.02, 0.03], rtol=0.05)


def test_too_few_samples_are_refused():
    with pytest.raises(ValueError, match="samples"):
        fit_decay(np.arange(8.0), np.zeros((8, 1)))


def beam(shared_data: Path):
    """Camera (t, 15 points) and accelerometer (t, g) of the beam, each from its hit on."""
    folder = shared_data / "accelerometer" / "beam_optical_vs_accel"
    seen = np.load(folder / "displacements_lk.npy")[:, :, 0].T
    lines = (folder / "acceleration.lvm").read_text(encoding="latin1").splitlines()
    start = max(i for i, line in enumerate(lines) if "***End_of_Header***" in line)
    rows = [line.split("\t") for line in lines[start + 2 :] if line.strip()]
    cells = [next(float(c.replace(",", ".")) for c in row if c.strip()) for row in rows]
    envelope = np.abs(seen).max(axis=1)
    hit = int(np.flatnonzero(envelope > 0.1 * envelope.max())[0])
    return seen[hit:], np.array(cells)[36:, None]


@pytest.mark.shared
def test_the_beam_rings_alike_for_camera_and_accelerometer(shared_data: Path):
    """Goals: mode 1 within 0.01 %, mode 2 within 0.02 %, damping of mode 1 within 5 %."""
    seen, heard = beam(shared_data)
    start, lasts = 0.005, 0.18  # s after the hit: contact and filter have settled
    modes = np.array([695.8, 1898.0])
    fits = []
    for record, rate in ((seen, 15_000), (heard, 50_000)):
        t = np.arange(record.shape[0]) / rate
        part = (t >= start) & (t < start + lasts)
        fits.append(fit_decay(t[part], record[part], 2, modes, slow_hz=300.0))
    camera, logger = fits
    assert camera.converged and logger.converged
    ratio = camera.f_hz / logger.f_hz - 1
    assert abs(ratio[0]) < 1e-4
    assert abs(ratio[1]) < 2e-4
    assert abs(camera.damping[0] / logger.damping[0] - 1) < 0.05
    assert camera.f_hz[0] == pytest.approx(695.8, abs=0.1)
