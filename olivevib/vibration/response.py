"""Frequency response and coherence of two markers, on their true times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Floats, floats
from olivevib.signals import Samples
from olivevib.vibration.clock import clock_of, measured
from olivevib.vibration.sums import Complexes, fourier_sums
from olivevib.vibration.windows import window

_WHOLE = 0.9  # of a segment's samples that must be there
_SEGMENTS = 8  # independent ones that coherence needs; fewer than two give nothing


@dataclass(frozen=True)
class MarkerResponse:
    """Response of one marker to another, axis by axis, as seen at the frame rate.

    f_hz (F,); h1 (F, 3) complex; coherence (F, 3), which noise alone brings to 1/segments: trust it
    from 0.8 and from 8 segments on; sigma (F, 3) of |H1|, relative, and of its phase in rad.
    """

    f_hz: Floats
    h1: NDArray[np.complex128]
    coherence: Floats
    sigma: Floats
    segments: int

    def __post_init__(self) -> None:
        f_hz = floats("f_hz", self.f_hz, (None,))
        object.__setattr__(self, "f_hz", f_hz)
        for name in ("coherence", "sigma"):
            value = floats(name, getattr(self, name), (f_hz.size, 3), nan=True)
            object.__setattr__(self, name, value)

    def coherence_at(self, f_hz: float) -> Floats:
        """(3,) coherence at the bin nearest to a frequency as the frame rate shows it."""
        if not self.f_hz.size or not np.isfinite(f_hz):
            return np.full(3, np.nan)
        return np.asarray(self.coherence[int(np.argmin(np.abs(self.f_hz - f_hz)))])


def marker_response(reference: Samples, response: Samples, segment_s: float) -> MarkerResponse:
    """H1 and coherence of two displacements, each on its own instants; gaps stay gaps.

    Hann segments that overlap by half; Fourier sums on the true times, so that two markers seen at
    different rows are in step. A segment of which less than 90 % was seen is left out. Best over a
    whole trial (start-up and shut-down sweep the frequencies): a steady tone has only its own.
    No segments: empty. Relative SD sqrt((1 - g2)/(2 g2 nd)), nd independent segments.
    """
    (xt, x), (yt, y) = measured(reference), measured(response)
    nothing = np.empty((0, 3))
    none = MarkerResponse(np.empty(0), nothing.astype(np.complex128), nothing, nothing, 0)
    if min(xt.size, yt.size) < 16:
        return none
    start, end = max(xt[0], yt[0]), min(xt[-1], yt[-1])
    rate = min(clock_of(xt).rate_hz, clock_of(yt).rate_hz)
    count = int(segment_s * rate / 2)
    pairs = []
    for at in np.arange(start, end - segment_s + 1e-9, segment_s / 2):
        first = _segment(xt, x, float(at), segment_s, count, rate)
        second = _segment(yt, y, float(at), segment_s, count, rate)
        if first is not None and second is not None:
            pairs.append((first, second))
    if len(pairs) < 2:
        return none
    return _averaged(pairs, segment_s)


def _segment(
    t_s: Floats, values: Floats, at_s: float, span_s: float, count: int, rate_hz: float
) -> Complexes | None:
    inside = (t_s >= at_s) & (t_s < at_s + span_s)
    if inside.sum() < max(4, _WHOLE * span_s * rate_hz):
        return None
    since = t_s[inside] - at_s
    w = window("hann").at(since / span_s)
    x = values[inside]
    x = (x - (w @ x) / w.sum()) * w[:, None]
    return fourier_sums(since, x, 1.0 / span_s, count)[1:]


def _averaged(pairs: list[tuple[Complexes, Complexes]], segment_s: float) -> MarkerResponse:
    x, y = (np.stack([pair[k] for pair in pairs]) for k in (0, 1))
    sxx, syy = np.sum(np.abs(x) ** 2, axis=0), np.sum(np.abs(y) ** 2, axis=0)
    sxy = np.sum(np.conj(x) * y, axis=0)
    independent = (len(pairs) + 1) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        coherence = np.clip(np.abs(sxy) ** 2 / (sxx * syy), 0.0, 1.0)
        sigma = np.sqrt((1 - coherence) / (2 * coherence * independent))
        h1 = sxy / sxx
    return MarkerResponse(
        f_hz=np.arange(1, x.shape[1] + 1) / segment_s,
        h1=h1,
        coherence=coherence,
        sigma=np.where(np.isfinite(sigma), sigma, np.nan),
        segments=int(independent),
    )


def segment_length_s(duration_s: float) -> float:
    """The length of a segment that gives eight independent ones, between 0.5 and 2 s."""
    return float(np.clip(duration_s / _SEGMENTS, 0.5, 2.0))
