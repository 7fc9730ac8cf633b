"""Analyse a trial: phases, then line, figures and spectra of every marker in every phase."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from olivevib.arrays import Floats
from olivevib.progress import Tick, silent
from olivevib.signals import Samples
from olivevib.vibration.cautions import cautions
from olivevib.vibration.clock import between, clock_of, measured
from olivevib.vibration.figures import NO_LINE, Figures, LineFigures, figures, unknown
from olivevib.vibration.kinematics import (
    FROM_MM,
    QUANTITIES,
    UNITS,
    derive,
    derived_noise,
    line_motion,
)
from olivevib.vibration.line import LineFit, LineSettings, fit_line
from olivevib.vibration.motion import CandidateMotion, MarkerMotion
from olivevib.vibration.phases import WHOLE, Phase, PhaseSettings, find_phases
from olivevib.vibration.result import Vibration
from olivevib.vibration.spectrum import Grid, grid_of, spectra
from olivevib.vibration.types import Line, LineStatus, Spectrum
from olivevib.vibration.verdict import SamplingFacts
from olivevib.vibration.windows import window

_FEWEST = 12


@dataclass(frozen=True)
class VibrationSettings:
    """How a trial is analysed: plotted window, segments of the spectra, line and phase settings."""

    window: str = "hann"
    segments: int = 1
    line: LineSettings = field(default_factory=LineSettings)
    phases: PhaseSettings = field(default_factory=PhaseSettings)

    def __post_init__(self) -> None:
        window(self.window)
        if self.segments < 1:
            raise ValueError(f"segments must be at least 1, got {self.segments}")


def analyse(
    motion: Mapping[int, Samples],
    facts: SamplingFacts,
    settings: VibrationSettings = VibrationSettings(),
    phases: Sequence[Phase] | None = None,
    tick: Tick = silent,
) -> Vibration:
    """Analyse the displacement (mm) of every marker, each on its own times.

    phases: as a person edited them; found from the motion where None. Spectra are of the steady
    phase, or of the whole record where there is none. Markers are worked in the order of their
    ids. A marker with too few samples keeps its rows, with NaN. Raises ValueError for another unit.
    """
    for marker, samples in motion.items():
        if samples.unit != "mm" or len(samples.axes) != 3:
            raise ValueError(f"marker {marker}: need three axes in mm, got {samples.unit}")
    if phases is None:
        phases = find_phases(motion, facts.sway_hz, settings.phases)
    phases = _with_whole(tuple(phases), motion)
    shown = next((p for p in phases if p.name == "steady"), None) or phases[-1]
    rows: list[MarkerMotion] = []
    found: dict[int, LineFit] = {}
    jobs = [(m, p) for m in sorted(motion) for p in phases]
    for done, (marker, phase) in enumerate(jobs):
        tick(done, len(jobs), f"marker {marker}, {phase.name}")
        part = between(motion[marker], phase.start_s, phase.end_s)
        fit = fit_line(part, facts, settings.line)
        rows.append(_row(marker, phase, part, fit, facts))
        if phase is shown:
            found[marker] = fit
    return Vibration(
        phases=phases,
        spectra=_spectra(motion, shown, found, facts, settings, tick),
        table=tuple(rows),
        spectrum_phase=shown.name,
        cautions=cautions(rows, shown.name, facts),
    )


def _with_whole(phases: tuple[Phase, ...], motion: Mapping[int, Samples]) -> tuple[Phase, ...]:
    """The phases, and the whole record last where no steady phase stands for it."""
    if any(p.name == "steady" for p in phases):
        return phases
    ends = [s.t_s[[0, -1]] for s in motion.values() if s.t_s.size > 1]
    start, end = (min(e[0] for e in ends), max(e[1] for e in ends)) if ends else (0.0, 1.0)
    return (*(p for p in phases if p.name != WHOLE), Phase(WHOLE, float(start), float(end)))


# -- one marker in one phase ----------------------------------------------------------------------


def _row(
    marker: int, phase: Phase, part: Samples, found: LineFit, facts: SamplingFacts
) -> MarkerMotion:
    line = found.line
    each = [_figures(n, part, found, facts) for n in range(3)]
    return MarkerMotion(
        id=marker,
        phase=phase.name,
        start_s=phase.start_s,
        end_s=phase.end_s,
        samples=int(measured(part)[0].size),
        line=line,
        displacement=each[0],
        velocity=each[1],
        acceleration=each[2],
        candidates=tuple(_candidate(line, f) for f in line.candidates_hz),
    )


def _figures(n: int, part: Samples, found: LineFit, facts: SamplingFacts) -> Figures:
    """Figures of the n-th derivative; unknown where the motion's true frequency is."""
    quantity = QUANTITIES[n]
    line = scaled_line(found.line, n)
    t_s, values = measured(part)
    if t_s.size < _FEWEST:
        return unknown(quantity, UNITS[quantity])
    noise = np.full(3, np.nan) if found.fit is None else found.fit.noise
    if n:
        derived = _derived(n, part, found, facts)
        if derived is None:
            return unknown(quantity, UNITS[quantity], line)
        values = derived * FROM_MM[quantity]
        top = min(facts.band_hz[1], facts.frame_rate_hz / 2)
        noise = derived_noise(noise, facts.frame_rate_hz, n, top) * FROM_MM[quantity]
    return figures(values, quantity, UNITS[quantity], part.duration_s, noise, line)


def _derived(n: int, part: Samples, found: LineFit, facts: SamplingFacts) -> Floats | None:
    if facts.direct:
        return derive(found, part, n, facts.band_hz[1])
    if found.line.status is LineStatus.SUPPORTED and found.fit is not None:
        return found.fit.motion(measured(part)[0], n, group=0)
    return None


def scaled_line(line: Line, derivative: int) -> LineFigures:
    """The line's figures in the n-th derivative; unknown where its true frequency is."""
    known = line.status in (LineStatus.DIRECT, LineStatus.CONFIRMED, LineStatus.SUPPORTED)
    if line.status in (LineStatus.NONE, LineStatus.CHIRP) or (derivative and not known):
        return NO_LINE
    return line_motion(line, derivative)


def _candidate(line: Line, f_hz: float) -> CandidateMotion:
    x, v, a = (line_motion(line, n, f_hz).amplitude for n in range(3))
    return CandidateMotion(f_hz, x, v, a, float(np.sqrt(np.sum(a**2) / 2)))


# -- spectra --------------------------------------------------------------------------------------


def _spectra(
    motion: Mapping[int, Samples],
    phase: Phase,
    found: Mapping[int, LineFit],
    facts: SamplingFacts,
    settings: VibrationSettings,
    tick: Tick,
) -> dict[str, Spectrum]:
    """Spectra of all markers on one grid; derivatives only where no alias can lie in the band."""
    parts = {m: between(motion[m], phase.start_s, phase.end_s) for m in sorted(motion)}
    grid, shape = _common_grid(parts, settings.segments), window(settings.window)
    f_hz = grid.f_hz if grid else np.empty(0)
    size = (f_hz.size, len(parts), 3)
    amplitude, density = np.full(size, np.nan), np.full(size, np.nan)
    for at, (marker, part) in enumerate(parts.items()):
        tick(at, len(parts), f"spectrum of marker {marker}")
        t_s, values = measured(part)
        if grid and t_s.size >= _FEWEST:
            amplitude[:, at], density[:, at] = spectra(t_s, values, grid, shape)
    lines = [found[m].line for m in parts]
    out = {}
    for n, quantity in enumerate(QUANTITIES):
        gain = (2 * np.pi * f_hz[:, None, None]) ** n * FROM_MM[quantity]
        gain = gain if n == 0 or facts.direct else gain * np.nan
        out[quantity] = Spectrum(
            f_hz=f_hz,
            ids=np.array(sorted(parts), dtype=np.int64),
            amplitude=gain * amplitude,
            psd=gain**2 * density,
            quantity=quantity,
            unit=UNITS[quantity],
            window=settings.window,
            resolution_hz=grid.step_hz if grid else np.nan,
            enbw_bins=shape.enbw_bins,
            lines=tuple(_line_of(line, n) for line in lines),
            phase=phase.name,
            start_s=phase.start_s,
            end_s=phase.end_s,
        )
    return out


def _common_grid(parts: Mapping[int, Samples], segments: int) -> Grid | None:
    """The grid of the marker with the most places; None where no marker has enough samples."""
    clocks = [clock_of(t) for t in (measured(p)[0] for p in parts.values()) if t.size >= _FEWEST]
    return grid_of(max(clocks, key=lambda c: c.places), segments) if clocks else None


def _line_of(line: Line, derivative: int) -> Line:
    """The same line in the n-th derivative; amplitudes NaN where its true frequency is unknown."""
    if derivative == 0:
        return line
    scaled = scaled_line(line, derivative)
    return Line(
        f_hz=line.f_hz,
        f_sigma_hz=line.f_sigma_hz,
        status=line.status,
        candidates_hz=line.candidates_hz,
        amplitude=scaled.amplitude,
        amplitude_sigma=scaled.sigma,
        phase_rad=line.phase_rad + derivative * np.pi / 2,
        t_ref_s=line.t_ref_s,
        unit=UNITS[QUANTITIES[derivative]],
        harmonics=scaled.harmonics,
        probabilities=line.probabilities,
        reasons=line.reasons,
    )
