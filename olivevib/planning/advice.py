"""What to change before the trial, in the order in which it helps."""

from __future__ import annotations

import math

from olivevib.planning.outlook import BLURRED, SHARP, Outlook
from olivevib.planning.setup import APART, Setup

LEAST_MARKER_MM = 50.0
REST_S = 2.0
NEARLY_HALF, NEARLY_STEP = 0.45, 0.05  # shares of a frame period


def advice(setup: Setup, found: Outlook) -> tuple[str, ...]:
    """Sentences for a technician; what always helps comes last."""
    changes = [*_light(setup, found), *_zone(setup, found), *_marker(setup, found)]
    if not setup.direct:
        changes += [*_rows(setup, found), *_offset(setup)]
    return (*changes, *_always(setup))


def _light(setup: Setup, found: Outlook) -> list[str]:
    if found.blur <= SHARP:
        return []
    most = 1e3 * SHARP / found.f_hz
    word = "gives no amplitude" if found.blur > BLURRED else "has to be corrected for"
    return [
        f"Expose at most {min(2.0, most) if most >= 1 else most:.1f} ms (lamps help): "
        f"{1e3 * setup.exposure_s:g} ms at {found.f_hz:g} Hz {word}."
    ]


def _zone(setup: Setup, found: Outlook) -> list[str]:
    zone = found.zone
    if zone is None:
        return []
    low, high = zone.centre_hz - zone.half_hz, zone.centre_hz + zone.half_hz
    return [f"Run the machine outside {low:.4g}-{high:.4g} Hz, or change the frame rate."]


def _marker(setup: Setup, found: Outlook) -> list[str]:
    needed = LEAST_MARKER_MM
    if math.isfinite(found.least_amplitude_mm) and found.amplitude_mm < found.least_amplitude_mm:
        needed = setup.marker_mm * found.least_amplitude_mm / found.amplitude_mm
    if setup.marker_mm >= needed:
        return []
    closer = setup.distance_mm * math.sqrt(setup.marker_mm / needed)
    return [
        f"Print markers of at least {math.ceil(needed / 5) * 5:.0f} mm, or go closer "
        f"(about {closer:.0f} mm)."
    ]


def _rows(setup: Setup, found: Outlook) -> list[str]:
    if setup.readout_s is None:
        return ["Measure each camera's row time in this mode: olivevib rowtime FILE --led HZ."]
    small, large = found.row_time_margin
    worst = min(small, large)
    if 3 * setup.readout_sigma < worst or setup.readout_s == 0:
        return []
    return [
        f"Know the row time better than {100 * worst / 3:.0f} % (olivevib rowtime): an error of "
        f"{100 * worst:.0f} % would point to another frequency."
    ]


def _offset(setup: Setup) -> list[str]:
    if setup.apart:
        return []
    share, low = setup.period_share, APART[0]
    lost = "several frequencies are lost to the sway and to their own mirrors"
    if share is None:
        why = f"in step, {lost}; how far apart they start is not said (--offset MS)"
    elif share > NEARLY_HALF:
        why = "half a frame apart ties each frequency to its mirror"
    elif share < NEARLY_STEP:
        why = f"in step, {lost}"
    else:
        side = "little" if share < low else "much"
        why = (
            f"{1e3 * (setup.offset_s or 0.0):g} ms is {share:.2f} of a frame period, too {side}"
            " to take away every zone"
        )
    return [f"Start the cameras {setup.apart_ms} apart: {why}."]


def _always(setup: Setup) -> list[str]:
    parts = ["wave the board first in the same recording (it gives the offset between the cameras)"]
    parts += [f"keep {REST_S:g} s of rest", "include the start-up"]
    if setup.seconds < 10:
        parts.append("shake steadily for 10 s")
    return ["Record so: " + ", ".join(parts) + "."]
