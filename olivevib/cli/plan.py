"""Verb plan: what the cameras will be able to tell, before the trial."""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from olivevib.cli.console import Console
from olivevib.errors import UsageError

if TYPE_CHECKING:
    from olivevib.planning import Outlook, Setup, Zone

WHOLE_BAND = (5.0, 45.0, 2.5)  # Hz: what is shown where no frequency was named


def plan(arguments: argparse.Namespace, console: Console) -> int:
    """Say of one frequency, or of the whole band, what a recording like this will tell."""
    from olivevib.planning import advice, outlook

    setup = _setup(arguments)
    try:
        found = [outlook(setup, f, arguments.amplitude) for f in _frequencies(arguments.frequency)]
    except ValueError as error:
        raise UsageError(f"This cannot be planned: {error}.", "", "Correct it.") from error
    told = advice(setup, found[0]) if len(found) == 1 else ()
    if arguments.json:
        print(json.dumps(_plain(_facts(setup, found, told)), indent=1, ensure_ascii=False))
    elif len(found) == 1:
        print(_one(setup, found[0], told))
    else:
        print(_table(setup, found))
        console.say("More of one frequency: --frequency HZ")
    return 0


def _setup(arguments: argparse.Namespace) -> Setup:
    from olivevib import values
    from olivevib.planning import Setup

    try:
        return Setup(
            fps=arguments.fps,
            readout_s=_seconds(arguments.readout),
            offset_s=_seconds(arguments.offset),
            marker_mm=arguments.marker,
            distance_mm=arguments.distance,
            exposure_s=arguments.exposure * 1e-3,
            focal_px=arguments.focal_px,
            baseline_mm=arguments.baseline,
            rows=arguments.rows,
            seconds=arguments.seconds,
            band_hz=values.band(arguments.band),
        )
    except ValueError as error:
        raise UsageError(f"This cannot be planned: {error}.", "", "Correct the option.") from error


def _seconds(ms: float | None) -> float | None:
    return None if ms is None else ms * 1e-3


def _frequencies(one: float | None) -> list[float]:
    if one is not None:
        return [one]
    low, high, step = WHOLE_BAND
    return [low + step * k for k in range(int((high - low) / step) + 1)]


def _one(setup: Setup, o: Outlook, told: tuple[str, ...]) -> str:
    lines = [
        f"{o.f_hz:g} Hz, {o.amplitude_mm:g} mm peak ({o.acceleration_m_s2:.1f} m/s²): {o.status}",
        *(f"  {reason}" for reason in o.reasons),
        f"  (planned: {setup.fps:g} frames/s, {setup.seconds:g} s, exposure "
        f"{1e3 * setup.exposure_s:g} ms, markers of {setup.marker_mm:g} mm at "
        f"{setup.distance_mm:g} mm, baseline {setup.baseline_mm:g} mm, focal length "
        f"{setup.focal_px:g} px; olivevib plan --help tells how to change it)",
        "",
        f"  marker in the picture          {setup.marker_px:.1f} px high",
        f"  a plain spectrum shows it at   {o.seen_hz:.2f} Hz "
        f"({o.seen_acceleration_m_s2:.1f} m/s²)",
        f"  the same to the frames         {', '.join(f'{f:.2f}' for f in o.aliases_hz)} Hz",
        f"  contrast between aliases       {o.contrast_px:.3f} px, expected evidence "
        f"{o.evidence:.0f} (25 confirm)",
        f"  least amplitude to confirm     {_mm(o.least_amplitude_mm)}",
        f"  expected sigma of amplitude    {o.sigma_plane_mm:.3f} mm across, "
        f"{o.sigma_depth_mm:.3f} mm in depth",
        f"  false depth, frames as pairs   {_mm(o.false_depth_mm)} "
        f"({o.false_depth_per_ms_mm:.2f} mm per ms out of step)",
        f"  frequency x exposure           {o.blur:.3f} ({_blur(o.blur)})",
    ]
    if not setup.direct and setup.row_time_s > 0:
        small, large = o.row_time_margin
        more = "any" if math.isinf(large) else f"{100 * large:.0f} %"
        lines.append(f"  the row time may be wrong by   -{100 * small:.0f} % or +{more}")
    lines += ["", f"  zones to avoid                 {_zone_words(setup)}", ""]
    return "\n".join([*lines, "For the trial:", *(f"  - {text}" for text in told)])


def _mm(value: float) -> str:
    if math.isnan(value):
        return "not known (offset unknown)"
    return "none suffices" if math.isinf(value) else f"{value:.2f} mm"


def _blur(blur: float) -> str:
    from olivevib.planning.outlook import BLURRED, SHARP

    if blur <= SHARP:
        return "sharp"
    return "corrected by the localiser's gain" if blur <= BLURRED else "no amplitude"


def _zone_words(setup: Setup) -> str:
    found = _zones(setup)
    words = [f"{z.centre_hz:g} ± {z.half_hz:g}{' (blind)' * z.blind}" for z in found]
    return f"{', '.join(words)} Hz" if words else "none"


def _zones(setup: Setup) -> tuple[Zone, ...]:
    from olivevib.planning import zones

    if setup.direct:
        return ()
    band = setup.band_hz or (WHOLE_BAND[0], WHOLE_BAND[1])
    return zones(setup.fps, setup.apart, setup.seconds, band, setup.row_time_s > 0)


def _table(setup: Setup, found: list[Outlook]) -> str:
    lines = [
        f"{found[0].amplitude_mm:g} mm peak; markers {setup.marker_px:.1f} px high; zones to "
        f"avoid: {_zone_words(setup)}",
        "",
        "    Hz  seen at  status       least mm  sigma mm  depth mm  false depth mm   m/s²",
    ]
    for o in found:
        least = "-" if math.isinf(o.least_amplitude_mm) else f"{o.least_amplitude_mm:.2f}"
        false = "-" if math.isnan(o.false_depth_mm) else f"{o.false_depth_mm:.2f}"
        lines.append(
            f"{o.f_hz:6.2f} {o.seen_hz:8.2f}  {o.status:12} {least:>8} {o.sigma_plane_mm:9.3f} "
            f"{o.sigma_depth_mm:9.3f} {false:>15} {o.acceleration_m_s2:6.1f}"
        )
    return "\n".join(lines)


def _facts(setup: Setup, found: list[Outlook], told: tuple[str, ...]) -> dict[str, Any]:
    return {
        "setup": asdict(setup),
        "marker_px": setup.marker_px,
        "zones": [asdict(zone) for zone in _zones(setup)],
        "frequencies": [asdict(o) for o in found],
        "advice": list(told),
    }


def _plain(value: Any) -> Any:
    """A value that JSON can hold: what is not a finite number is null."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _plain(v) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return value
