"""What a plan tells, for a person: one frequency in full, or the whole band as a table."""

from __future__ import annotations

import math
from collections.abc import Sequence

from olivevib.planning.outlook import BLURRED, SHARP, Outlook, why_alike
from olivevib.planning.setup import Setup
from olivevib.planning.zones import Zone, zones

WHOLE_BAND = (5.0, 45.0, 2.5)  # Hz: what is shown where no frequency was named


def frequencies(one: float | None) -> list[float]:
    """The frequency that was named, Hz; those of the whole band where none was."""
    if one is not None:
        return [one]
    low, high, step = WHOLE_BAND
    return [low + step * k for k in range(int((high - low) / step) + 1)]


def one_words(setup: Setup, o: Outlook, told: Sequence[str], more: str = "") -> str:
    """Everything of one frequency; told: the advice for the trial; more: how to change the plan."""
    lines = [
        f"{o.f_hz:g} Hz, {o.amplitude_mm:g} mm peak ({o.acceleration_m_s2:.1f} m/s²): {o.status}",
        *(f"  {reason}" for reason in o.reasons),
        f"  (planned: {setup.fps:g} frames/s, {setup.seconds:g} s, exposure "
        f"{1e3 * setup.exposure_s:g} ms, markers of {setup.marker_mm:g} mm at "
        f"{setup.distance_mm:g} mm, baseline {setup.baseline_mm:g} mm, focal length "
        f"{setup.focal_px:g} px{more})",
        "",
        f"  marker in the picture          {setup.marker_px:.1f} px high",
        f"  a plain spectrum shows it at   {o.seen_hz:.2f} Hz "
        f"({o.seen_acceleration_m_s2:.1f} m/s²)",
        *_alias_lines(setup, o),
        f"  expected sigma of amplitude    {o.sigma_plane_mm:.3f} mm across, "
        f"{o.sigma_depth_mm:.3f} mm in depth",
        f"  false depth, frames as pairs   {_mm(o.false_depth_mm)} "
        f"({o.false_depth_per_ms_mm:.2f} mm per ms out of step)",
        f"  frequency x exposure           {o.blur:.3f} ({_blur(o.blur)})",
    ]
    lines += ["", f"  zones to avoid                 {_zone_words(setup)}", ""]
    return "\n".join([*lines, "For the trial:", *(f"  - {text}" for text in told)])


def _alias_lines(setup: Setup, o: Outlook) -> list[str]:
    """What looks the same to the frames, and what tells it apart."""
    if setup.direct:
        return ["  the same to the frames         nothing else in the band: nothing to decide"]
    lines = [
        f"  the same to the frames         {', '.join(f'{f:.2f}' for f in o.aliases_hz)} Hz",
        f"  what tells these apart         {_evidence(setup, o)}",
        f"  least amplitude to confirm     {_mm(o.least_amplitude_mm)}",
    ]
    if setup.row_time_s > 0:
        small, large = o.row_time_margin
        least = f"{100 * small:.0f} % shorter"
        told = f"{least} to {100 * large:.0f} % longer than the true one"
        if math.isinf(large):
            told = f"{least} than the true one, or longer"
        lines.append(f"  row time that still tells it   {told}")
    return lines


def _evidence(setup: Setup, o: Outlook) -> str:
    """By what, and how much of it there is."""
    if setup.row_time_s > 0:
        digits = 1 - math.floor(math.log10(o.evidence)) if o.evidence > 0 else 0
        size = f"{round(o.evidence, digits):,.10g}"
        return f"{o.contrast_px:.3f} px between them; evidence about {size}, where 25 confirm"
    if setup.apart:
        return "the offset between the cameras, from motion across their baseline"
    return f"nothing: {why_alike(setup)}"


def _mm(value: float) -> str:
    if math.isnan(value):
        return "not known (offset unknown)"
    return "none suffices" if math.isinf(value) else f"{value:.2f} mm"


def _blur(blur: float) -> str:
    if blur <= SHARP:
        return "sharp"
    return "corrected by the localiser's gain" if blur <= BLURRED else "no amplitude"


def _zone_words(setup: Setup) -> str:
    found = zones_of(setup)
    words = [f"{z.centre_hz:g} ± {z.half_hz:g}{' (blind)' * z.blind}" for z in found]
    return f"{', '.join(words)} Hz" if words else "none"


def zones_of(setup: Setup) -> tuple[Zone, ...]:
    """The frequencies to avoid under this setup."""
    if setup.direct:
        return ()
    band = setup.band_hz or (WHOLE_BAND[0], WHOLE_BAND[1])
    return zones(setup.fps, setup.apart, setup.seconds, band, setup.row_time_s > 0)


def table_words(setup: Setup, found: Sequence[Outlook]) -> str:
    """A line a frequency."""
    lines = [
        f"{found[0].amplitude_mm:g} mm peak; markers {setup.marker_px:.1f} px high; zones to "
        f"avoid: {_zone_words(setup)}",
        "",
        "    Hz seen at  status      least mm sigma mm depth mm false depth   m/s²",
    ]
    for o in found:
        least = (
            "-"
            if setup.direct or math.isinf(o.least_amplitude_mm)
            else f"{o.least_amplitude_mm:.2f}"
        )
        false = "-" if math.isnan(o.false_depth_mm) else f"{o.false_depth_mm:.2f}"
        lines.append(
            f"{o.f_hz:6.2f} {o.seen_hz:7.2f}  {o.status:11} {least:>8} {o.sigma_plane_mm:8.3f} "
            f"{o.sigma_depth_mm:8.3f} {false:>11} {o.acceleration_m_s2:6.1f}"
        )
    return "\n".join(lines)
