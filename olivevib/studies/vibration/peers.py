"""The same records through scipy.signal and endaq, as their users would call them."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pandas as pd
from scipy import integrate, signal

from olivevib.arrays import Floats
from olivevib.progress import Tick
from olivevib.studies.study import Effort, Table
from olivevib.studies.vibration.measures import Part
from olivevib.studies.vibration.records import acceleration
from olivevib.vibration import LineSettings, SamplingFacts
from olivevib.vibration.kinematics import to_displacement
from olivevib.vibration.line import fit_line

RATE_HZ, SECONDS = 2000.0, 60.0
_ENDS_S = 4.0  # endaq tapers 3 s at each end
_NOT_INSTALLED = "not installed (pip install endaq)"


def beside(effort: Effort, tick: Tick) -> Part:
    """Frequency, amplitude and displacement of one noisy tone with bias, 60 s at 2 kHz."""
    rng = effort.draws(12)
    t = np.arange(round(RATE_HZ * SECONDS)) / RATE_HZ
    f, size = 25.0 + rng.uniform(-0.5, 0.5) / SECONDS, 99.0
    a = size * np.cos(2 * np.pi * f * t + 1) + 0.5 + 0.2 * rng.normal(size=t.size)
    tick(0, 3, "olivevib")
    facts = SamplingFacts(RATE_HZ, stamps_true=True, band_hz=(5.0, 100.0))
    line = fit_line(
        acceleration(t, np.stack([a, a, a], axis=1)), facts, LineSettings(sway=False)
    ).line
    x = to_displacement(a[:, None], RATE_HZ, 5.0)[:, 0]
    rows: list[tuple[str, Any, Any, Any, Any]] = [
        (
            "olivevib",
            line.f_hz - f,
            100 * (float(line.amplitude[0]) / size - 1),
            *_displacement(t, x, f, size),
        )
    ]
    tick(1, 3, "scipy.signal")
    rows += _scipy(t, a, f, size)
    tick(2, 3, "endaq")
    rows += _endaq(t, a, f, size)
    columns = ("method", "f off Hz", "amplitude off %", "displacement off %", "drift rms mm")
    return Part(Table("Beside scipy.signal and endaq", columns, tuple(rows)), ())


def _displacement(t: Floats, x_mm: Floats, f: float, size: float) -> tuple[float, float]:
    part = (t > _ENDS_S) & (t < SECONDS - _ENDS_S)
    turn = 2 * np.pi * f * t[part]
    waves = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    c = np.linalg.lstsq(waves, x_mm[part], rcond=None)[0]
    wanted = 1e3 * size / (2 * np.pi * f) ** 2
    left = x_mm[part] - waves @ c
    return 100 * (float(np.hypot(*c)) / wanted - 1), float(left.std())


def _scipy(t: Floats, a: Floats, f: float, size: float) -> list[tuple[str, Any, Any, Any, Any]]:
    fw, power = signal.welch(a, RATE_HZ, nperseg=4096, scaling="spectrum")
    at = int(np.argmax(power))
    ff, flat = signal.periodogram(a, RATE_HZ, "flattop", scaling="spectrum")
    top = int(np.argmax(flat))
    v = integrate.cumulative_trapezoid(signal.detrend(a), t, initial=0.0)
    high = signal.butter(4, 5.0, "highpass", fs=RATE_HZ, output="sos")
    v = signal.sosfiltfilt(high, v)
    x = signal.sosfiltfilt(high, integrate.cumulative_trapezoid(v, t, initial=0.0))
    welch = 100 * (float(np.sqrt(2 * power[at])) / size - 1)
    flat_top = 100 * (float(np.sqrt(2 * flat[top])) / size - 1)
    moved = _displacement(t, 1e3 * x, f, size)
    return [
        ("scipy welch 4096, spectrum", float(fw[at]) - f, welch, None, None),
        ("scipy periodogram, flat top", float(ff[top]) - f, flat_top, None, None),
        ("scipy trapezoid, high-pass twice", None, None, *moved),
    ]


def _endaq(t: Floats, a: Floats, f: float, size: float) -> list[tuple[str, Any, Any, Any, Any]]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            from endaq.calc import fft
            from endaq.calc import integrate as endaq_integrate
    except ImportError:
        return [(f"endaq: {_NOT_INSTALLED}", None, None, None, None)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        frame = pd.DataFrame({"a": a}, index=pd.Index(t, name="time"))
        spectrum = fft.rfft(frame)["a"].abs()
        mean = fft.aggregate_fft(frame, bin_width=0.5)["a"].abs()
        twice = endaq_integrate.integrals(frame, n=2, highpass_cutoff=5.0, tukey_percent=0.1)[2]
    rows: list[tuple[str, Any, Any, Any, Any]] = []
    for name, whole in (("endaq rfft", spectrum), ("endaq aggregate_fft", mean)):
        found = whole[whole.index > 1.0]
        off = 100 * (float(found.max()) / size - 1)
        rows.append((name, float(found.idxmax()) - f, off, None, None))
    moved = _displacement(t, 1e3 * twice["a"].to_numpy(dtype=np.float64), f, size)
    return [*rows, ("endaq integrals, 5 Hz", None, None, *moved)]
