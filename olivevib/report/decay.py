"""The free decay after the machine lets go, as it is drawn: samples and fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats
from olivevib.reconstruction.trajectory import Trajectory
from olivevib.vibration import MarkerSurvey, Phase, Survey

FEWEST = 8  # samples that are worth drawing


@dataclass(frozen=True)
class FreeDecay:
    """One marker's decay: times (N,), displacement (N, 3) in mm, and the pole of the analysis.

    cosine, sine (3,) and rest (3,): the amplitudes that go best with that pole.
    """

    found: MarkerSurvey
    t_s: Floats
    xyz_mm: Floats
    cosine: Floats
    sine: Floats
    rest: Floats

    @property
    def fall(self) -> float:
        """Decay rate, 1/s."""
        return float(2 * np.pi * self.found.decay_f_hz * self.found.decay_damping)

    def curve(self, t_s: Floats) -> Floats:
        """The fitted motion (K, 3) at times t_s (K,), mm."""
        waves = _waves(self.found, np.asarray(t_s) - self.t_s[0])
        return np.asarray(waves @ np.stack([self.cosine, self.sine, self.rest]))


def free_decays(
    survey: Survey | None, path: Trajectory | None, phases: Sequence[Phase]
) -> tuple[FreeDecay, ...]:
    """The decays that the analysis found, by marker; () where there are none."""
    span = next((p for p in phases if p.name == "decay"), None)
    if survey is None or span is None or path is None:
        return ()
    out = []
    for found in survey.markers:
        if not np.isfinite(found.decay_f_hz) or found.id not in path.ids:
            continue
        samples = path.samples(found.id)
        inside = (samples.t_s >= span.start_s) & (samples.t_s <= span.end_s)
        t_s, values = samples.t_s[inside], samples.values[inside]
        if t_s.size >= FEWEST:
            waves = _waves(found, t_s - t_s[0])
            fit = np.linalg.lstsq(waves, values, rcond=None)[0]
            out.append(FreeDecay(found, t_s, values, *fit))
    return tuple(out)


def _waves(found: MarkerSurvey, since_s: Floats) -> Floats:
    """(N, 3): decaying cosine and sine of the pole, and one."""
    omega = 2 * np.pi * found.decay_f_hz
    wd = omega * np.sqrt(1 - found.decay_damping**2)
    fade = np.exp(-found.decay_damping * omega * since_s)
    waves = (fade * np.cos(wd * since_s), fade * np.sin(wd * since_s), np.ones(since_s.size))
    return np.stack(waves, axis=1)
