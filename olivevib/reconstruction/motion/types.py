"""What the continuous-time fit of marker motion takes, and what it hands back.

Each observation carries its own time: row-0 time of its frame + row x row time, and for the right
camera the offset and drift between the cameras. A marker's motion about its mean pose (R0, t0) is

    xi(t) = sum_b s_b B_b(t) + a(t) sum_h [C_h cos(h phi(t)) + S_h sin(h phi(t))],

xi = (translation mm, rotation vector rad), phi(t) = 2 pi f0 (t - t_mid) + psi(t); its images are
pi(exp(r) R0 p + t0 + x). Source: knowledge of the field, sampling time (CONVENTIONS.md, Time).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf, nan
from typing import TypeAlias

import numpy as np

from olivevib.arrays import Floats, Ints, floats
from olivevib.vibration.types import LineStatus

# (f_hz, exposure_s, amplitude_px) -> (amplitude found over true, its sigma); None: no amplitude
Gain: TypeAlias = Callable[[float, float, float], tuple[float, float] | None]

TIMING = ("frequency_hz", "right_offset_s", "right_drift", "left_row_time_s", "right_row_time_s")


@dataclass(frozen=True)
class Anchor:
    """What is known of time before the fit, from elsewhere: the frequency can be no surer.

    Row times signed, s per raw row; sources as CameraModel.row_time_source ("declared", "led",
    "board", "global", "unknown"). right_offset_s is added to the right camera's stamps and holds at
    ``reference_row``; sigma inf: not known. stamps_true: stamps belong to exposures.
    """

    left_row_time_s: float = 0.0
    left_row_time_sigma_s: float = inf
    right_row_time_s: float = 0.0
    right_row_time_sigma_s: float = inf
    row_time_source: str = "unknown"
    right_offset_s: float = 0.0
    right_offset_sigma_s: float = inf
    reference_row: float = 0.0
    offset_source: str = "unknown"
    stamps_true: bool = True
    drift_sigma: float = 1e-4

    def __post_init__(self) -> None:
        for name in ("left_row_time_sigma_s", "right_row_time_sigma_s", "right_offset_sigma_s"):
            value = getattr(self, name)
            object.__setattr__(self, name, inf if np.isnan(value) else float(value))
            if value < 0:
                raise ValueError(f"{name} must not be negative, got {value}")


@dataclass(frozen=True)
class MotionSettings:
    """band_hz: where the machine may run (band_declared: a person said so); harmonics: H.

    knot_s: spacing of the sway's knots, None: the longest that follows the sway. sigma_*: prior
    standard deviations. offset_search_s: half width of the search where the offset is not known.
    periodic: False fits the sway spline alone, up to ``free_band_hz`` (release tests).
    """

    band_hz: tuple[float, float] = (5.0, 45.0)
    band_declared: bool = False
    harmonics: int = 2
    knot_s: float | None = None
    sway_sigma_mm: float = 300.0
    sway_sigma_rad: float = 0.5
    harmonic_sigma_mm: float = 30.0
    harmonic_sigma_rad: float = 0.03
    offset_search_s: float = 0.25
    periodic: bool = True
    free_band_hz: float = 10.0
    gain: Gain | None = None

    def __post_init__(self) -> None:
        low, high = self.band_hz
        if not 0 < low < high < inf:
            raise ValueError(f"band_hz must be 0 < low < high, got {self.band_hz}")
        if self.harmonics < 1:
            raise ValueError(f"need at least one harmonic, got {self.harmonics}")


@dataclass(frozen=True)
class BranchTable:
    """The frequencies that the pictures were weighed against, best first.

    f_hz, evidence (log, over sway alone, noise scaled), probability (K,); right_offset_s and
    row_time_scale (K,): what each would need the offset and the left row time (over the anchor's)
    to be.
    """

    f_hz: Floats
    evidence: Floats
    probability: Floats
    right_offset_s: Floats
    row_time_scale: Floats

    def __post_init__(self) -> None:
        n = np.size(self.f_hz)
        names = ("f_hz", "evidence", "probability", "right_offset_s", "row_time_scale")
        for name in names:
            object.__setattr__(self, name, floats(name, getattr(self, name), (n,), nan=True))

    @property
    def lead(self) -> float:
        """Evidence of the best over the second; infinite where there is one only."""
        return float(self.evidence[0] - self.evidence[1]) if self.evidence.size > 1 else inf


@dataclass(frozen=True)
class Timing:
    """Times as fitted; covariance (5, 5) in the order of TIMING (zero rows: not fitted).

    right_offset_s holds at ``reference_row``; right_drift is the right clock's rate error.
    row_time_keeps: (low, high) factors of the row times between which the branch stays the same.
    """

    frequency_hz: float
    right_offset_s: float
    right_drift: float
    left_row_time_s: float
    right_row_time_s: float
    reference_row: float
    covariance: Floats
    offset_slip: bool = False
    row_time_keeps: tuple[float, float] = (nan, nan)

    def __post_init__(self) -> None:
        object.__setattr__(self, "covariance", floats("covariance", self.covariance, (5, 5)))

    def sigma(self, name: str) -> float:
        """Standard deviation of one of TIMING."""
        k = TIMING.index(name)
        return float(np.sqrt(max(self.covariance[k, k], 0.0)))


@dataclass(frozen=True)
class MarkerMotion:
    """The motion of one marker: mean pose R0 (3, 3), t0_mm (3,), sway (B, 6), cosine, sine (H, 6).

    covariance: of the parameters [sway (6 B), cosine_1, sine_1, ... (12 H), frequency_hz, offset,
    drift, row times (5)], all of them jointly. blind (H,): harmonics that may be something else.
    seen_share: of the frames, in both cameras.
    """

    id: int
    R0: Floats
    t0_mm: Floats
    sway: Floats
    cosine: Floats
    sine: Floats
    covariance: Floats
    blind: tuple[bool, ...]
    seen_share: float

    def __post_init__(self) -> None:
        b, h = np.shape(self.sway)[0], np.shape(self.cosine)[0]
        size = 6 * b + 12 * h + 5
        shapes: dict[str, tuple[int, ...]] = {
            "R0": (3, 3),
            "t0_mm": (3,),
            "sway": (b, 6),
            "cosine": (h, 6),
            "sine": (h, 6),
            "covariance": (size, size),
        }
        for name, shape in shapes.items():
            object.__setattr__(self, name, floats(name, getattr(self, name), shape))

    def amplitude_sigma(self) -> Floats:
        """Sigma (H, 6) of the peak amplitude of each axis and harmonic."""
        h, base = len(self.cosine), self.sway.size
        out = np.empty((h, 6))
        for k in range(h):
            rows = base + 12 * k + np.arange(12)
            P = self.covariance[np.ix_(rows, rows)]
            u = np.stack([self.cosine[k], self.sine[k]])
            u = u / np.maximum(np.linalg.norm(u, axis=0), 1e-12)
            var = [
                u[0, a] ** 2 * P[a, a]
                + u[1, a] ** 2 * P[6 + a, 6 + a]
                + 2 * u[0, a] * u[1, a] * P[a, 6 + a]
                for a in range(6)
            ]
            out[k] = np.sqrt(np.maximum(var, 0.0))
        return out


@dataclass(frozen=True)
class Motion:
    """Evaluated motion (N instants, M markers): positions, turns, rates, all from the model.

    xyz_mm and rotation_rad (N, M, 3) in the left camera's frame, with sigmas; velocity_mm_s,
    acceleration_m_s2 with sigma. NaN outside the record.
    """

    t_s: Floats
    ids: Ints
    xyz_mm: Floats
    rotation_rad: Floats
    sigma_xyz_mm: Floats
    sigma_rotation_rad: Floats
    velocity_mm_s: Floats
    acceleration_m_s2: Floats
    sigma_acceleration_m_s2: Floats


@dataclass(frozen=True)
class MotionFit:
    """The motion of all markers with a common frequency, and how far it is known.

    status with reasons and next_time (advice) as in CONVENTIONS.md, Lines. noise_scale: sigma of
    the pictures over the localiser's, measured (noise_source); chi2: of the fit over that noise, 1
    is right. shift_s: trial clock minus the fit's own (rows count from reference_row there).
    knots: first_knot_s and knot_s of the sway on the fit's clock; psi (J,) coefficients of the
    phase spline from psi_first_s by psi_knot_s, empty where the speed is steady. kind: "steady",
    "wandering", "free" (no frequency) or "none".
    """

    kind: str
    markers: tuple[MarkerMotion, ...]
    timing: Timing
    branches: BranchTable
    status: LineStatus
    reasons: tuple[str, ...]
    next_time: tuple[str, ...]
    anchor: Anchor
    noise_scale: float
    noise_source: str
    chi2: float
    first_knot_s: float
    knot_s: float
    start_s: float
    end_s: float
    shift_s: float = 0.0
    psi: Floats = field(default_factory=lambda: np.empty(0))
    psi_first_s: float = 0.0
    psi_knot_s: float = 0.5
    growth: float = 0.0
    amplitude_refused: str = ""

    @property
    def f_hz(self) -> float:
        """Mean frequency of the machine, NaN where none was found."""
        return self.timing.frequency_hz

    @property
    def mid_s(self) -> float:
        """Where the phases count from, on the fit's own clock."""
        return 0.5 * (self.start_s + self.end_s)

    def evaluate(self, t_s: Floats) -> Motion:
        """Positions, rotations, velocities and accelerations at trial times (N,)."""
        from olivevib.reconstruction.motion.evaluate import evaluate

        return evaluate(self, t_s)
