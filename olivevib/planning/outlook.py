"""What a planned recording will tell of one frequency: status, sigma, false depth, aliases.

Source: knowledge of the field (sampling time, 3, 5 and 8.3).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from olivevib.planning.setup import FLOOR_PX, LOCALISER_PX, POINTS, Setup
from olivevib.planning.zones import BAND_HZ, SWAY_HZ, Zone, zone_of, zones
from olivevib.vibration.verdict import candidates, fold

LEAST_CONTRAST_PX = 0.08  # from which the branch is confirmed
EVIDENCE = 0.005  # of (contrast / sigma)² a point and picture, least for motion in the plane
APART_GAIN = 7.0  # least factor on the evidence where cameras are out of step and known to be
SHARP, BLURRED = 0.05, 0.25  # frequency times exposure: no correction; no amplitude
MODEL_SHARE = 0.005  # of the amplitude: what rendered trials were wrong by beside the noise
READABLE_PX = 22.0  # two pixels a module


@dataclass(frozen=True)
class Outlook:
    """One frequency under one setup.

    status: "direct", "confirmable", "ambiguous" or "blind" with reasons in words. seen_hz: where a
    plain spectrum shows it. aliases_hz: all in the band that look alike to it. contrast_px and
    evidence: what decides between them; least_amplitude_mm: from which that suffices (inf: never).
    sigma_plane_mm, sigma_depth_mm: expected of the amplitude. false_depth_mm: what synchronous
    triangulation invents (NaN: offset unknown); false_depth_per_ms: for each millisecond.
    acceleration_m_s2: true; seen_acceleration_m_s2: from the plain spectrum's frequency. blur: f E.
    row_time_margin: relative errors of the row time (too small, too large) that keep the branch.
    """

    f_hz: float
    amplitude_mm: float
    status: str
    reasons: tuple[str, ...]
    seen_hz: float
    aliases_hz: tuple[float, ...]
    contrast_px: float
    evidence: float
    least_amplitude_mm: float
    sigma_plane_mm: float
    sigma_depth_mm: float
    false_depth_mm: float
    false_depth_per_ms_mm: float
    acceleration_m_s2: float
    seen_acceleration_m_s2: float
    blur: float
    row_time_margin: tuple[float, float]
    zone: Zone | None


def outlook(setup: Setup, f_hz: float, amplitude_mm: float = 3.0) -> Outlook:
    """The outlook for a vibration of f_hz and amplitude_mm (peak), both above 0."""
    if not (f_hz > 0 and amplitude_mm > 0):
        raise ValueError(f"frequency and amplitude must be above 0: {f_hz}, {amplitude_mm}")
    band = setup.band_hz or (min(BAND_HZ[0], f_hz), max(BAND_HZ[1], f_hz))
    around = (min(band[0], f_hz), max(band[1], f_hz))
    near = (around[0] - SWAY_HZ, around[1] + SWAY_HZ)  # a zone may reach in from outside
    all_zones = zones(setup.fps, setup.apart, setup.seconds, near, setup.row_time_s > 0)
    zone = None if setup.direct else zone_of(f_hz, all_zones)
    contrast = setup.contrast_px(amplitude_mm)
    least = least_amplitude_mm(setup)
    seen = fold(f_hz, setup.fps)
    aliases = candidates(seen, setup.fps, around)
    status, reasons = _status(setup, zone, amplitude_mm, least, aliases)
    plane, depth = sigmas_mm(setup, amplitude_mm)
    return Outlook(
        f_hz=f_hz,
        amplitude_mm=amplitude_mm,
        status=status,
        reasons=reasons,
        seen_hz=seen,
        aliases_hz=aliases,
        contrast_px=contrast,
        evidence=_evidence(setup, contrast),
        least_amplitude_mm=least,
        sigma_plane_mm=plane,
        sigma_depth_mm=depth,
        false_depth_mm=_false_depth(setup, f_hz, amplitude_mm, setup.offset_s),
        false_depth_per_ms_mm=_false_depth(setup, f_hz, amplitude_mm, 1e-3),
        acceleration_m_s2=_acceleration(f_hz, amplitude_mm),
        seen_acceleration_m_s2=_acceleration(seen, amplitude_mm),
        blur=f_hz * setup.exposure_s,
        row_time_margin=row_time_margin(f_hz, setup.fps),
        zone=zone,
    )


def least_amplitude_mm(setup: Setup) -> float:
    """The amplitude (peak, mm) from which the branch is confirmed; inf where nothing decides.

    In step: contrast 0.08 px. Cameras 8–13 ms apart and measured: less by the root of the least
    gain in evidence. With global shutters apart it is the part of the motion across the baseline
    that counts: both cameras see it, a turn of 2 pi fps d between neighbouring aliases.
    """
    if setup.direct:
        return 0.0
    one = setup.contrast_px(1.0)
    if one == 0:
        turned = 2 * abs(math.sin(math.pi * setup.fps * (setup.offset_s or 0.0)))
        return LEAST_CONTRAST_PX / turned / setup.px_per_mm if setup.apart else math.inf
    least = LEAST_CONTRAST_PX / one
    return least / math.sqrt(APART_GAIN) if setup.apart else least


def sigmas_mm(setup: Setup, amplitude_mm: float) -> tuple[float, float]:
    """Expected sigma of an amplitude across and along the line of sight, mm.

    A picture places a marker to the scatter of its points over their root, and to the floor that
    all of them share; 2 / N of its square is that of an amplitude from N pictures.
    """
    pictures = setup.fps * setup.seconds
    one_px = math.hypot(LOCALISER_PX / math.sqrt(POINTS), FLOOR_PX)
    noise_px = one_px * math.sqrt(2.0 / pictures)
    plane = noise_px / math.sqrt(2.0) / setup.px_per_mm
    depth = noise_px * math.sqrt(2.0) / setup.px_per_mm * setup.distance_mm / setup.baseline_mm
    model = MODEL_SHARE * amplitude_mm
    return math.hypot(plane, model), math.hypot(depth, model)


def row_time_margin(f_hz: float, fps: float) -> tuple[float, float]:
    """Relative error of the row time that keeps the branch: too small by, too large by."""
    large = fps / (2 * f_hz - fps) if 2 * f_hz > fps else math.inf
    return fps / (2 * f_hz + fps), large


def _evidence(setup: Setup, contrast_px: float) -> float:
    pictures = 2 * setup.fps * setup.seconds
    gain = APART_GAIN if setup.apart else 1.0
    return gain * EVIDENCE * (contrast_px / LOCALISER_PX) ** 2 * POINTS * pictures


def _false_depth(setup: Setup, f_hz: float, amplitude_mm: float, skew_s: float | None) -> float:
    """Depth that synchronous triangulation invents for motion along the baseline, mm peak."""
    if skew_s is None:
        return math.nan
    share = abs(math.sin(math.pi * f_hz * skew_s))
    return setup.distance_mm / setup.baseline_mm * 2 * amplitude_mm * share


def _acceleration(f_hz: float, amplitude_mm: float) -> float:
    return (2 * math.pi * f_hz) ** 2 * amplitude_mm * 1e-3


def _status(
    setup: Setup, zone: Zone | None, amplitude_mm: float, least: float, aliases: tuple[float, ...]
) -> tuple[str, tuple[str, ...]]:
    if setup.direct and setup.band_hz is not None:
        low, high = setup.band_hz
        return "direct", (f"{setup.fps:g} frames/s exceed twice the band of {low:g}-{high:g} Hz.",)
    if zone is not None and zone.blind:
        return "blind", (f"Near {zone.centre_hz:g} Hz: {zone.why}; no amplitude is given.",)
    if setup.marker_px < READABLE_PX:
        why = f"The marker is {setup.marker_px:.0f} px high; {READABLE_PX:.0f} px are needed."
        return "blind", (why,)
    words = [] if zone is None else [f"Near {zone.centre_hz:g} Hz: {zone.why}."]
    if zone is not None and zone.doubtful:
        return "ambiguous", tuple(words)
    others = " or ".join(f"{f:.4g}" for f in aliases)
    if math.isinf(least):
        return "ambiguous", (*words, f"{others} Hz look the same: {why_alike(setup)}.")
    if amplitude_mm < least:
        why = f"{others} Hz look the same: {amplitude_mm:g} mm are less than the {least:.2f} mm"
        return "ambiguous", (*words, f"{why} from which the row times decide.")
    by = "The row times tell"
    if setup.row_time_s == 0:
        by = "The offset between the cameras tells, from the motion across their baseline,"
    return "confirmable", (*words, f"{by} it from its aliases, once measured.")


def why_alike(setup: Setup) -> str:
    """Why nothing in this setup could tell a frequency from its aliases."""
    if setup.readout_s is None:
        return f"the row time is not known, and the cameras are not {setup.apart_ms} apart"
    return f"all rows are seen at once, and the cameras are not {setup.apart_ms} apart"
