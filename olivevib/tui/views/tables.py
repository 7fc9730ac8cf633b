"""Rows of the app's tables and the blocks of words beside them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rich.style import Style
from rich.text import Text

from olivevib.tui.harmless import harmless, plain
from olivevib.tui.views.faults import fault_text
from olivevib.tui.views.old import OLD, old_words
from olivevib.tui.views.palette import Palette
from olivevib.tui.views.words import GLYPHS, marker_frequency, number, with_spread
from olivevib.values import with_sigma

if TYPE_CHECKING:
    from olivevib.comparison import Comparison
    from olivevib.trial.standing import Fault

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


def marker_row(marker: Mapping[str, Any], palette: Palette, old: bool = False) -> tuple[Text, ...]:
    """One marker of the summary as table cells, each value ± its sigma; – is not known.

    old: the numbers are overtaken; each of them says so by a mark and its style.
    """
    amplitude, sigma = marker["amplitude_mm"], marker["amplitude_sigma_mm"]
    peaks = [with_spread(amplitude[axis], sigma[axis], 3) for axis in "xyz"]
    across = with_spread(marker["displacement_pp_mm"], marker["displacement_pp_sigma_mm"], 3)
    rms = with_spread(marker["acceleration_rms_m_s2"], _rms_sigma(marker), 2)
    known = marker["frequency_hz"] is not None
    style = palette.warn if old else palette.text

    def value(text: str) -> Text:
        return Text(f"{OLD} {text}" if old and text != "–" else text, style, justify="right")

    row = (
        Text(str(marker["id"]), style, justify="right"),
        plain(marker["place"] or "–", 12),
        Text(marker_frequency(marker), meaning(palette, "good" if known and not old else "warn")),
        value(across),
        Text(f"{marker['seen_fraction']:.0%}", style, justify="right"),
        *map(value, peaks),
        value(rms),
    )
    if old:
        row[2].plain = f"{OLD} {row[2].plain}"
    return row


def _rms_sigma(marker: Mapping[str, Any]) -> float | None:
    """Sigma of the rms acceleration from that of the line's amplitude; None where unknown."""
    rms = marker["acceleration_rms_m_s2"]
    size, spread = (
        [v for v in marker[name].values() if v is not None and math.isfinite(v)]
        for name in ("amplitude_mm", "amplitude_sigma_mm")
    )
    if rms is None or len(size) != 3 or len(spread) != 3 or not any(size):
        return None
    # of the root of the squares: each axis by its share
    variance = sum((a * s) ** 2 for a, s in zip(size, spread, strict=True))
    return float(rms * math.sqrt(variance) / sum(a * a for a in size))


def warnings_text(
    warnings: Sequence[Mapping[str, str]],
    run: bool,
    palette: Palette,
    faults: Sequence[Fault] = (),
) -> Text:
    """What failed, whole; every warning with its remedy; what to do where nothing has ``run``."""
    if not run:
        return Text("Nothing has run yet.\nr runs every stage; s describes the trial first.")
    out = Text()
    for fault in faults:
        out.append_text(fault_text(fault, palette))
        out.append("\n\n")
    if not warnings and not faults:
        out.append("No warnings.", palette.muted)
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
        ("Calibration", ("calibrate",), _calibration(summary["calibration"])),
        ("Timing", ("track", "reconstruct"), _timing(summary["timing"])),
        ("Markers", ("reconstruct", "analyse"), _markers(summary["markers"])),
        ("Accelerometer", ("compare",), _comparison(summary["comparison"])),
    )
    out = Text()
    for title, stages, lines in blocks:
        out.append(title, palette.accent)
        old = old_words(summary, *stages) if lines else ""
        out.append(f"  {OLD} {old}\n" if old else "\n", palette.warn)
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
            known = s["row_time_s"] is not None
            row = with_spread(s["row_time_s"], s["row_time_sigma_s"], 2, 1e6, "µs")
            lines.append(
                f"{side} {s['frame_rate_hz']:.3f} frames/s, {s['frames']} frames, "
                f"{s['dropped']} dropped, row time {row if known else 'unknown'}"
            )
    if t["right_offset_source"]:
        told = "not known, taken as zero"
        if t["right_offset_s"] is not None:
            told = with_spread(t["right_offset_s"], t["right_offset_sigma_s"], 2, 1e3, "ms")
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
        ("clock offset", with_spread(c.clock_offset_s, c.clock_offset_sigma_s, 2, 1e3, "ms")),
        ("clock drift", with_spread(c.clock_drift_ppm, c.clock_drift_sigma_ppm, 1, 1, "ppm")),
        ("gain", with_spread(c.gain, c.gain_sigma, 3)),
        ("rotation", with_spread(c.rotation_deg, c.rotation_sigma_deg, 1, 1, "°")),
        ("coherence", number(c.coherence, 3)),
    )
    out = Text()
    out.append(f"{c.verdict}", meaning(palette, "good" if c.verdict == "agrees" else "warn"))
    out.append(f": {harmless(c.reason, 300)}\n")
    out.append("   ".join(f"{name} {value}" for name, value in rows))
    for line in c.lines:
        out.append(
            f"\n{line.f_hz:.3f} Hz: "
            f"camera {with_sigma(line.optical_m_s2, line.optical_sigma_m_s2, 3)}, "
            f"sensor {with_sigma(line.sensor_m_s2, line.sensor_sigma_m_s2, 3)} m/s², "
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
