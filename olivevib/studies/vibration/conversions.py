"""Derivatives and integrals without differences or drift; damping of a free decay."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from olivevib.files.accelerometer import read_accelerometer
from olivevib.progress import Tick
from olivevib.studies.study import Effort, Goal, Table
from olivevib.studies.vibration.lines import T
from olivevib.studies.vibration.measures import Part, covers, within
from olivevib.studies.vibration.records import displacement, random_tone
from olivevib.vibration import LineSettings, SamplingFacts
from olivevib.vibration.kinematics import derive, to_displacement
from olivevib.vibration.line import fit_line
from olivevib.vibration.modal import fit_decay

_STRUCK = 36  # sample of the accelerometer at which the hammer hit


def derivative(effort: Effort, tick: Tick) -> Part:
    """Displacement to acceleration up to 0.45 of the rate, whole record, worst sample."""
    worst = 0.0
    rng, trials = effort.draws(5), effort.count(400, 4)
    facts = SamplingFacts(30.0, stamps_true=True, band_hz=(1.0, 14.0))
    for n in range(trials):
        tick(n, trials, "displacement to acceleration")
        tone = random_tone(rng, 2, 13.5)
        samples = displacement(T, tone.at(T))
        got = derive(fit_line(samples, facts, LineSettings()), samples, 2, 14.0)
        wanted = tone.at(T, 2)
        if got is None:
            raise ValueError("no derivative of a tone")
        worst = max(worst, float(np.abs(got - wanted).max() / np.abs(wanted).max()))
    words = f"worst {100 * worst:.1e} %"
    goal = Goal(
        "displacement to acceleration, to 0.45 of the rate", "<= 0.05 %", words, worst <= 5e-4
    )
    row = ("2-13.5 Hz at 30 frames/s", trials, 100 * worst)
    return Part(Table("Derivative", ("case", "trials", "worst sample %"), (row,)), (goal,))


def integral(effort: Effort, tick: Tick) -> Part:
    """Acceleration to displacement: 25 Hz, 99 m/s2, bias 0.5 m/s2, 60 s at 2 kHz."""
    t, omega = np.arange(120_000) / 2000, 2 * np.pi * 25
    rng, rows, sizes, drifts = effort.draws(6), [], [], []
    noise = 0.05 * 9.80665 * rng.normal(size=(t.size, 1))
    for case, extra in (("bias", np.zeros((1, 1))), ("bias and noise of 0.05 g", noise)):
        tick(0, 2, f"integration with {case}")
        x = to_displacement(99 * np.sin(omega * t)[:, None] + 0.5 + extra, 2000.0, 5.0)
        part = (t > 0.5) & (t < 59.5)
        waves = np.stack([np.sin(omega * t), np.cos(omega * t)], axis=1)[part]
        c = np.linalg.lstsq(waves, x[part], rcond=None)[0]
        size = float(np.hypot(c[0, 0], c[1, 0])) / (99e3 / omega**2) - 1
        left = x[part] - waves @ c
        rows.append((case, 100 * size, float(left.std()), float(np.abs(left).max())))
        sizes.append(abs(size))
        drifts.append(float(left.std()))
    goals = (
        Goal(
            "acceleration to displacement",
            "<= 0.01 %",
            f"{100 * max(sizes):.1e} %",
            max(sizes) <= 1e-4,
        ),
        Goal("its drift, rms", "<= 0.06 mm", f"{max(drifts):.3f} mm", max(drifts) <= 0.06),
    )
    columns = ("case", "amplitude off %", "drift rms mm", "drift worst mm")
    return Part(Table("Integral", columns, tuple(rows)), goals)


def damping(effort: Effort, tick: Tick) -> Part:
    """Damping at 7.3 Hz, 30 frames/s, 20 dB: scatter over the predicted sigma, coverage, bias."""
    rows, goals = [], []
    trials = effort.count(1000, 4)
    for k, true in enumerate((0.003, 0.01, 0.03, 0.10)):
        rng = effort.draws(9, k)
        got, sigma, inside = [], [], []
        omega, t = 2 * np.pi * 7.3, np.arange(120) / 30
        wave = np.exp(-true * omega * t) * np.cos(omega * np.sqrt(1 - true**2) * t + 1.0)
        bound = _damping_bound(t, true, omega, np.sqrt(0.5) * 0.1)
        for n in range(trials):
            tick(n, trials, f"damping of {100 * true:g} %")
            found = fit_decay(t, wave[:, None] + np.sqrt(0.5) * 0.1 * rng.normal(size=(120, 1)))
            got.append(float(found.damping[0]))
            sigma.append(float(found.damping_sigma[0]))
            inside.append(abs(got[-1] - true) <= found.student() * sigma[-1])
        ratio, (share, covered) = float(np.std(got)) / bound, covers(inside, 500)
        bias = 100 * (float(np.mean(got)) / true - 1)
        rows.append((100 * true, trials, 100 * float(np.std(got)) / true, ratio, bias, share))
        words = f"{ratio:.3f} x bound, covers {share:.1f} %"
        reached = within(ratio, 1.1, trials, 500)
        both = None if reached is None or covered is None else reached and covered
        goals.append(Goal(f"damping of {100 * true:g} %", "<= 1.1 x bound, 93-97 %", words, both))
    columns = ("damping %", "trials", "SD %", "SD / bound", "bias %", "covers %")
    return Part(Table("Damping", columns, tuple(rows)), tuple(goals))


def _damping_bound(t: np.ndarray, damping: float, omega: float, noise: float) -> float:
    """Cramér-Rao bound of the damping ratio, amplitudes, mean and frequency unknown too."""

    def model(p: np.ndarray) -> np.ndarray:
        s, wd = p[0] * p[1], p[1] * np.sqrt(1 - p[0] ** 2)
        wave = np.exp(-s * t) * (p[2] * np.cos(wd * t) - p[3] * np.sin(wd * t)) + p[4]
        return np.asarray(wave)

    p = np.array([damping, omega, np.cos(1.0), np.sin(1.0), 0.0])
    steps = np.array([1e-6, 1e-6, 1e-6, 1e-6, 1e-6])
    jacobian = np.stack(
        [
            (model(p + h * e) - model(p - h * e)) / (2 * h)
            for h, e in zip(steps, np.eye(5), strict=True)
        ],
        axis=1,
    )
    return float(noise * np.sqrt(np.linalg.inv(jacobian.T @ jacobian)[0, 0]))


def beam(effort: Effort, tick: Tick) -> Part:
    """A real beam (MIT licence, ladisk): its modes by camera (15 kHz) and by accelerometer."""
    folder = Path("../shared/data/accelerometer/beam_optical_vs_accel")
    asked = ("beam mode 1, camera against accelerometer", "beam mode 2")
    limits = (1e-4, 2e-4)
    columns = (
        "mode",
        "camera Hz",
        "accelerometer Hz",
        "difference %",
        "damping camera %",
        "sensor %",
    )
    if not folder.is_dir():
        words = "the recording is not beside this project"
        missing = [
            Goal(name, f"<= {100 * most:g} %", words, None)
            for name, most in zip(asked, limits, strict=True)
        ]
        return Part(Table("Beam", columns, ()), tuple(missing))
    tick(0, 1, "beam")
    optical = np.load(folder / "displacements_lk.npy")[:, :, 0].T
    a = read_accelerometer(folder / "acceleration.lvm").samples.values[:, 0]
    envelope = np.abs(optical).max(axis=1)
    hit = int(np.flatnonzero(envelope > 0.1 * envelope.max())[0])
    modes, start, lasts = np.array([695.8, 1898.0]), 0.005, 0.18  # s: contact has settled
    fits = []
    for record, rate in ((optical[hit:], 15_000), (a[_STRUCK:, None], 50_000)):
        t = np.arange(len(record)) / rate
        part = (t >= start) & (t < start + lasts)
        fits.append(fit_decay(t[part], record[part], 2, modes, slow_hz=300.0))
    one, two = fits
    table, goals = [], []
    for k, (name, most) in enumerate(zip(asked, limits, strict=True)):
        c, s = float(one.f_hz[k]), float(two.f_hz[k])
        zc, zs = 100 * float(one.damping[k]), 100 * float(two.damping[k])
        table.append((k + 1, c, s, 100 * (c / s - 1), zc, zs))
        words = f"{100 * (c / s - 1):+.4f} % ({c:.2f} and {s:.2f} Hz)"
        goals.append(Goal(name, f"<= {100 * most:g} %", words, abs(c / s - 1) <= most))
    return Part(Table("Beam", columns, tuple(table)), tuple(goals))
