"""How near the vibration room comes to its goals (S1-S11, C1-C3): a table of measured numbers.

Run from the project: PYTHONPATH=tests python -m studies.vibration [--trials N] [--only s1,c1]
Every study is a function of the number of trials and returns rows (goal, case, measured, reach).
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np
from scipy import fft

from olivevib.comparison import ComparisonSettings, compare
from olivevib.vibration import (
    LineSettings,
    LineStatus,
    SamplingFacts,
    VibrationSettings,
    analyse,
    find_sensor_phases,
)
from olivevib.vibration.kinematics import derive, to_displacement
from olivevib.vibration.line import fit_line
from olivevib.vibration.modal import fit_decay
from olivevib.vibration.windows import NAMES

from .records import (
    Logger,
    Shaker,
    Tone,
    acceleration,
    camera,
    displacement,
    frequency_bound,
    noise_for,
    random_tone,
    rotation,
    sensor,
    truth,
)

Row = tuple[str, str, str, str]
LOW = SamplingFacts(30.0, stamps_true=True, band_hz=(1.5, 14.0))
PLAIN = LineSettings(harmonics=1, neighbours=0)


def rms(values) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def s1_frequency(trials: int) -> list[Row]:
    """Error over the bound, bias and coverage of frequency; error over sigma of amplitude."""
    rows = []
    for decibels in (np.inf, 40, 20, 10):
        rng = np.random.default_rng(1)
        errors, ratios, covered, pulls = [], [], [], []
        t = np.arange(300) / 30
        for _ in range(trials):
            tone = random_tone(rng)
            s = noise_for(tone, decibels) if np.isfinite(decibels) else 0.0
            x = tone.at(t) + s * rng.normal(size=(300, 3))
            found = fit_line(displacement(t, x), LOW, PLAIN)
            errors.append(found.line.f_hz - tone.f_hz)
            if s:
                ratios.append(errors[-1] / frequency_bound(tone, t, s))
                reach = found.fit.student() * found.line.f_sigma_hz
                covered.append(abs(errors[-1]) <= reach)
                pulls += list((found.line.amplitude - tone.amplitude) / found.line.amplitude_sigma)
        if not ratios:
            rows.append(("S1", "clean", f"worst {np.abs(errors).max():.1e} Hz", "1e-9 Hz"))
            continue
        words = (
            f"{rms(ratios):.3f} x bound, bias {np.mean(ratios):+.3f}, "
            f"covers {100 * np.mean(covered):.1f} %, amplitude {rms(pulls):.3f} sigma"
        )
        rows.append(("S1", f"{decibels} dB, 10 s at 30 fps", words, "<= 1.05, 93-97 %"))
    return rows


def s2_amplitude(trials: int) -> list[Row]:
    """Printed amplitude on clean tones for every window that may be shown."""
    rng = np.random.default_rng(2)
    worst = 0.0
    for name in NAMES:
        for _ in range(max(2, trials // 40)):
            tone, t = random_tone(rng, 5.5, 13.5), np.arange(300) / 30
            facts = SamplingFacts(30.0, stamps_true=True, band_hz=(5.0, 14.0))
            row = analyse({1: displacement(t, tone.at(t))}, facts, VibrationSettings(name)).table[0]
            worst = max(worst, np.abs(row.line.amplitude / tone.amplitude - 1).max())
    return [("S2", "clean, every window", f"worst {100 * worst:.1e} %", "0.01 %")]


def s4_neighbours(trials: int) -> list[Row]:
    """Two tones 1.5 bins and 20 dB apart, both within 0.1 bin."""
    rows = []
    for decibels in (40, 20):
        rng, right, t = np.random.default_rng(4), 0, np.arange(300) / 30
        for _ in range(trials):
            a = random_tone(rng, 3, 11)
            b = Tone(a.f_hz + 0.15 * rng.choice([-1, 1]), a.amplitude / 10, rng.uniform(0, 6, 3))
            x = a.at(t) + b.at(t) + noise_for(a, decibels) * rng.normal(size=(300, 3))
            f = fit_line(displacement(t, x), LOW, LineSettings(harmonics=1)).fit.f_hz
            near = f.size > 1 and np.abs(f[1:] - b.f_hz).min() < 0.01
            right += bool(abs(f[0] - a.f_hz) < 0.01 and near)
        rows.append(("S4", f"{decibels} dB", f"{100 * right / trials:.1f} %", ">= 99 %"))
    return rows


def s5_conversion(trials: int) -> list[Row]:
    """Displacement to acceleration up to 0.45 of the rate; acceleration to displacement."""
    worst, t = 0.0, np.arange(300) / 30
    rng = np.random.default_rng(5)
    facts = SamplingFacts(30.0, stamps_true=True, band_hz=(1.0, 14.0))
    for _ in range(trials // 4):
        tone = random_tone(rng, 2, 13.5)
        samples = displacement(t, tone.at(t))
        wanted = tone.at(t, 2)
        got = derive(fit_line(samples, facts, LineSettings()), samples, 2, 14.0)
        worst = max(worst, np.abs(got - wanted).max() / np.abs(wanted).max())
    t, omega = np.arange(120_000) / 2000, 2 * np.pi * 25
    noise = 0.05 * 9.80665 * rng.normal(size=(t.size, 1))
    out = [("S5", "x to a, whole record", f"worst {100 * worst:.1e} %", "0.05 %")]
    for case, extra in (("bias 0.5 m/s2", 0.0), ("bias, noise 0.05 g", noise)):
        x = to_displacement(99 * np.sin(omega * t)[:, None] + 0.5 + extra, 2000.0, 5.0)
        part = (t > 0.5) & (t < 59.5)
        waves = np.stack([np.sin(omega * t), np.cos(omega * t)], axis=1)[part]
        c = np.linalg.lstsq(waves, x[part], rcond=None)[0]
        size = float(np.hypot(c[0, 0], c[1, 0])) / (99e3 / omega**2) - 1
        left = x[part] - waves @ c
        words = (
            f"{100 * size:+.1e} %, drift rms {left.std():.3f}, worst {np.abs(left).max():.3f} mm"
        )
        out.append(("S5", f"a to x, {case}", words, "0.01 %, 0.06 mm"))
    return out


def s6_alias(trials: int) -> list[Row]:
    """What is said of shakers at 30 frames/s without the continuous fit: never a bare frequency."""
    rng, counts, held = np.random.default_rng(6), {}, 0
    facts = SamplingFacts(30.0, True, True, True, row_time_s=2.8e-5, right_offset_s=0.0)
    t = np.arange(180) / 30
    for _ in range(trials):
        tone = random_tone(rng, 5, 45)
        x = tone.at(t) + 0.1 * rng.normal(size=(180, 3))
        line = fit_line(displacement(t, x), facts, LineSettings()).line
        counts[line.status.value] = counts.get(line.status.value, 0) + 1
        held += any(abs(c - tone.f_hz) < 0.05 for c in line.candidates_hz)
    sure = sum(counts.get(s.value, 0) for s in (LineStatus.DIRECT, LineStatus.CONFIRMED))
    words = f"{counts}, claimed {sure}, truth among candidates {100 * held / trials:.0f} %"
    return [("S6", "5-45 Hz at 30 fps, in step", words, "0 claimed")]


def s7_gaps(trials: int) -> list[Row]:
    """Jitter, 10 % missing, a burst of 30 % lost: error over the bound of what is left."""
    rng, ratios, covered = np.random.default_rng(7), [], []
    for _ in range(trials):
        tone, t = random_tone(rng), np.arange(300) / 30
        keep, gap = rng.random(300) > 0.1, rng.integers(0, 210)
        keep[gap : gap + 90] = False
        t = t[keep] + 1e-3 * rng.normal(size=keep.sum())
        s = noise_for(tone, 20)
        x = tone.at(t) + s * rng.normal(size=(t.size, 3))
        found = fit_line(displacement(t, x), LOW, PLAIN)
        error = found.line.f_hz - tone.f_hz
        ratios.append(error / frequency_bound(tone, t, s))
        covered.append(abs(error) <= found.fit.student() * found.line.f_sigma_hz)
    words = f"{rms(ratios):.3f} x bound, covers {100 * np.mean(covered):.1f} %"
    return [("S7", "20 dB", words, "<= 1.1")]


def s9_damping(trials: int) -> list[Row]:
    """Damping at 30 fps, 7.3 Hz, 20 dB at the start: scatter over the bound, coverage, bias."""
    rows = []
    for damping in (0.003, 0.01, 0.03, 0.10):
        rng, got, sigma, covered = np.random.default_rng(9), [], [], []
        omega, t = 2 * np.pi * 7.3, np.arange(120) / 30
        wave = np.exp(-damping * omega * t) * np.cos(omega * np.sqrt(1 - damping**2) * t + 1.0)
        for _ in range(trials):
            x = wave[:, None] + np.sqrt(0.5) * 0.1 * rng.normal(size=(120, 1))
            found = fit_decay(t, x)
            got.append(found.damping[0])
            sigma.append(found.damping_sigma[0])
            covered.append(abs(got[-1] - damping) <= found.student() * sigma[-1])
        words = (
            f"SD {100 * np.std(got) / damping:.1f} %, {np.std(got) / np.median(sigma):.3f} x "
            f"predicted, bias {100 * (np.mean(got) / damping - 1):+.1f} %, "
            f"covers {100 * np.mean(covered):.1f} %"
        )
        rows.append(("S9", f"damping {100 * damping:g} %", words, "<= 1.1, 93-97 %"))
    return rows


def s10_phases(trials: int) -> list[Row]:
    """Limits of the steady phase from an accelerometer."""
    errors = []
    for seed in range(max(10, trials // 8)):
        rng = np.random.default_rng(seed)
        shaker = Shaker(
            f_hz=rng.uniform(20, 29), start_up_s=rng.uniform(0.6, 1.2), precession_hz=0.3
        )
        t, path = truth(shaker, rng, rate_hz=5000.0)
        logger = Logger(rate_hz=1000.0, offset_s=0.0, drift=0.0)
        phases = find_sensor_phases(sensor(t, path, rng, logger, rotation(rng)))
        steady = [p for p in phases if p.name == "steady"]
        limits = shaker.limits
        errors += (
            [steady[0].start_s - limits[1], steady[0].end_s - limits[2]] if steady else [np.nan] * 2
        )
    size = np.abs(errors)
    words = f"90 % within {1e3 * np.nanpercentile(size, 90):.0f} ms, {np.isnan(size).sum()} missed"
    return [("S10", "steady, from the sensor", words, "30 ms")]


def s11_cost(trials: int) -> list[Row]:
    """Time of the figures of a 60 s, 3-axis, 2 kHz record, in windowed FFTs of it."""
    rng = np.random.default_rng(11)
    t = np.arange(120_000) / 2000
    a = 99 * np.cos(2 * np.pi * 25 * t[:, None] + np.arange(3)) + rng.normal(size=(t.size, 3))
    hann = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(t.size) / t.size)

    def unit():
        fft.rfft(a * hann[:, None], axis=0)

    def clock(work) -> float:
        spent = []
        for _ in range(3):
            start = time.perf_counter()
            work()
            spent.append(time.perf_counter() - start)
        return min(spent)

    one = clock(unit)
    facts = SamplingFacts(2000.0, stamps_true=True, band_hz=(5.0, 100.0))
    samples = acceleration(t, a)
    line = clock(lambda: fit_line(samples, facts, LineSettings(sway=False)))
    phases = clock(lambda: find_sensor_phases(samples))
    integral = clock(lambda: to_displacement(a, 2000.0))
    words = (
        f"unit {1e3 * one:.0f} ms; line {line / one:.0f}, phases {phases / one:.0f}, "
        f"displacement {integral / one:.0f} units"
    )
    return [("S11", "60 s at 2 kHz", words, "<= 12 units for all")]


def c1_comparison(trials: int) -> list[Row]:
    """Clock offset, drift, gain and rotation, each against truth and against its own sigma."""
    rows = []
    for case, changes, fps, noise in (
        ("25 Hz at 30 fps", {}, 30.0, 0.06),
        ("12 Hz at 30 fps", {"f_hz": 12.0}, 30.0, 0.06),
        ("25 Hz at 120 fps", {}, 120.0, 0.06),
        ("29 Hz at 30 fps, sway 0.9 Hz", {"f_hz": 29.0}, 30.0, 0.06),
        ("25 Hz, noise 0.3 mm", {}, 30.0, 0.3),
        ("25 Hz, 0.5 mm", {"amplitude_mm": 0.5}, 30.0, 0.06),
        ("25 Hz, straight", {"minor": 0.0}, 30.0, 0.06),
    ):
        rows.append(_comparison(case, Shaker(**changes), fps, noise, max(2, trials // 12)))
    return rows


def _comparison(case: str, shaker: Shaker, fps: float, noise: float, trials: int) -> Row:
    errors, sigmas, turns, verdicts = [], [], [], []
    middle = shaker.limits[-1] / 2
    for seed in range(trials):
        rng = np.random.default_rng(seed)
        logger = Logger(offset_s=rng.uniform(-30, 30), t_mid_s=middle)
        t, path = truth(shaker, rng)
        turn, exposure = rotation(rng), 0.008
        times = np.arange(0, shaker.limits[-1], 1 / fps)
        seen = camera(t, path, rng, times, noise, exposure, shaker)
        heard = sensor(t, path, rng, logger, turn)
        c = compare(seen, heard, 1, "trunk", ComparisonSettings(exposure_s=exposure))
        at = (c.overlay_t_s[0] + c.overlay_t_s[-1]) / 2 if c.overlay_t_s.size else middle
        offset = logger.offset_s + logger.drift * (at - middle)
        errors.append([c.clock_offset_s - offset, c.clock_drift_ppm - 30, c.gain - 1])
        sigmas.append([c.clock_offset_sigma_s, c.clock_drift_sigma_ppm, c.gain_sigma])
        cosine = (np.trace(c.R_camera_sensor @ turn.T) - 1) / 2
        turns.append(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
        verdicts.append(c.verdict.value)
    e, s = np.array(errors), np.array(sigmas)
    agreed = sum(v == "agrees" for v in verdicts)
    pulls = " ".join(f"{rms(e[:, k] / s[:, k]):.2f}" for k in range(3))
    words = (
        f"offset {1e6 * rms(e[:, 0]):.1f} us, drift {rms(e[:, 1]):.1f} ppm, gain "
        f"{100 * rms(e[:, 2]):.2f} % ({100 * e[:, 2].mean():+.2f}), rotation {rms(turns):.2f} deg; "
        f"over sigma {pulls}; agrees {agreed}/{trials}"
    )
    return ("C1-C3", case, words, "20 us, 20 ppm, 0.2 %, 0.5 deg, 1.2 sigma")


STUDIES: dict[str, Callable[[int], list[Row]]] = {
    "s1": s1_frequency,
    "s2": s2_amplitude,
    "s4": s4_neighbours,
    "s5": s5_conversion,
    "s6": s6_alias,
    "s7": s7_gaps,
    "s9": s9_damping,
    "s10": s10_phases,
    "s11": s11_cost,
    "c1": c1_comparison,
}


def main(arguments: list[str] | None = None) -> None:
    """Print the table of the chosen studies."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=400)
    parser.add_argument("--only", default=",".join(STUDIES))
    chosen = parser.parse_args(arguments)
    print("| goal | case | measured | reach |")
    print("|---|---|---|---|")
    for name in chosen.only.split(","):
        for row in STUDIES[name](chosen.trials):
            print("| " + " | ".join(row) + " |", flush=True)


if __name__ == "__main__":
    main()
