"""From trunk to branch: transmissibility of lines, frequency response and coherence of noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from olivevib.arrays import Floats, floats
from olivevib.vibration.orbit import complex_amplitude
from olivevib.vibration.types import Line, LineStatus
from olivevib.vibration.windows import window

_DIRECTLY_COMPARED = 1e-9  # of a frequency
_CIRCULAR = np.pi / np.sqrt(3)  # rad: standard deviation of a phase that is not known at all


@dataclass(frozen=True)
class LineRatio:
    """Response over reference at their common line, the same whatever alias is the true one.

    ratio (3,) per axis and ratio_total of the resultants, with sigmas; phase_deg (3,), phase of
    the response against the reference; NaN where an axis of the reference is within its noise.
    """

    f_hz: float
    ratio: Floats
    ratio_sigma: Floats
    ratio_total: float
    ratio_total_sigma: float
    phase_deg: Floats
    phase_sigma_deg: Floats

    def __post_init__(self) -> None:
        for name in ("ratio", "ratio_sigma", "phase_deg", "phase_sigma_deg"):
            object.__setattr__(self, name, floats(name, getattr(self, name), (3,), nan=True))

    @property
    def decibels(self) -> float:
        """20 log10 of the total ratio."""
        return float(20 * np.log10(self.ratio_total)) if self.ratio_total > 0 else np.nan


def line_ratio(response: Line, reference: Line) -> LineRatio | None:
    """Transmissibility of a line from reference to response (both of the same phase of the trial).

    The ratio of amplitudes needs no true frequency. None where one has no line, or the two
    frequencies differ by more than three sigma. Phase needs equal frequencies: the response is
    carried to the reference's instant with their mean.
    """
    lines = (response, reference)
    if any(x.status is LineStatus.NONE or not np.isfinite(x.amplitude).any() for x in lines):
        return None
    apart = abs(response.f_hz - reference.f_hz)
    sigma = float(np.hypot(response.f_sigma_hz, reference.f_sigma_hz))
    if apart > 3 * sigma + _DIRECTLY_COMPARED * reference.f_hz:
        return None
    f = (response.f_hz + reference.f_hz) / 2
    carry = np.exp(2j * np.pi * f * (reference.t_ref_s - response.t_ref_s))
    above, below = complex_amplitude(response) * carry, complex_amplitude(reference)
    known = np.abs(below) > 3 * reference.amplitude_sigma
    quotient = np.where(known, above / np.where(known, below, 1.0), np.nan)
    ratio = np.abs(quotient)
    parts = _relative(response) ** 2 + _relative(reference) ** 2
    total, total_sigma = _total(response, reference)
    phase_sigma = np.minimum(np.sqrt(parts), _CIRCULAR)
    return LineRatio(
        f_hz=f,
        ratio=ratio,
        ratio_sigma=ratio * np.sqrt(parts),
        ratio_total=total,
        ratio_total_sigma=total_sigma,
        phase_deg=np.degrees(np.angle(quotient)),
        phase_sigma_deg=np.where(known, np.degrees(phase_sigma), np.nan),
    )


def _relative(line: Line) -> Floats:
    safe = np.where(line.amplitude > 0, line.amplitude, np.nan)
    return np.asarray(line.amplitude_sigma / safe)


def _total(response: Line, reference: Line) -> tuple[float, float]:
    sizes = [float(np.sqrt(np.sum(x.amplitude**2))) for x in (response, reference)]
    sigmas = [
        float(np.sqrt(np.sum((x.amplitude * x.amplitude_sigma) ** 2)) / size)
        for x, size in zip((response, reference), sizes, strict=True)
    ]
    ratio = sizes[0] / sizes[1]
    return ratio, ratio * float(np.hypot(sigmas[0] / sizes[0], sigmas[1] / sizes[1]))


@dataclass(frozen=True)
class Response:
    """Frequency response of one signal to another by Welch's method, with its scatter.

    f_hz (F,); h1 (F,) = Sxy/Sxx (noise on the response), h2 = Syy/Syx (noise on the reference),
    complex; coherence (F,) 0 ... 1 (noise alone gives 1/segments: trust it from 0.8 and from 8
    segments on); relative_sigma (F,): of |H|, and the phase's sigma in rad.
    """

    f_hz: Floats
    h1: np.ndarray
    h2: np.ndarray
    coherence: Floats
    relative_sigma: Floats
    segments: int


def frequency_response(
    reference: Floats, response: Floats, rate_hz: float, segment: int, overlap: float = 0.5
) -> Response:
    """H1, H2 and coherence of evenly sampled response (N,) to reference (N,), Hann segments.

    Mean removed per segment. sigma = sqrt((1 - g2)/(2 g2 nd)) with nd independent segments (an
    overlap of half adds little: nd is the record over the segment). Raises ValueError where fewer
    than two segments fit.
    """
    n = min(reference.size, response.size)
    hop = max(1, round(segment * (1 - overlap)))
    starts = np.arange(0, n - segment + 1, hop)
    if starts.size < 2:
        raise ValueError(f"{n} samples hold fewer than two segments of {segment}")
    w = window("hann").at(np.arange(segment) / segment)
    x, y = (_segments(v[:n], starts, segment, w) for v in (reference, response))
    sxx, syy = np.sum(np.abs(x) ** 2, axis=0), np.sum(np.abs(y) ** 2, axis=0)
    sxy = np.sum(np.conj(x) * y, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        coherence = np.clip(np.abs(sxy) ** 2 / (sxx * syy), 0.0, 1.0)
        nd = n / segment
        sigma = np.sqrt((1 - coherence) / (2 * coherence * nd))
        h1, h2 = sxy / sxx, syy / np.conj(sxy)
    return Response(
        f_hz=fft.rfftfreq(segment, 1 / rate_hz),
        h1=h1,
        h2=h2,
        coherence=coherence,
        relative_sigma=sigma,
        segments=int(nd),
    )


def _segments(values: Floats, starts: np.ndarray, segment: int, w: Floats) -> np.ndarray:
    frames = values[starts[:, None] + np.arange(segment)]
    frames = frames - frames.mean(axis=1, keepdims=True)
    return np.asarray(fft.rfft(frames * w, axis=1))


@dataclass(frozen=True)
class Deflection:
    """Operating deflection shape: complex amplitude (M, 3) of each marker at their common line.

    All at one instant, turned so that the largest is real: markers move as Re(shape exp(i w t)).
    """

    ids: tuple[int, ...]
    f_hz: float
    shape: NDArray[np.complex128]
    unit: str


def deflection_shape(lines: Mapping[int, Line]) -> Deflection | None:
    """The shape in which markers move at their common line; None without two of them.

    Markers whose line lies more than three sigma from the weighted mean frequency are left out.
    Valid whatever alias is the true one, but for the sense in time (an odd fold conjugates it).
    """
    known = {m: x for m, x in sorted(lines.items()) if np.isfinite(x.amplitude).all()}
    if len(known) < 2:
        return None
    weights = np.array([1.0 / max(x.f_sigma_hz, 1e-12) ** 2 for x in known.values()])
    f = float(np.sum(weights * [x.f_hz for x in known.values()]) / weights.sum())
    alike = {m: x for m, x in known.items() if abs(x.f_hz - f) <= 3 * x.f_sigma_hz + 1e-9 * f}
    if len(alike) < 2:
        return None
    start = next(iter(alike.values())).t_ref_s
    rows = [
        complex_amplitude(x) * np.exp(2j * np.pi * f * (start - x.t_ref_s)) for x in alike.values()
    ]
    shape = np.array(rows)
    largest = shape.ravel()[int(np.argmax(np.abs(shape)))]
    unit = next(iter(alike.values())).unit
    return Deflection(tuple(alike), f, shape * np.exp(-1j * np.angle(largest)), unit)
