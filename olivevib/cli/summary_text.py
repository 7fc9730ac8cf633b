"""The summary of a trial as text for a terminal: words before numbers, units on every number."""

from __future__ import annotations

import math
from typing import Any

from olivevib.trial.standing import CODES
from olivevib.values import combined, with_sigma

CANDIDATES_SHOWN = 5


def summary_text(facts: dict[str, Any]) -> str:
    """What must be known first, then stages, calibration, timing, markers, comparison, warnings.

    Numbers that are not of the trial as it is now say so where they stand.
    """
    title = facts["trial"] + ("   (simulated)" if facts["simulated"] else "")
    first = [w for w in facts["warnings"] if w["code"] in CODES]
    rest = [w for w in facts["warnings"] if w["code"] not in CODES]
    stages = facts["stages"]
    compared = facts["comparisons"] or [facts["comparison"]]
    blocks = [
        [title],
        [f"mind this first [{w['code']}]: {w['text']}\n    {w['remedy']}" for w in first],
        [f"  {name:12} {s['state']:8} {s['reason']}" for name, s in stages.items()],
        _dated(_calibration(facts["calibration"]), stages, "calibrate"),
        _dated(_timing(facts["timing"]), stages, "reconstruct", "track"),
        _dated(_markers(facts["markers"]), stages, "analyse", "reconstruct"),
        *(_dated(_comparison(c), stages, "compare") for c in compared),
        [f"warning [{w['code']}]: {w['text']}\n    {w['remedy']}" for w in rest],
    ]
    return "\n\n".join("\n".join(block) for block in blocks if block)


def _dated(block: list[str], stages: dict[str, Any], *names: str) -> list[str]:
    """The block with a line below its head where its numbers are old (``old_results``)."""
    old = next((why for name in names if (why := stages.get(name, {}).get("old"))), None)
    return [block[0], f"  ! these numbers {old}", *block[1:]] if block and old else block


def number(value: float | None, digits: int, unit: str = "") -> str:
    """The number with its unit, or "not known"."""
    return "not known" if value is None else f"{value:.{digits}f}{' ' * bool(unit)}{unit}"


def significant(value: float | None, unit: str, digits: int = 2) -> str:
    """The number with so many significant digits, never rounded to zero; or "not known"."""
    if value is None or value == 0:
        return number(value, 0, unit)
    return number(value, max(0, digits - 1 - math.floor(math.log10(abs(value)))), unit)


def concise(value: float | None, sigma: float | None, digits: int) -> str:
    """``4.9532(50)``: the value, its sigma in units of the last digit (GUM 7.2.2).

    Without a sigma so many decimals of the value alone; – where it is not known.
    """
    if value is None:
        return "–"
    if sigma is None or not math.isfinite(sigma) or sigma <= 0:
        return f"{value:.{digits}f}"
    places = min(7, max(0, 1 - math.floor(math.log10(sigma))))
    spread = f"{sigma:.{places}f}" if sigma >= 1 else f"{max(1, round(sigma * 10**places))}"
    return f"{value:.{places}f}({spread})"


def _calibration(c: dict[str, Any]) -> list[str]:
    if c["baseline_mm"] is None:
        return []
    lines = ["calibration"]
    for side in ("left", "right"):
        lens = c[side]
        lines.append(
            f"  {side:6} fx {lens['fx']:.1f}  fy {lens['fy']:.1f}  cx {lens['cx']:.1f}  "
            f"cy {lens['cy']:.1f} px   rms {significant(lens['rms_px'], 'px')}"
        )
    lines.append(f"  baseline {c['baseline_mm']:.1f} mm")
    if c["holdout_rms_mm"] is not None:
        lines.append(
            f"  unused frames: distances {significant(c['holdout_rms_mm'], 'mm')} rms "
            f"({significant(c['holdout_rms_percent'], '%')}), "
            f"epipolar {significant(c['epipolar_rms_px'], 'px')}"
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
        if s["source"] == "global":
            row = "0 µs: all rows at once"
        elif s["row_time_s"] is not None:
            sigma = s["row_time_sigma_s"]
            micro = with_sigma(1e6 * s["row_time_s"], None if sigma is None else 1e6 * sigma, 2)
            row = f"{micro} µs"
        lines.append(
            f"  {side:6} {s['frame_rate_hz']:.3f} frames/s, stamps scatter "
            f"{significant(1e3 * s['stamp_jitter_s'], 'ms')}, {s['dropped']} dropped; row time "
            f"{row} ({s['source']})"
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
        "markers (peak amplitude of the dominant line; largest: in any direction)",
        "  4.953(50) is 4.953 ± 0.050, one standard deviation; of the rms none is known",
        "  p-p: the largest extent of the whole motion in its phase, slow sway included",
    ]
    clocks = [m["frequency_clock_sigma_hz"] for m in rows if _has(m["frequency_clock_sigma_hz"])]
    if clocks:
        most = f"{1e3 * max(clocks):.2g} mHz, alike for all"
        lines.append(f"  ± of a frequency includes the camera's own clock ({most})")
    heads = ("x mm", "y mm", "z mm", "largest mm", "p-p mm")
    lines.append(
        f"  {'id':>4} {'place':8} {'seen':>4} {' '.join(f'{h:>11}' for h in heads)} "
        f"{'rms m/s²':>9}  frequency"
    )
    lines += [_marker(m) for m in rows]
    largest = [m for m in rows if _has(m["amplitude_largest_mm"])]
    if len(largest) > 1:
        best = max(largest, key=lambda m: float(m["amplitude_largest_mm"]))
        lines.append(f"  moves most (largest amplitude in any direction): marker {best['id']}")
    return lines


def _marker(m: dict[str, Any]) -> str:
    """One marker in the table."""
    sizes = [(m["amplitude_mm"][k], m["amplitude_sigma_mm"][k]) for k in "xyz"]
    sizes.append((m["amplitude_largest_mm"], m["amplitude_largest_sigma_mm"]))
    sizes.append((m["displacement_pp_mm"], m["displacement_pp_sigma_mm"]))
    numbers = " ".join(f"{concise(value, sigma, 3):>11}" for value, sigma in sizes)
    rms = concise(m["acceleration_rms_m_s2"], None, 2)
    seen = _share(m["seen_fraction"])
    return f"  {m['id']:4d} {m['place'] or '–':8} {seen} {numbers} {rms:>9}  {frequency(m)}"


def _share(fraction: float) -> str:
    """A share in per cent; 100 % only where nothing is missing."""
    return f"{fraction if fraction == 1 else min(fraction, 0.99):4.0%}"


def _has(value: float | None) -> bool:
    return value is not None


def frequency(m: dict[str, Any]) -> str:
    """The frequency with its status; candidates where it is not decided, never a bare number.

    ±: of the fit and of the camera's own clock together.
    """
    status = m["frequency_status"]
    if status is None:
        return "not analysed"
    if m["frequency_hz"] is not None:
        both = combined(m["frequency_sigma_hz"], m["frequency_clock_sigma_hz"])
        return f"{with_sigma(m['frequency_hz'], both, 4)} Hz, {status}"
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
        offset = with_sigma(1e3 * c["clock_offset_s"], _thousand(c["clock_offset_sigma_s"]), 3)
        lines.append(
            f"  clock offset {offset} ms, drift {_measured(c, 'clock_drift_ppm', 1, ' ppm')}, "
            f"gain {_measured(c, 'gain', 4)}, rotation {_measured(c, 'rotation_deg', 1, '°')}, "
            f"coherence {number(c['coherence'], 3)}"
        )
    return lines


def _measured(c: dict[str, Any], name: str, digits: int, unit: str = "") -> str:
    """A number of a comparison with its sigma (``clock_drift_ppm``, ``clock_drift_sigma_ppm``)."""
    if c[name] is None:
        return "not known"
    stem, _, tail = name.rpartition("_")
    sigma = c.get(f"{stem}_sigma_{tail}" if stem else f"{name}_sigma")
    text = with_sigma(c[name], sigma, digits)
    return f"({text}){unit}" if unit == "°" and " ± " in text else f"{text}{unit}"


def _thousand(value: float | None) -> float | None:
    return None if value is None else value * 1e3
