"""How the camera is compared with an accelerometer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

Localised: TypeAlias = Callable[[float], tuple[float, float]]


@dataclass(frozen=True)
class ComparisonSettings:
    """Settings of one comparison.

    exposure_s: of the camera (0: unknown or short). localised: at a frequency (Hz), the share of
    the mean over the exposure that the localiser tells, and its sigma; None: all of it. corner_hz:
    slower motion is taken from neither (the sensor's tilt and drift, the tree's sway).
    expected_offset_s and search_s: the accelerometer's stamp minus the trial clock is looked for
    within that distance of the expected value. fine_half_s, fine_step_s: the fine search about the
    envelope's best lag. gain_tolerance: how far a gain may lie from 1 and still agree.
    """

    exposure_s: float = 0.0
    localised: Localised | None = None
    corner_hz: float = 3.0
    expected_offset_s: float = 0.0
    search_s: float = 60.0
    fine_half_s: float = 0.5
    fine_step_s: float = 1e-3
    gain_tolerance: float = 0.05

    def __post_init__(self) -> None:
        if not 0 <= self.exposure_s < 1:
            raise ValueError(f"exposure_s must be in 0 ... 1 s, got {self.exposure_s}")
        for name in ("corner_hz", "search_s", "fine_half_s", "fine_step_s", "gain_tolerance"):
            if getattr(self, name) <= 0:
                raise ValueError(f"{name} must be positive, got {getattr(self, name)}")


DEFAULTS = ComparisonSettings()
