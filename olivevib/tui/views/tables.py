"""Rows of the app's tables and the blocks of words beside them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rich.style import Style
from rich.text import Text

from olivevib.tui.harmless import harmless, plain
from olivevib.tui.views.palette import Palette
from olivevib.tui.views.words import GLYPHS, marker_frequency, number, short

if TYPE_CHECKING:
    from olivevib.comparison import Comparison

STATE_MEANINGS = {"done": "good", "stale": "warn", "failed": "bad", "blocked": "warn"}
QUALITY_MEANINGS = {
    "clean": "good",
    "warnings": "warn",
    "stale": "warn",
    "differs": "bad",
    "failed": "bad",
    "unreadable": "bad",
}
MARKER_COLUMNS = ("id", "place", "frequency", "p-p mm", "seen", "x mm", "y mm", "z mm", "rms m/s²")


def meaning(palette: Palette, name: str | None) -> Style:
    """The style of a meaning: good, warn, bad; muted for anything else."""
    style = getattr(palette, name) if name in ("good", "warn", "bad") else palette.muted
    return style if isinstance(style, Style) else palette.muted


def state_cell(state: str, palette: Palette, word: bool = True) -> Text:
    """The state of a stage as glyph and word, or the glyph alone."""
    glyph = GLYPHS.get(state, "?")
    text = f"{glyph} {state}" if word else glyph
    return Text(text, meaning(palette, STATE_MEANINGS.get(state)))


def quality_cell(word: str, palette: Palette) -> Text:
    """The quality word of a trial."""
    return Text(word, meaning(palette, QUALITY_MEANINGS.get(word)))


def marker_row(marker: Mapping[str, Any], palette: Palette) -> tuple[Text, ...]:
    """One marker of the summary as table cells; – is not known."""
    peaks = [short(marker["amplitude_mm"][axis], 3) for axis in "xyz"]
    known = marker["frequency_hz"] is not None
    return (
        Text(str(marker["id"]), justify="right"),
        plain(marker["place"] or "–", 12),
        Text(marker_frequency(marker), meaning(palette, "good" if known else "warn")),
        Text(short(marker["displacement_pp_mm"], 3), justify="right"),
        Text(f"{marker['seen_fraction']:.0%}", justify="right"),
        *(Text(peak, justify="right") for peak in peaks),
        Text(short(marker["acceleration_rms_m_s2"], 2), justify="right"),
    )


def warnings_text(warnings: Sequence[Mapping[str, str]], run: bool, palette: Palette) -> Text:
    """Every warning with its remedy; what to do first where nothing has ``run`` yet."""
    if not run:
        return Text("Nothing has run yet.\nr runs every stage; s describes the trial first.")
    if not warnings:
        return Text("No warnings.", palette.muted)
    out = Text()
    for warning in warnings:
        out.append("⚠ ", palette.warn)
        out.append(f"{harmless(warning['text'], 400)}\n")
        out.append(f"  {harmless(warning['remedy'], 400)}", palette.accent)
        out.append(f"  [{harmless(warning['code'], 40)}]\n", palette.muted)
    out.rstrip()
    return out


def facts_text(summary: Mapping[str, Any], palette: Palette) -> Text:
    """Calibration, timing and comparison of a trial in a few lines each."""
    blocks = (
        ("Calibration", _calibration(summary["calibration"])),
        ("Timing", _timing(summary["timing"])),
        ("Markers", _markers(summary["markers"])),
        ("Accelerometer", _comparison(summary["comparison"])),
    )
    out = Text()
    for title, lines in blocks:
        out.append(f"{title}\n", palette.accent)
        out.append("".join(f"  {line}\n" for line in lines) or "  not known yet\n")
    out.rstrip()
    return out


def _calibration(c: Mapping[str, Any]) -> list[str]:
    if c["baseline_mm"] is None:
        return []
    lenses = [f"{side} {number(c[side]['rms_px'], 3, 'px')}" for side in ("left", "right")]
    lines = [f"baseline {c['baseline_mm']:.1f} mm; fit rms {', '.join(lenses)}"]
    if c["holdout_rms_mm"] is not None:
        share = number(c["holdout_rms_percent"], 2, "%")
        lines.append(f"distances on unused views {number(c['holdout_rms_mm'], 3, 'mm')} ({share})")
    if c["verdict"]:
        lines.append(harmless(c["verdict"], 600))
    return lines


def _timing(t: Mapping[str, Any]) -> list[str]:
    lines = []
    for side in ("left", "right"):
        s = t[side]
        if s["frame_rate_hz"] is not None:
            row = "unknown" if s["row_time_s"] is None else f"{s['row_time_s'] * 1e6:.2f} µs"
            lines.append(
                f"{side} {s['frame_rate_hz']:.3f} frames/s, {s['frames']} frames, "
                f"{s['dropped']} dropped, row time {row}"
            )
    if t["right_offset_source"]:
        offset = t["right_offset_s"]
        told = "not known, taken as zero" if offset is None else f"{offset * 1e3:+.2f} ms"
        lines.append(f"right camera's offset {told} ({t['right_offset_source']})")
    return lines


def _markers(markers: Iterable[Mapping[str, Any]]) -> list[str]:
    listed = list(markers)
    if not listed:
        return []
    seen = sum(m["seen_fraction"] for m in listed) / len(listed)
    lines = [f"{len(listed)} in space, seen in {seen:.0%} of the frames"]
    statuses = [m["frequency_status"] for m in listed if m["frequency_status"]]
    for status in dict.fromkeys(statuses):
        lines.append(f"frequency {status}: {statuses.count(status)}")
    return lines


def _comparison(c: Mapping[str, Any]) -> list[str]:
    if c["verdict"] is None:
        return []
    return [f"{c['verdict']}: {harmless(c['reason'], 300)}"]


def comparison_text(c: Comparison, palette: Palette) -> Text:
    """The numbers of a comparison, each with its sigma, below its verdict."""
    rows = (
        ("clock offset", _with_sigma(c.clock_offset_s * 1e3, c.clock_offset_sigma_s * 1e3, "ms")),
        ("clock drift", _with_sigma(c.clock_drift_ppm, c.clock_drift_sigma_ppm, "ppm")),
        ("gain", _with_sigma(c.gain, c.gain_sigma, "")),
        ("rotation", _with_sigma(c.rotation_deg, c.rotation_sigma_deg, "°")),
        ("coherence", number(c.coherence, 3)),
    )
    out = Text()
    out.append(f"{c.verdict}", meaning(palette, "good" if c.verdict == "agrees" else "warn"))
    out.append(f": {harmless(c.reason, 300)}\n")
    out.append("   ".join(f"{name} {value}" for name, value in rows))
    for line in c.lines:
        out.append(
            f"\n{line.f_hz:.3f} Hz: "
            f"camera {line.optical_m_s2:.3f} ± {line.optical_sigma_m_s2:.3f}, "
            f"sensor {line.sensor_m_s2:.3f} ± {line.sensor_sigma_m_s2:.3f} m/s², "
            f"phase {round(line.phase_deg, 1) + 0.0:+.1f} ± {line.phase_sigma_deg:.1f}°"
        )
    return out


def not_compared_text(summary: Mapping[str, Any], palette: Palette) -> Text:
    """Why there is no comparison, and what to do."""
    stage = summary.get("stages", {}).get("compare", {})
    out = Text("Not compared. ", palette.accent)
    out.append(f"{harmless(stage.get('reason', 'reading …'), 300)}\n")
    out.append("s binds an accelerometer file to a marker, r runs the stage.", palette.muted)
    return out


def _with_sigma(value: float, sigma: float, unit: str) -> str:
    if not math.isfinite(value):
        return "not known"
    spread = f" ± {sigma:.2g}" if math.isfinite(sigma) else ""
    return f"{value:.5g}{spread}{f' {unit}' if unit else ''}"
