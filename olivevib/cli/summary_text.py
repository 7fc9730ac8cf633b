"""The summary of a trial as text for a terminal: words before numbers, units on every number."""

from __future__ import annotations

from typing import Any

from olivevib.values import with_sigma

CANDIDATES_SHOWN = 5


def summary_text(facts: dict[str, Any]) -> str:
    """Stages, calibration, timing, markers, comparison and warnings, one block each."""
    title = facts["trial"] + ("   (simulated)" if facts["simulated"] else "")
    blocks = [
        [title],
        [f"  {name:12} {s['state']:8} {s['reason']}" for name, s in facts["stages"].items()],
        _calibration(facts["calibration"]),
        _timing(facts["timing"]),
        _markers(facts["markers"]),
        *(_comparison(c) for c in facts["comparisons"] or [facts["comparison"]]),
        [f"warning [{w['code']}]: {w['text']}\n    {w['remedy']}" for w in facts["warnings"]],
    ]
    return "\n\n".join("\n".join(block) for block in blocks if block)


def number(value: float | None, digits: int, unit: str = "") -> str:
    """The number with its unit, or "not known"."""
    return "not known" if value is None else f"{value:.{digits}f}{' ' * bool(unit)}{unit}"


def _calibration(c: dict[str, Any]) -> list[str]:
    if c["baseline_mm"] is None:
        return []
    lines = ["calibration"]
    for side in ("left", "right"):
        lens = c[side]
        lines.append(
            f"  {side:6} fx {lens['fx']:.1f}  fy {lens['fy']:.1f}  cx {lens['cx']:.1f}  "
            f"cy {lens['cy']:.1f} px   rms {number(lens['rms_px'], 3, 'px')}"
        )
    lines.append(f"  baseline {c['baseline_mm']:.1f} mm")
    if c["holdout_rms_mm"] is not None:
        lines.append(
            f"  unused frames: distances {c['holdout_rms_mm']:.3f} mm rms "
            f"({c['holdout_rms_percent']:.2f} %), epipolar {number(c['epipolar_rms_px'], 2, 'px')}"
        )
    if c["verdict"]:
        lines.append(f"  {c['verdict']}")
    return lines


def _timing(t: dict[str, Any]) -> list[str]:
    if t["left"]["frame_rate_hz"] is None:
        return []
    lines = ["timing"]
    for side in ("left", "right"):
        s = t[side]
        row = "not known"
        if s["row_time_s"] is not None:
            sigma = s["row_time_sigma_s"]
            micro = with_sigma(1e6 * s["row_time_s"], None if sigma is None else 1e6 * sigma, 2)
            row = f"{micro} µs"
        lines.append(
            f"  {side:6} {s['frame_rate_hz']:.3f} frames/s, stamps scatter "
            f"{s['stamp_jitter_s'] * 1e3:.2f} ms, {s['dropped']} dropped; row time {row} "
            f"({s['source']})"
        )
    if t["right_offset_source"]:
        offset, sigma = t["right_offset_s"], t["right_offset_sigma_s"]
        words = "not known, taken as zero"
        if offset is not None:
            words = f"{with_sigma(1e3 * offset, None if sigma is None else 1e3 * sigma, 2)} ms"
        lines.append(f"  right camera's offset {words} ({t['right_offset_source']})")
    return lines


def _markers(rows: list[dict[str, Any]]) -> list[str]:
    if not rows:
        return []
    lines = [
        "markers (peak amplitude of the dominant line)",
        "  (of the rms no sigma is known; the others' stand in show --json and in the report)",
        "    id place    seen   x mm    y mm    z mm           p-p mm  rms m/s²  frequency",
    ]
    clocks = [m["frequency_clock_sigma_hz"] for m in rows if _has(m["frequency_clock_sigma_hz"])]
    if clocks:
        most = f"{1e3 * max(clocks):.2g} mHz, alike for all"
        lines.insert(2, f"  (± of a frequency is the fit's; the camera's own clock may add {most})")
    for m in rows:
        a = [
            f"{m['amplitude_mm'][k]:7.3f}" if _has(m["amplitude_mm"][k]) else "      –"
            for k in "xyz"
        ]
        pp = "–".rjust(16)
        if _has(m["displacement_pp_mm"]):
            pp = with_sigma(m["displacement_pp_mm"], m["displacement_pp_sigma_mm"], 3).rjust(16)
        rms = (
            f"{m['acceleration_rms_m_s2']:9.2f}"
            if _has(m["acceleration_rms_m_s2"])
            else "        –"
        )
        lines.append(
            f"  {m['id']:4d} {m['place'] or '–':8} {m['seen_fraction']:4.0%} {' '.join(a)} "
            f"{pp} {rms}  {frequency(m)}"
        )
    return lines


def _has(value: float | None) -> bool:
    return value is not None


def frequency(m: dict[str, Any]) -> str:
    """The frequency with its status; candidates where it is not decided, never a bare number."""
    status = m["frequency_status"]
    if status is None:
        return "not analysed"
    if m["frequency_hz"] is not None:
        sigma = m["frequency_sigma_hz"]
        return f"{with_sigma(m['frequency_hz'], sigma, 4)} Hz, {status}"
    candidates = list(dict.fromkeys(round(f, 2) for f in m["frequency_candidates_hz"]))
    if status == "blind" or not candidates:  # candidates of sway are no frequencies
        return str(status)
    shown = [f"{f:.2f}" for f in candidates[:CANDIDATES_SHOWN]]
    chances = m.get("frequency_probabilities") or []
    if len(chances) == len(candidates):
        shown = [f"{f} ({100 * p:.0f} %)" for f, p in zip(shown, chances, strict=False)]
    more = ", …" if len(candidates) > CANDIDATES_SHOWN else ""
    return f"{status}: {', '.join(shown)}{more} Hz"


def _comparison(c: dict[str, Any]) -> list[str]:
    if c["verdict"] is None:
        return []
    which = f" {c['sensor']} at marker {c['marker']}" if "sensor" in c else ""
    lines = [f"accelerometer{which}: {c['verdict']}", f"  {c['reason']}"]
    if c["clock_offset_s"] is not None:
        sigma_ms = _ms(c["clock_offset_sigma_s"])
        lines.append(
            f"  clock offset {with_sigma(1e3 * c['clock_offset_s'], sigma_ms, 3)} ms, "
            f"drift {number(c['clock_drift_ppm'], 1, 'ppm')}, gain {number(c['gain'], 4)}, "
            f"rotation {number(c['rotation_deg'], 1, '°')}, coherence {number(c['coherence'], 3)}"
        )
    return lines


def _ms(value: float | None) -> float | None:
    return None if value is None else value * 1e3
