"""Frequency and amplitude of a line: clean, noisy, with gaps; neighbours; power density."""

from __future__ import annotations

import numpy as np

from olivevib.arrays import Floats
from olivevib.progress import Tick
from olivevib.studies.study import Cell, Effort, Goal, Table
from olivevib.studies.vibration.measures import Part, covers, rms, within
from olivevib.studies.vibration.records import (
    Tone,
    displacement,
    frequency_bound,
    noise_for,
    random_tone,
)
from olivevib.vibration import LineSettings, SamplingFacts, VibrationSettings, analyse
from olivevib.vibration.line import fit_line
from olivevib.vibration.windows import NAMES

LOW = SamplingFacts(30.0, stamps_true=True, band_hz=(1.5, 14.0))
PLAIN = LineSettings(harmonics=1, neighbours=0)
TRIALS = 2000
T = np.arange(300) / 30


def frequency(effort: Effort, tick: Tick) -> Part:
    """Error over the Cramér-Rao bound, bias and coverage: 10 s at 30 frames/s, three axes."""
    rows: list[tuple[Cell, ...]] = []
    goals = []
    for k, decibels in enumerate((np.inf, 40.0, 20.0, 10.0)):
        trials = effort.count(TRIALS, 4)
        rng = effort.draws(1, k)
        errors, ratios, inside, pulls = [], [], [], []
        for n in range(trials):
            tick(n, trials, f"frequency at {decibels:g} dB")
            tone = random_tone(rng)
            noise = noise_for(tone, decibels) if np.isfinite(decibels) else 0.0
            found = fit_line(
                displacement(T, tone.at(T) + noise * rng.normal(size=(300, 3))), LOW, PLAIN
            )
            if found.fit is None:
                raise ValueError("no line was found in a tone")
            error = found.line.f_hz - tone.f_hz
            errors.append(error)
            if noise:
                ratios.append(error / frequency_bound(tone, T, noise))
                inside.append(abs(error) <= found.fit.student() * found.line.f_sigma_hz)
                pulls.append((found.line.amplitude - tone.amplitude) / found.line.amplitude_sigma)
        worst = float(np.abs(errors).max())
        if not ratios:
            rows.append(("clean", trials, worst, None, None, None, None))
            words = f"worst {worst:.1e} Hz"
            goals.append(Goal("frequency, clean", "<= 1e-9 Hz", words, worst <= 1e-9))
            continue
        ratio, (share, covered) = rms(ratios), covers(inside, 1000)
        case = f"{decibels:g} dB"
        rows.append((case, trials, worst, ratio, float(np.mean(ratios)), share, rms(pulls)))
        if decibels >= 20:
            reached = within(ratio, 1.05, trials, 1000)
            words = f"{ratio:.3f} x bound of {trials}"
            goals.append(Goal(f"frequency, {case}", "<= 1.05 x bound", words, reached))
            words = f"{share:.1f} %"
            goals.append(Goal(f"frequency, {case}, 95 % intervals", "93-97 %", words, covered))
    columns = (
        "noise",
        "trials",
        "worst Hz",
        "rms / bound",
        "bias / bound",
        "covers %",
        "pull of A",
    )
    return Part(Table("Frequency of one line", columns, tuple(rows)), tuple(goals))


def amplitude(effort: Effort, tick: Tick) -> Part:
    """Printed amplitude of clean tones, and the sum of the density over the variance, by window."""
    rng = effort.draws(2)
    facts = SamplingFacts(30.0, stamps_true=True, band_hz=(5.0, 14.0))
    rows, worst_a, worst_p = [], 0.0, 0.0
    for k, name in enumerate(NAMES):
        off, power = 0.0, 0.0
        for _ in range(effort.count(25, 1)):
            tick(k, len(NAMES), f"window {name}")
            tone = random_tone(rng, 5.5, 13.5)
            x = tone.at(T)
            result = analyse({1: displacement(T, x)}, facts, VibrationSettings(name))
            off = max(off, float(np.abs(result.table[0].line.amplitude / tone.amplitude - 1).max()))
            spectrum = result.spectra["displacement"]
            total = spectrum.psd[:, 0].sum(axis=0) * spectrum.resolution_hz
            power = max(power, float(np.abs(total / _steady(x, T, spectrum.start_s) - 1).max()))
        rows.append((name, 100 * off, power))
        worst_a, worst_p = max(worst_a, off), max(worst_p, power)
    goals = (
        Goal(
            "amplitude, clean, every window", "<= 0.01 %", f"{100 * worst_a:.1e} %", worst_a <= 1e-4
        ),
        Goal("power density, sum / variance", "1 ± 1e-4", f"1 ± {worst_p:.1e}", worst_p <= 1e-4),
    )
    columns = ("window", "amplitude off %", "sum / variance off")
    return Part(Table("Amplitude and power by window", columns, tuple(rows)), goals)


def _steady(x: Floats, t_s: Floats, start_s: float) -> Floats:
    """Variance of the part that the spectrum is of."""
    return np.asarray(x[t_s >= start_s - 1e-9].var(axis=0))


def neighbours(effort: Effort, tick: Tick) -> Part:
    """Two tones 1.5 bins and 20 dB apart: both within a tenth of a bin."""
    rows = []
    for k, decibels in enumerate((40.0, 20.0)):
        rng, right, trials = effort.draws(4, k), 0, effort.count(400, 4)
        for n in range(trials):
            tick(n, trials, f"two tones at {decibels:g} dB")
            a = random_tone(rng, 3, 11)
            b = Tone(a.f_hz + 0.15 * rng.choice([-1, 1]), a.amplitude / 10, rng.uniform(0, 6, 3))
            x = a.at(T) + b.at(T) + noise_for(a, decibels) * rng.normal(size=(300, 3))
            fit = fit_line(displacement(T, x), LOW, LineSettings(harmonics=1)).fit
            f = np.zeros(1) if fit is None else fit.f_hz
            near = f.size > 1 and bool(np.abs(f[1:] - b.f_hz).min() < 0.01)
            right += bool(abs(f[0] - a.f_hz) < 0.01 and near)
        rows.append((f"{decibels:g} dB", trials, 100 * right / trials))
    least = min(row[2] for row in rows)
    goal = Goal("two tones 1.5 bins and 20 dB apart", ">= 99 %", f"{least:.1f} %", least >= 99)
    return Part(Table("Two tones", ("noise", "trials", "right %"), tuple(rows)), (goal,))


def gaps(effort: Effort, tick: Tick) -> Part:
    """1 ms of jitter, 10 % missing, a burst lost: error over the bound of what is left."""
    rows, goals = [], []
    for k, burst in enumerate((0, 90)):
        rng, trials = effort.draws(7, k), effort.count(TRIALS, 4)
        ratios, inside, amplitudes = [], [], []
        for n in range(trials):
            tick(n, trials, f"burst of {burst} frames")
            keep, gap = rng.random(300) > 0.1, int(rng.integers(0, 210))
            keep[gap : gap + burst] = False
            tone = random_tone(rng)
            t = T[keep] + 1e-3 * rng.normal(size=int(keep.sum()))
            noise = noise_for(tone, 20)
            x = tone.at(t) + noise * rng.normal(size=(t.size, 3))
            found = fit_line(displacement(t, x), LOW, PLAIN)
            if found.fit is None:
                raise ValueError("no line was found in a tone")
            error = found.line.f_hz - tone.f_hz
            ratios.append(error / frequency_bound(tone, t, noise))
            inside.append(abs(error) <= found.fit.student() * found.line.f_sigma_hz)
            bound = noise * np.sqrt(2 / t.size)
            amplitudes.append((found.line.amplitude[0] - tone.amplitude[0]) / bound)
        ratio, (share, _) = rms(ratios), covers(inside, 1000)
        case = "10 % missing" + (f", burst of {burst / 3:.0f} %" if burst else "")
        rows.append((case, trials, ratio, rms(amplitudes), share))
        reached = within(max(ratio, rms(amplitudes)), 1.1, trials, 1000)
        words = f"frequency {ratio:.3f}, amplitude {rms(amplitudes):.3f} x bound"
        goals.append(Goal(case, "<= 1.1 x bound of what is left", words, reached))
    columns = ("lost", "trials", "f: rms / bound", "A: rms / bound", "covers %")
    return Part(Table("Gaps, 20 dB, 1 ms of jitter", columns, tuple(rows)), tuple(goals))
