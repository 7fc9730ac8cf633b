"""Beyond lines and figures: orbit, rotation, decay, ridge of each marker; how they go together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats, floats
from olivevib.progress import Tick, silent
from olivevib.signals import Samples
from olivevib.vibration.body import Attitude, Turning, turning
from olivevib.vibration.clock import between, measured
from olivevib.vibration.modal import Decay, fit_decay
from olivevib.vibration.motion import MarkerMotion
from olivevib.vibration.orbit import Orbit, orbit, precession
from olivevib.vibration.phases import Phase
from olivevib.vibration.response import MarkerResponse, marker_response, segment_length_s
from olivevib.vibration.ridge import camera_ridge
from olivevib.vibration.transfer import Deflection, LineRatio, deflection_shape, line_ratio
from olivevib.vibration.types import Line, LineStatus
from olivevib.vibration.verdict import SamplingFacts, fold

_RIDGE_WINDOW_S, _RIDGE_HOP_S = 1.0, 0.2
_STRONG = 10.0  # evidence below which a window of the ridge shows noise
_DECAY_SLOW_HZ = 0.5
_EXPLAINED = 0.5  # of the motion that a decaying sine must explain
_DAMPING_KNOWN = 0.5  # relative sigma of the damping: a larger one knows nothing
_DECIDED = (LineStatus.DIRECT, LineStatus.CONFIRMED, LineStatus.SUPPORTED)


@dataclass(frozen=True)
class MarkerSurvey:
    """One marker: orbit of its line, precession, rotation, free decay, ridge of its spectrogram.

    precession_deg_s with sigma, NaN where the orbit is too short or unknown. decay: natural
    frequency, damping ratio, with sigmas, and the share of the motion that they explain; NaN
    without a free decay. ridge_t_s (K,), ridge_f_hz (K,) as the frame rate shows it, ridge_true_hz
    (K,) on the line's own branch where that is known, ridge_rms_mm (K,) of the vector.
    """

    id: int
    orbit: Orbit
    precession_deg_s: float
    precession_sigma_deg_s: float
    turning: Turning | None
    decay_f_hz: float
    decay_f_sigma_hz: float
    decay_damping: float
    decay_damping_sigma: float
    decay_share: float
    ridge_t_s: Floats
    ridge_f_hz: Floats
    ridge_true_hz: Floats
    ridge_rms_mm: Floats

    def __post_init__(self) -> None:
        t_s = floats("ridge_t_s", self.ridge_t_s, (None,))
        object.__setattr__(self, "ridge_t_s", t_s)
        for name in ("ridge_f_hz", "ridge_true_hz", "ridge_rms_mm"):
            value = floats(name, getattr(self, name), (t_s.size,), nan=True)
            object.__setattr__(self, name, value)


@dataclass(frozen=True)
class Transmission:
    """From the reference marker to another: their common line's ratio, and the whole response.

    ratio None: they share no line. coherence (3,) at the line, from segments of the whole trial.
    """

    response: int
    reference: int
    ratio: LineRatio | None
    coherence: Floats
    curve: MarkerResponse

    def __post_init__(self) -> None:
        value = floats("coherence", self.coherence, (3,), nan=True)
        object.__setattr__(self, "coherence", value)


@dataclass(frozen=True)
class NamedMotion:
    """A motion that a person asked for: a point of a marker's body, or a marker against another."""

    name: str
    marker: int
    relative_to: int | None
    at_mm: tuple[float, float, float]
    row: MarkerMotion


@dataclass(frozen=True)
class Survey:
    """What the markers do in the phase shown: each by itself, and together."""

    phase: str
    markers: tuple[MarkerSurvey, ...]
    transmissions: tuple[Transmission, ...] = ()
    deflection: Deflection | None = None
    motions: tuple[NamedMotion, ...] = ()

    def of(self, marker_id: int) -> MarkerSurvey | None:
        """What is known of one marker, or None."""
        return next((m for m in self.markers if m.id == marker_id), None)


def survey(
    motion: Mapping[int, Samples],
    attitudes: Mapping[int, Attitude],
    lines: Mapping[int, Line],
    phases: Sequence[Phase],
    shown: Phase,
    facts: SamplingFacts,
    reference: int | None = None,
    tick: Tick = silent,
) -> Survey:
    """Survey the markers' displacement (mm) and attitudes in the phase shown.

    lines: the dominant line of each marker in that phase. reference: the marker that the others are
    compared with; the first of all where None.
    """
    markers = []
    for done, marker in enumerate(sorted(motion)):
        tick(done, len(motion), f"orbit and ridge of marker {marker}")
        markers.append(
            _marker(
                marker, motion[marker], attitudes.get(marker), lines[marker], phases, shown, facts
            )
        )
    of = min(motion, default=None) if reference not in motion else reference
    others = [] if of is None else [m for m in sorted(motion) if m != of]
    between_markers = []
    for done, m in enumerate(others):
        if of is not None:
            tick(done, len(others), f"marker {m} against {of}")
            between_markers.append(_transmission(m, of, motion, lines, facts))
    return Survey(shown.name, tuple(markers), tuple(between_markers), deflection_shape(lines))


def _marker(
    marker: int,
    samples: Samples,
    attitude: Attitude | None,
    line: Line,
    phases: Sequence[Phase],
    shown: Phase,
    facts: SamplingFacts,
) -> MarkerSurvey:
    part = between(samples, shown.start_s, shown.end_s)
    turned = precession(part, line)
    known = turned is not None and not orbit(line).straight
    decay = _decay(samples, phases)
    ridge = camera_ridge([samples], facts.sway_hz, _RIDGE_WINDOW_S, _RIDGE_HOP_S)
    seen = np.where(ridge.evidence > _STRONG, ridge.f_hz, np.nan)
    sigmas = (np.nan, np.nan) if decay is None else (decay.f_sigma_hz[0], decay.damping_sigma[0])
    return MarkerSurvey(
        id=marker,
        orbit=orbit(line),
        precession_deg_s=turned.rate_deg_s if turned is not None and known else np.nan,
        precession_sigma_deg_s=turned.rate_sigma_deg_s if turned is not None and known else np.nan,
        turning=None if attitude is None else turning(attitude, shown, facts),
        decay_f_hz=np.nan if decay is None else float(decay.f_hz[0]),
        decay_f_sigma_hz=float(sigmas[0]),
        decay_damping=np.nan if decay is None else float(decay.damping[0]),
        decay_damping_sigma=float(sigmas[1]),
        decay_share=np.nan if decay is None else decay.share,
        ridge_t_s=ridge.t_s,
        ridge_f_hz=seen,
        ridge_true_hz=_true(seen, line, facts),
        ridge_rms_mm=ridge.rms,
    )


def _decay(samples: Samples, phases: Sequence[Phase]) -> Decay | None:
    """The free decay of one marker; None without one, or where no decaying sine explains it."""
    last = next((p for p in phases if p.name == "decay"), None)
    if last is None:
        return None
    t_s, values = measured(between(samples, last.start_s, last.end_s))
    if t_s.size < 16:
        return None
    found = fit_decay(t_s, values, slow_hz=_DECAY_SLOW_HZ)
    sure = found.damping_sigma[0] < _DAMPING_KNOWN * found.damping[0]
    return found if sure and found.share > _EXPLAINED and found.converged else None


def _true(seen_hz: Floats, line: Line, facts: SamplingFacts) -> Floats:
    """Frequencies as seen, carried to the branch of the line; NaN where that is not known."""
    if line.status not in _DECIDED:
        return np.full(seen_hz.shape, np.nan)
    if facts.direct:
        return seen_hz
    nearest = facts.frame_rate_hz * np.rint(line.f_hz / facts.frame_rate_hz)
    side = 1.0 if line.f_hz >= nearest else -1.0
    return np.asarray(nearest + side * seen_hz)


def _transmission(
    response: int,
    reference: int,
    motion: Mapping[int, Samples],
    lines: Mapping[int, Line],
    facts: SamplingFacts,
) -> Transmission:
    x, y = motion[reference], motion[response]
    curve = marker_response(x, y, segment_length_s(min(x.duration_s, y.duration_s)))
    ratio = line_ratio(lines[response], lines[reference])
    at = np.nan if ratio is None else ratio.f_hz
    seen = at if facts.direct or not np.isfinite(at) else fold(at, facts.frame_rate_hz)
    return Transmission(response, reference, ratio, curve.coherence_at(seen), curve)
