"""Line by line: what the camera saw of each line of the sensor, and what it must have seen."""

from __future__ import annotations

import numpy as np

from olivevib.arrays import Floats
from olivevib.comparison.fit import ClockFit, Seen
from olivevib.comparison.forward import SensorMotion, even_acceleration
from olivevib.comparison.types import LineDifference
from olivevib.signals import Samples
from olivevib.vibration.clock import between, measured
from olivevib.vibration.line import LineFit, LineSettings, fit_line
from olivevib.vibration.phases import find_sensor_phases
from olivevib.vibration.verdict import SamplingFacts, fold

_BLOCK_HZ = 400.0  # a sensor is averaged down to about this rate before its lines are looked for
_TOP_HZ = 60.0
_LEAST_GAIN = 0.3  # of the exposure: below, no amplitude is given back


def sensor_lines(sensor: Samples, low_hz: float) -> LineFit:
    """The dominant line of the sensor, its harmonics and neighbours, above low_hz."""
    t_s, a = measured(sensor)
    even_t, even_a, _ = even_acceleration(t_s, a)
    block = max(1, int((even_t.size - 1) / (even_t[-1] - even_t[0]) / _BLOCK_HZ))
    n = even_t.size // block * block
    blocks_t = even_t[:n].reshape(-1, block).mean(axis=1)
    blocks_a = even_a[:n].reshape(-1, block, 3).mean(axis=1)
    rate = (blocks_t.size - 1) / float(blocks_t[-1] - blocks_t[0])
    top = min(_TOP_HZ, 0.49 * rate)
    facts = SamplingFacts(rate, stamps_true=True, band_hz=(min(low_hz, 0.5 * top), top))
    samples = Samples(blocks_t, blocks_a, "acceleration", "m/s2", sensor.axes)
    return fit_line(samples, facts, LineSettings(harmonics=3, neighbours=2, sway=False))


def line_differences(
    seen: Seen, motion: SensorMotion, clock: ClockFit, lines: LineFit
) -> tuple[LineDifference, ...]:
    """Complex amplitude of each line in both, on the camera's times, as peak resultants in m/s2.

    Both carry the exposure's mean, which is divided out again. Lines that fold onto one another
    or onto the slow motion at the camera's rate are left out. ``seen`` may be a part of what the
    clock was fitted to (the steady phase).
    """
    if lines.fit is None:
        return ()
    frequencies = _separable(seen, lines.fit.wave_f_hz() * (1 + clock.drift))
    if not frequencies.size:
        return ()
    basis = _basis(seen, frequencies)
    optical, covariance = _complex(basis, seen.mm)
    since = seen.t_s - clock.t_ref_s
    q = seen.t_s + clock.offset_s + clock.drift * since
    predicted = seen.slow.out(motion.seen(q, seen.exposure_s)) @ clock.R_camera_sensor.T
    sensor, _ = _complex(basis, predicted)
    out = []
    for j, f in enumerate(frequencies):
        to_m_s2 = float((2 * np.pi * f) ** 2 * 1e-3 / np.sinc(f * seen.exposure_s))
        size = float(np.linalg.norm(sensor[j]))
        turn = complex(np.vdot(sensor[j], optical[j]))
        sigma = float(np.sqrt(covariance[j] * np.sum(_share(optical[j]) * clock.noise_mm**2)))
        out.append(
            LineDifference(
                f_hz=float(f),
                optical_m_s2=to_m_s2 * float(np.linalg.norm(optical[j])),
                optical_sigma_m_s2=to_m_s2 * sigma,
                sensor_m_s2=to_m_s2 * size,
                sensor_sigma_m_s2=_sensor_sigma(lines, j, frequencies),
                phase_deg=float(np.degrees(np.angle(turn))),
                phase_sigma_deg=float(np.degrees(sigma / size)) if size > 0 else np.nan,
            )
        )
    return tuple(out)


def _separable(seen: Seen, frequencies: Floats) -> Floats:
    """The frequencies that stay apart at the camera's rate, strongest first as given."""
    span = float(seen.t_s[-1] - seen.t_s[0])
    rate = (seen.t_s.size - 1) / span
    slow = seen.slow.limit_hz + 0.5 / span
    kept: list[float] = []
    folded: list[float] = []
    for f in frequencies:
        at = fold(float(f), rate)
        clear = all(abs(at - other) > 1.5 / span for other in folded)
        open_shutter = float(np.sinc(f * seen.exposure_s)) > _LEAST_GAIN
        if slow < at < rate / 2 - 1.5 / span and clear and open_shutter:
            kept.append(float(f))
            folded.append(at)
    return np.array(kept)


def _basis(seen: Seen, frequencies: Floats) -> Floats:
    turn = 2 * np.pi * np.outer(seen.t_s - seen.t_ref_s, frequencies)
    return seen.slow.out(np.hstack([np.cos(turn), np.sin(turn)]))


def _complex(basis: Floats, values: Floats) -> tuple[np.ndarray, Floats]:
    """Complex amplitudes (J, 3) and the variance factor (J,) of a cosine's coefficient."""
    coefficients = np.linalg.lstsq(basis, values, rcond=None)[0]
    half = basis.shape[1] // 2
    factor = np.diag(np.linalg.inv(basis.T @ basis))
    return coefficients[:half] - 1j * coefficients[half:], (factor[:half] + factor[half:]) / 2


def _share(amplitude: np.ndarray) -> Floats:
    """How much each axis counts in the resultant."""
    power = np.abs(amplitude) ** 2
    total = float(power.sum())
    return power / total if total > 0 else np.full(3, 1 / 3)


def _sensor_sigma(lines: LineFit, j: int, frequencies: Floats) -> float:
    """Sigma of the sensor's own resultant amplitude at that line, m/s2."""
    if lines.fit is None:
        return np.nan
    at = int(np.argmin(np.abs(lines.fit.wave_f_hz() - frequencies[j])))
    share = _share(lines.fit.amplitude[at])
    return float(np.sqrt(np.sum(share * lines.fit.amplitude_sigma[at] ** 2)))


def steady_limits(sensor: Samples, camera_s: Floats, offset_s: float) -> tuple[float, float]:
    """From when to when, on the trial clock, the sensor ran steadily while the camera looked.

    All that both saw where no steady phase is found.
    """
    start, end = float(camera_s[0]), float(camera_s[-1])
    part = between(sensor, start + offset_s, end + offset_s)
    steady = [p for p in find_sensor_phases(part) if p.name == "steady"]
    if not steady:
        return start, end
    return max(start, steady[0].start_s - offset_s), min(end, steady[0].end_s - offset_s)
