"""Lines and figures of a trial whose motion was fitted in continuous time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from olivevib.errors import Caution
from olivevib.reconstruction.continuous import DECIDED, FINER, MOST_CHI2, decided, interval_s
from olivevib.reconstruction.motion import MarkerMotion as FittedMarker
from olivevib.reconstruction.motion import MotionFit, uneven_words
from olivevib.signals import Samples
from olivevib.vibration import (
    CandidateMotion,
    Line,
    LineStatus,
    MarkerMotion,
    Phase,
    SamplingFacts,
    Vibration,
)
from olivevib.vibration.analysis import scaled_line
from olivevib.vibration.clock import between
from olivevib.vibration.figures import LineFigures
from olivevib.vibration.kinematics import QUANTITIES, UNITS, line_motion

OPEN = (LineStatus.AMBIGUOUS, LineStatus.ALIASED)
CANDIDATES = 5
UNLIKELY = 1e-3  # a candidate below that probability is not listed


def fitted_samples(
    fit: MotionFit, motion: Mapping[int, Samples], facts: SamplingFacts
) -> tuple[dict[int, Samples], SamplingFacts, list[Phase]]:
    """The motion inside the fit, facts of its fine grid, and its interval as the steady phase.

    The exposure is corrected in the fit. A marker that was not fitted is left without samples: at
    the frame rate its frequency could not be told.
    """
    start, end = interval_s(fit)
    mine = {m.id for m in fit.markers}
    parts = {
        i: between(s, start, end) if i in mine else between(s, start, start)
        for i, s in motion.items()
    }
    fine = replace(facts, frame_rate_hz=facts.frame_rate_hz * FINER, exposure_s=0.0)
    return parts, fine, [Phase("steady", start, end)]


def with_lines(result: Vibration, fit: MotionFit) -> Vibration:
    """The analysis with the fit's frequency, status, candidates and amplitudes in its lines.

    Where the fit could not decide, the amplitudes stay those of the triangulated paths.
    """
    if not np.isfinite(fit.f_hz):
        return result
    fit = _no_surer_than_it_fits(fit)
    markers = {m.id: m for m in fit.markers}
    table = tuple(_row(row, fit, markers.get(row.id)) for row in result.table)
    spectra = {}
    for n, quantity in enumerate(QUANTITIES):
        spectrum = result.spectra[quantity]
        lines = [
            _line(line, fit, markers.get(int(i)), n)
            for i, line in zip(spectrum.ids, spectrum.lines, strict=True)
        ]
        spectra[quantity] = replace(spectrum, lines=tuple(lines))
    kept = [c for c in result.cautions if c.code not in _CODES]
    return replace(result, table=table, spectra=spectra, cautions=(*kept, *_cautions(fit)))


def _no_surer_than_it_fits(fit: MotionFit) -> MotionFit:
    """The fit; as ambiguous where its best branch does not describe the pictures."""
    if decided(fit) or fit.status not in DECIDED:
        return fit
    misfit = f"misfit {fit.chi2:.3g} times their scatter"
    if fit.chi2 <= MOST_CHI2:
        misfit = f"they scatter {fit.noise_scale:.0f} times more about it than they should"
    why = (
        f"No motion of one frequency describes the pictures ({misfit}): the frequency is not "
        "decided."
    )
    return replace(fit, status=LineStatus.AMBIGUOUS, reasons=(why,))


def _row(row: MarkerMotion, fit: MotionFit, marker: FittedMarker | None) -> MarkerMotion:
    line = _line(row.line, fit, marker, 0)
    figures = {}
    for n, quantity in enumerate(QUANTITIES):
        part = scaled_line(line, n)
        own = getattr(row, quantity)
        figures[quantity] = replace(
            own,
            extent_sigma=float(np.hypot(own.extent_sigma, _swing_sigma(part))),
            line_amplitude=part.amplitude,
            line_amplitude_sigma=part.sigma,
            thd_percent=part.thd_percent,
        )
    candidates = tuple(_candidate(line, f) for f in line.candidates_hz)
    return replace(row, line=line, candidates=candidates, **figures)


def _swing_sigma(line: LineFigures) -> float:
    """Sigma of the line's peak-to-peak along its motion; 0 where the line has none."""
    a, s = line.amplitude, line.sigma
    known = np.isfinite(a) & np.isfinite(s)
    size = float(np.linalg.norm(a[known]))
    return 2 * float(np.linalg.norm(a[known] * s[known])) / size if size > 0 else 0.0


def _candidate(line: Line, f_hz: float) -> CandidateMotion:
    x, v, a = (line_motion(line, n, f_hz).amplitude for n in range(3))
    return CandidateMotion(f_hz, x, v, a, float(np.sqrt(np.sum(a**2) / 2)))


def _line(line: Line, fit: MotionFit, marker: FittedMarker | None, derivative: int) -> Line:
    """The line of one marker in the n-th derivative as the fit sees it."""
    if marker is None or not np.isfinite(fit.f_hz):
        return line
    told = replace(
        line,
        status=fit.status,
        reasons=(*fit.reasons, *fit.next_time),
        **_frequencies(fit),
    )
    if fit.status is LineStatus.BLIND:
        return replace(told, **_UNKNOWN)
    if not decided(fit):
        return told
    reasons = (*fit.reasons, *uneven_words(fit), *fit.next_time)
    base = replace(told, unit="mm", reasons=reasons, **_amplitudes(fit, marker))
    if derivative == 0:
        return base
    scaled = scaled_line(base, derivative)
    return replace(
        base,
        unit=UNITS[QUANTITIES[derivative]],
        amplitude=scaled.amplitude,
        amplitude_sigma=scaled.sigma,
        phase_rad=base.phase_rad + derivative * np.pi / 2,
        harmonics=scaled.harmonics,
    )


_UNKNOWN: dict[str, Any] = {  # of a line that may as well be sway
    "amplitude": np.full(3, np.nan),
    "amplitude_sigma": np.full(3, np.nan),
    "phase_rad": np.full(3, np.nan),
    "harmonics": np.empty((0, 3)),
}


def _frequencies(fit: MotionFit) -> dict[str, Any]:
    """Frequency, candidates (ascending) and their probabilities."""
    sigma = fit.timing.sigma("frequency_hz")
    table = fit.branches
    if decided(fit) or not table.f_hz.size:
        return {"f_hz": fit.f_hz, "f_sigma_hz": sigma, "candidates_hz": (fit.f_hz,)}
    likely = np.flatnonzero(~(table.probability < UNLIKELY))[:CANDIDATES]
    order = likely[np.argsort(table.f_hz[likely])]
    frequencies = tuple(float(f) for f in table.f_hz[order])
    chance = tuple(float(p) for p in table.probability[order])
    weighed = fit.status is LineStatus.AMBIGUOUS and bool(np.isfinite(chance).all())
    weighed = weighed and fit.chi2 <= MOST_CHI2
    return {
        "f_hz": frequencies[0],
        "f_sigma_hz": sigma,
        "candidates_hz": frequencies,
        "probabilities": chance if weighed else (),
    }


def _amplitudes(fit: MotionFit, marker: FittedMarker) -> dict[str, Any]:
    """Amplitudes, sigmas, phases of the fundamental and amplitudes of the harmonics."""
    size = np.hypot(marker.cosine, marker.sine)[:, :3]
    sigma = marker.amplitude_sigma()[:, :3]
    phase = np.arctan2(-marker.sine[0, :3], marker.cosine[0, :3])
    lost = np.array(marker.blind, dtype=np.bool_) | bool(fit.amplitude_refused)
    size = np.where(lost[:, None], np.nan, size)
    sigma = np.where(lost[:, None], np.nan, sigma)
    return {
        "amplitude": size[0],
        "amplitude_sigma": sigma[0],
        "phase_rad": phase,
        "t_ref_s": fit.mid_s + fit.shift_s,
        "harmonics": size[1:],
    }


_CODES = ("frequency-undecided", "frequency-blind", "frequency-chirp", "exposure-blur")


def _cautions(fit: MotionFit) -> list[Caution]:
    remedy = " ".join(fit.next_time)
    why = " ".join(fit.reasons)
    code = {
        LineStatus.AMBIGUOUS: "frequency-undecided",
        LineStatus.ALIASED: "frequency-undecided",
        LineStatus.BLIND: "frequency-blind",
        LineStatus.CHIRP: "frequency-chirp",
    }.get(fit.status)
    out = [Caution(code, why, remedy)] if code else []
    if fit.status is LineStatus.SUPPORTED:
        out.append(Caution("frequency-supported", why, remedy))
    if fit.amplitude_refused:
        out.append(Caution("exposure-too-long", fit.amplitude_refused, remedy))
    return out
