"""How fitted markers follow one another: at the lines of the fit, with the fit's covariance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from olivevib.reconstruction.motion import MotionFit, fitted_ratio
from olivevib.vibration import MarkerResponse, Survey, Transmission


def with_fitted_responses(survey: Survey, fit: MotionFit) -> Survey:
    """The survey with the ratios of the fitted amplitudes in place of H1 and coherence.

    Fitted motions cohere because they were fitted, and hold nothing between their lines: what is
    known is their quotient at each line, at its true frequency.
    """
    return replace(survey, transmissions=tuple(_fitted(t, fit) for t in survey.transmissions))


def _fitted(of: Transmission, fit: MotionFit) -> Transmission:
    markers = {m.id: m for m in fit.markers}
    pair = (markers.get(of.response), markers.get(of.reference))
    unknown = np.full(3, np.nan)
    if pair[0] is None or pair[1] is None or fit.amplitude_refused:
        return replace(of, coherence=unknown, curve=_at(np.empty(0), np.empty((0, 3)), None))
    found = fitted_ratio(pair[0], pair[1])
    f_hz = fit.f_hz * np.arange(1, len(found.ratio) + 1)
    curve = _at(f_hz, found.ratio, np.maximum(found.size_sigma, found.phase_sigma))
    ratio = of.ratio
    if ratio is not None:
        ratio = replace(
            ratio,
            ratio_sigma=ratio.ratio * found.size_sigma[0],
            ratio_total_sigma=ratio.ratio_total * float(found.total_sigma[0]),
            phase_sigma_deg=np.degrees(np.minimum(found.phase_sigma[0], np.pi / np.sqrt(3))),
        )
    return replace(of, coherence=unknown, curve=curve, ratio=ratio)


def _at(f_hz: np.ndarray, h1: np.ndarray, sigma: np.ndarray | None) -> MarkerResponse:
    """A response that stands at some frequencies only: of no segments, without coherence."""
    none = np.full(h1.shape, np.nan)
    return MarkerResponse(f_hz, h1.astype(np.complex128), none, none if sigma is None else sigma, 0)
