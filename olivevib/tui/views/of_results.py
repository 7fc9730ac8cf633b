"""From the results of a trial to what the plots draw: orbits, spectra, motion, comparison."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from rich.text import Text

from olivevib.arrays import Floats
from olivevib.comparison import Comparison
from olivevib.reconstruction import Trajectory
from olivevib.tui.harmless import harmless
from olivevib.tui.views.motion import Band, MotionPlot
from olivevib.tui.views.orbits import Orbit
from olivevib.tui.views.palette import Palette
from olivevib.tui.views.spectrum import Mark, SpectrumPlot, folded
from olivevib.tui.views.words import DECIDED, alone, frequency
from olivevib.vibration import Line, LineStatus, Phase, Spectrum, Vibration

AXES = ("all", "x", "y", "z")
QUANTITIES = ("displacement", "velocity", "acceleration")
SHAPELESS = (LineStatus.NONE, LineStatus.BLIND, LineStatus.CHIRP)
_ROUND = 2 * np.pi * np.arange(97) / 96


def marker_name(marker: int, places: Mapping[int, str]) -> str:
    """``3 trunk``, or the id alone."""
    place = harmless(places.get(marker, ""), 24)
    return f"{marker} {place}".strip()


def shown_phase(vibration: Vibration | None) -> Phase | None:
    """The phase that headline numbers are of, or None before analyse."""
    if vibration is None:
        return None
    return next((p for p in vibration.phases if p.name == vibration.spectrum_phase), None)


def orbits_of(
    trajectory: Trajectory, vibration: Vibration | None, summary: Mapping[str, Any]
) -> tuple[Orbit, ...]:
    """One orbit a marker, in the phase of the headline numbers; all of it before analyse."""
    told = {m["id"]: m for m in summary["markers"]}
    return tuple(
        Orbit(
            int(marker),
            _caption(told.get(int(marker), {})),
            path_mm(trajectory, k, shown_phase(vibration)),
            ellipse_mm(_line(vibration, int(marker))),
        )
        for k, marker in enumerate(trajectory.ids)
    )


def _caption(marker: Mapping[str, Any]) -> str:
    place, size = harmless(marker.get("place") or "", 12), marker.get("displacement_pp_mm")
    told = f"{alone(size, marker['displacement_pp_sigma_mm'], 2)} mm" if size else ""
    return " · ".join(part for part in (place, told) if part)


def path_mm(trajectory: Trajectory, column: int, phase: Phase | None) -> Floats:
    """(N, 3) displacement of one marker about its mean, within a phase; NaN = not seen."""
    t_s, xyz = trajectory.sample_t_s[:, column], trajectory.xyz_mm[:, column]
    if phase is not None:
        xyz = xyz[(t_s >= phase.start_s) & (t_s <= phase.end_s)]
    seen = xyz[np.isfinite(xyz).all(axis=1)]
    return np.asarray(xyz - seen.mean(axis=0)) if seen.size else np.full((0, 3), np.nan)


def ellipse_mm(line: Line | None) -> Floats:
    """(K, 3) closed curve of a line; empty where its status does not allow one."""
    if line is None or line.status in SHAPELESS or not np.isfinite(line.amplitude).all():
        return np.empty((0, 3))
    return np.asarray(line.amplitude * np.cos(_ROUND[:, None] + line.phase_rad))


def _line(vibration: Vibration | None, marker: int) -> Line | None:
    row = vibration.row(marker) if vibration else None
    return row.line if row else None


def spectrum_of(
    vibration: Vibration,
    marker: int,
    quantity: str,
    axis: str,
    rate_hz: float | None,
    name: str,
) -> SpectrumPlot | None:
    """The spectrum of one marker; ``axis`` "all": the three axes together (root of the squares)."""
    spectrum = vibration.spectra[quantity]
    column = np.flatnonzero(spectrum.ids == marker)
    if not column.size or spectrum.f_hz.size < 3:
        return None
    k = int(column[0])
    values = spectrum.amplitude[:, k]
    amplitude = (
        np.sqrt(np.sum(values**2, axis=1)) if axis == "all" else values[:, "xyz".index(axis)]
    )
    which = "xyz" if axis == "all" else axis
    return SpectrumPlot(
        title=f"marker {name} · {quantity} {which} · {_phase_words(spectrum)}",
        f_hz=spectrum.f_hz,
        amplitude=amplitude,
        unit=spectrum.unit.replace("s2", "s²"),
        marks=marks_of(spectrum.lines[k], rate_hz or 2 * float(spectrum.f_hz[-1])),
    )


def _phase_words(spectrum: Spectrum) -> str:
    if not np.isfinite(spectrum.start_s):
        return spectrum.phase
    return f"{spectrum.phase} {spectrum.start_s:.1f}–{spectrum.end_s:.1f} s"


def marks_of(line: Line, rate_hz: float) -> tuple[Mark, ...]:
    """Where a line shows and what is known of it; () where no line stands out."""
    f_hz = line.candidates_hz[0] if line.candidates_hz else line.f_hz
    if line.status is LineStatus.NONE or not np.isfinite(f_hz):
        return ()
    decided = line.status in DECIDED
    words = frequency(line.f_hz, line.f_total_sigma_hz, line.status, line.candidates_hz)
    seen = folded(f_hz, rate_hz)
    if decided and abs(seen - f_hz) > 1e-6:
        words += f" (seen at {seen:.2f} Hz)"
    return (Mark(seen, words, decided),)


def bands_of(vibration: Vibration | None) -> tuple[Band, ...]:
    """The phases as stretches of time; none before analyse."""
    return tuple(Band(p.name, p.start_s, p.end_s) for p in vibration.phases) if vibration else ()


def motion_of(
    trajectory: Trajectory, vibration: Vibration | None, marker: int, name: str
) -> MotionPlot:
    """Displacement of one marker over the trial clock, phases marked."""
    k = int(np.flatnonzero(trajectory.ids == marker)[0])
    bands = bands_of(vibration)
    path = path_mm(trajectory, k, None)
    t_s = trajectory.sample_t_s[:, k] if path.size else np.empty(0)
    title = f"marker {name} · displacement from its mean · {trajectory.frame}"
    return MotionPlot(title, t_s, (("camera", path),), "mm", bands)


def comparison_of(comparison: Comparison, residual: bool) -> MotionPlot:
    """The overlay of camera and accelerometer, or what remains between them."""
    camera, sensor = comparison.optical_mm, comparison.sensor_mm
    name = f"marker {comparison.marker} · {harmless(comparison.sensor, 40)}"
    if residual:
        curves: tuple[tuple[str, Floats], ...] = (("camera − sensor", camera - sensor),)
        return MotionPlot(f"{name} · camera − sensor", comparison.overlay_t_s, curves, "mm")
    curves = (("camera", camera), ("sensor", sensor))
    return MotionPlot(f"{name} · camera, over it the sensor", comparison.overlay_t_s, curves, "mm")


def phases_text(vibration: Vibration | None, palette: Palette) -> Text:
    """The phases with their limits, one line; what to do where there are none yet."""
    if vibration is None:
        return Text("Not analysed yet: Esc, then r runs every stage.", palette.muted)
    out = Text()
    for phase in vibration.phases:
        style = palette.good if phase.name == vibration.spectrum_phase else palette.text
        out.append(f"{phase.name} ", style)
        limits = f"{phase.start_s:.2f}–{phase.end_s:.2f} s ({phase.duration_s:.2f} s)   "
        out.append(limits, palette.muted)
    return out
