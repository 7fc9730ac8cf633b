"""All figures of an accelerometer record: phases, line, spectrum, and all three quantities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import fft

from olivevib.arrays import Floats, floats
from olivevib.signals import Samples
from olivevib.vibration.clock import Clock, between, clock_of, measured
from olivevib.vibration.figures import NO_LINE, Figures, LineFigures, figures, unknown
from olivevib.vibration.kinematics import UNITS, detrended
from olivevib.vibration.line import LineFit, LineSettings, fit_line
from olivevib.vibration.phases import WHOLE, Phase, find_sensor_phases
from olivevib.vibration.spectrum import grid_of, spectra
from olivevib.vibration.types import Line, LineStatus
from olivevib.vibration.verdict import SamplingFacts
from olivevib.vibration.windows import window

_CYCLE = 5.0  # integrals keep frequencies up to that many times the band's upper end
_ENDS = 3.0  # periods of the corner that the record's ends disturb
_LINE = LineSettings(sway=False)


@dataclass(frozen=True)
class SensorAnalysis:
    """What one accelerometer felt in the phase shown (steady, or the whole record).

    f_hz (F,), amplitude (F, 3) peak in m/s2, psd (F, 3). Velocity and displacement are integrals
    between half the band's lower end and ``top_hz``, without the record's ends, which they disturb;
    NaN where the stamps are uneven, have gaps, or the record is short.
    """

    phases: tuple[Phase, ...]
    phase: Phase
    line: Line
    f_hz: Floats
    amplitude: Floats
    psd: Floats
    acceleration: Figures
    velocity: Figures
    displacement: Figures
    top_hz: float

    def __post_init__(self) -> None:
        f_hz = floats("f_hz", self.f_hz, (None,))
        object.__setattr__(self, "f_hz", f_hz)
        for name in ("amplitude", "psd"):
            value = floats(name, getattr(self, name), (f_hz.size, 3))
            object.__setattr__(self, name, value)


def analyse_sensor(
    samples: Samples, band_hz: tuple[float, float] = (5.0, 45.0), shown: str = "hann"
) -> SensorAnalysis:
    """Analyse an acceleration (m/s2, three axes) on its own clock; gravity falls out.

    Figures, line and spectrum are of the steady phase, or of the whole record. shown: window of
    the spectrum. Raises ValueError for another unit or fewer than 16 samples.
    """
    if samples.unit != "m/s2" or len(samples.axes) != 3:
        raise ValueError(f"need three axes in m/s2, got {len(samples.axes)} in {samples.unit}")
    t_s, a = measured(samples)
    if t_s.size < 16:
        raise ValueError(f"need at least 16 samples, got {t_s.size}")
    phases = find_sensor_phases(samples)
    ends = Phase(WHOLE, float(t_s[0]), float(t_s[-1]))
    phase = next((p for p in phases if p.name == "steady"), ends)
    part = between(samples, phase.start_s, phase.end_s)
    of_part = measured(part)
    clock = clock_of(of_part[0])
    found = fit_line(part, SamplingFacts(clock.rate_hz, stamps_true=True, band_hz=band_hz), _LINE)
    grid, shape = grid_of(clock), window(shown)
    amplitude, psd = spectra(*of_part, grid, shape)
    top_hz = min(clock.rate_hz / 2, _CYCLE * band_hz[1])
    speed, path = _integrals(t_s, a, phase, band_hz[0] / 2, top_hz)
    noise = np.full(3, np.nan) if found.fit is None else found.fit.noise
    line = _line_figures(found)
    return SensorAnalysis(
        phases=phases,
        phase=phase,
        line=found.line,
        f_hz=grid.f_hz,
        amplitude=amplitude,
        psd=psd,
        acceleration=figures(of_part[1], "acceleration", "m/s2", phase.duration_s, noise, line[0]),
        velocity=_figures("velocity", speed, phase, line[1]),
        displacement=_figures("displacement", path, phase, line[2]),
        top_hz=top_hz,
    )


def _figures(quantity: str, values: Floats | None, phase: Phase, line: LineFigures) -> Figures:
    """Figures of an integral; its noise is not white, so none is stated."""
    if values is None:
        return unknown(quantity, UNITS[quantity], line)
    noise = np.full(3, np.nan)
    return figures(values, quantity, UNITS[quantity], phase.duration_s, noise, line)


def _line_figures(found: LineFit) -> tuple[LineFigures, LineFigures, LineFigures]:
    """The line in acceleration (m/s2), velocity (mm/s) and displacement (mm)."""
    line = found.line
    if line.status is not LineStatus.DIRECT:
        return NO_LINE, NO_LINE, NO_LINE
    out = []
    for n in range(3):
        scale = 1e3 ** min(n, 1) / (2 * np.pi * line.f_hz) ** n
        size, relative = scale * line.amplitude, n * line.f_sigma_hz / line.f_hz
        sigma = np.hypot(scale * line.amplitude_sigma, size * relative)
        multiples = np.arange(2, len(line.harmonics) + 2)[:, None] ** n
        out.append(LineFigures(size, sigma, scale * line.harmonics / multiples))
    return out[0], out[1], out[2]


def _integrals(
    t_s: Floats, a: Floats, phase: Phase, corner_hz: float, top_hz: float
) -> tuple[Floats | None, Floats | None]:
    """Velocity (mm/s) and displacement (mm) in a phase, from one transform of the whole record.

    Omega arithmetic as kinematics.to_displacement, padded by what the filter rings; the inverse on
    the coarsest grid that holds frequencies up to top_hz.
    """
    clock: Clock = clock_of(t_s)
    if not clock.even or clock.span_s * corner_hz < 4 * _ENDS:
        return None, None
    n, rate = t_s.size, clock.rate_hz
    padded = fft.next_fast_len(n + int(np.ceil(2 * _ENDS / corner_hz * rate)), real=True)
    step = rate / padded
    coarse = fft.next_fast_len(min(padded, int(2 * top_hz / step) + 2), real=True)
    kept = min(coarse // 2 + 1, padded // 2 + 1)
    whole = fft.rfft(detrended(a), padded, axis=0)[:kept]
    omega = 2 * np.pi * step * np.arange(kept)
    gain = np.zeros(kept)
    gain[1:] = 1e3 / (1 + (2 * np.pi * corner_hz / omega[1:]) ** 8)
    gain[1:] *= coarse / padded / omega[1:] ** 2
    inside = _inside(t_s, phase, padded / coarse / rate, _ENDS / corner_hz)
    path = fft.irfft(-gain[:, None] * whole, coarse, axis=0)[inside]
    speed = fft.irfft((-1j * omega * gain)[:, None] * whole, coarse, axis=0)[inside]
    return speed, path


def _inside(t_s: Floats, phase: Phase, period_s: float, end_s: float) -> slice:
    """The phase, less what the record's ends disturb (end_s each)."""
    start = max(phase.start_s - t_s[0], end_s)
    end = min(phase.end_s - t_s[0], float(t_s[-1] - t_s[0]) - end_s)
    return slice(int(np.ceil(start / period_s)), max(0, int(end / period_s)) + 1)
