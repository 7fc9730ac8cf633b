"""What the exposure takes from an amplitude, as the fine detector sees it.

A marker that moves while the shutter is open is drawn blurred. Where a localiser then puts it
depends on the localiser: its mean keeps sinc(f E) of a sine, its median more. The table is that of
our own (TemplateReader); ``olivevib benchmark exposure`` renders and measures it again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SHARP, BLURRED = 0.05, 0.25  # frequency times exposure: nothing to correct; no amplitude given
BLUR = (0.0, 0.05, 0.10, 0.15, 0.20, 0.25)  # frequency times exposure
SIZES_PX = (0.5, 1.0, 2.0, 4.0)  # peak amplitude in the picture
GAIN = (  # amplitude found over the true one: a row a blur, a column a size
    (0.9993, 0.9994, 0.9999, 1.0000),
    (0.9952, 0.9953, 0.9959, 0.9960),
    (0.9830, 0.9831, 0.9838, 0.9844),
    (0.9625, 0.9630, 0.9644, 0.9671),
    (0.9347, 0.9356, 0.9383, 0.9458),
    (0.9001, 0.9014, 0.9064, 0.9203),
)
SIGMA = (0.0010, 0.0010, 0.0010, 0.0011, 0.0018, 0.0045)  # between markers, a row a blur
OTHER_SIGMA = 0.5  # of the loss: a localiser whose gain nobody measured


@dataclass(frozen=True)
class ExposureGain:
    """Amplitude found over the true one, and its sigma."""

    gain: float
    sigma: float


def exposure_gain(
    f_hz: float, exposure_s: float, amplitude_px: float, localiser: str = "template"
) -> ExposureGain | None:
    """The gain for a sine of f_hz whose marker moves amplitude_px (peak) in the picture.

    None where f E exceeds 0.25: then the blur leaves no amplitude that could be corrected. For
    another localiser than "template" the gain lies between sinc(f E) and 1, and sigma says so.
    """
    blur = f_hz * exposure_s
    if not 0 <= blur <= BLURRED:
        return None
    if localiser != "template":
        lost = 1.0 - float(np.sinc(blur))
        return ExposureGain(1.0 - OTHER_SIGMA * lost, OTHER_SIGMA * lost)
    square = np.square(BLUR)  # the loss grows with it
    columns = [np.interp(blur**2, square, column) for column in np.array(GAIN).T]
    sizes = np.log(SIZES_PX)
    at = np.clip(np.log(max(amplitude_px, 1e-6)), sizes[0], sizes[-1])
    gain = float(np.interp(at, sizes, columns))
    beyond = max(0.0, np.log(max(amplitude_px, 1e-6)) - sizes[-1]) * abs(columns[-1] - columns[-2])
    return ExposureGain(gain, float(np.hypot(np.interp(blur, BLUR, SIGMA), beyond)))
