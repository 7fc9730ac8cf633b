"""The verdict: how far the pictures and the anchor tell the frequency, in words.

Order of the tests as in CONVENTIONS.md, Lines; thresholds calibrated by ``olivevib benchmark
blind``. The accelerometer is never looked at here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats
from olivevib.planning.zones import SWAY_HZ
from olivevib.reconstruction.motion.types import Anchor, BranchTable, MotionSettings
from olivevib.vibration.types import LineStatus

CONFIRMED_LEAD = 25.0
SUPPORTED_LEAD = 5.0
CHI2_LIMIT = (
    1.15  # right confirmed ones of 243 blind trials reach 1.13, wrong ones of 3,150 had 1.2
)
NOISE_LIMIT = 5.0  # measured noise over the localiser's above which nothing is confirmed
BESIDE_LIMIT = 10.0  # sigmas of noise above which a second line near a steady one is believed
LINE_EVIDENCE = 12.0  # over sway alone below which no line stands out
AMPLITUDE_SHARE = 0.1  # sigma over amplitude above which a line is blind
LOST_LEAD = 5000.0  # asked where the fit alone tells the cameras' offset; wrong ones had 3,855
UNEVEN_HZ_S = 1.0  # change of the apparent frequency above which nothing is confirmed
ROW_SIGMAS = 4.5  # of both row times together, from what was told
COLLISION_LEAD = 100.0  # asked where harmonics look alike, though the cameras are out of step
STEP_S = 5e-3  # cameras nearer than this to the same instant count as in step
NARROW_HZ = 0.3
CHIRP_HZ_S = 0.5  # change of the apparent frequency that, left unexplained, is a chirp
CHIRP_MISFIT = 25.0  # variance left over the localiser's that a changing speed must explain
SWAY_SHARE = 0.4  # over the knot spacing: half width of the sway's zone, Hz


@dataclass(frozen=True)
class Facts:
    """What the verdict rests on. noise_scale and chi2 as in MotionFit; amplitude_mm (3,) peak and
    sigma of the strongest marker's fundamental; strength: log evidence over sway alone; beside as
    in Pixels; row_sigmas: how far both row times lie from what was told.
    """

    table: BranchTable
    rate_hz: float
    span_s: float
    offset_s: float
    knot_s: float
    chi2: float
    noise_scale: float
    strength: float
    amplitude_mm: Floats
    sigma_mm: Floats
    fast_hz_s: float = 0.0
    beside: float = 0.0
    offset_lost: bool = False
    stray: str = ""
    row_sigmas: float = 0.0


@dataclass(frozen=True)
class Decision:
    """Status, reasons, advice, and which harmonics may be something else."""

    status: LineStatus
    reasons: tuple[str, ...]
    next_time: tuple[str, ...]
    blind: tuple[bool, ...]


def in_step(offset_s: float, rate_hz: float) -> bool:
    """Whether both cameras look at nearly the same instants."""
    frames = offset_s * rate_hz
    return abs(frames - round(frames)) / rate_hz < STEP_S


def zone(f_hz: float, facts: Facts, harmonic: int = 1) -> str:
    """What the harmonic of f_hz can be mistaken for at this rate, or nothing."""
    rate, f = facts.rate_hz, harmonic * f_hz
    step = in_step(facts.offset_s, rate)
    narrow = max(NARROW_HZ, 1.0 / facts.span_s)
    sway = max(narrow, SWAY_HZ, SWAY_SHARE / facts.knot_s) if step else narrow
    if round(f / rate) > 0 and abs(f - rate * round(f / rate)) < sway:
        return "slow sway"
    return collision(f_hz, facts, harmonic) if step else ""


def collision(f_hz: float, facts: Facts, harmonic: int = 1) -> str:
    """What the harmonic of f_hz shows the same apparent frequency as, unresolved, or nothing."""
    rate, f = facts.rate_hz, harmonic * f_hz
    narrow = max(NARROW_HZ, 1.0 / facts.span_s)
    odd = rate / 2 * (2 * np.floor(f / rate) + 1)
    if abs(f - odd) < narrow:
        return "its own mirror image"
    if harmonic == 1:
        for other, factor in (("its second harmonic", 3), ("its second harmonic's mirror", 4)):
            k = round(factor * f / rate)
            if k % factor and abs(f - k * rate / factor) < narrow:
                return other
    return ""


def keeps_branch(f_hz: float, rate_hz: float) -> tuple[float, float]:
    """Factors of the row times between which the branch stays (nearest alias at f +- rate)."""
    low = 1 - rate_hz / (2 * f_hz + rate_hz)
    high = 1 + rate_hz / (2 * f_hz - rate_hz) if 2 * f_hz > rate_hz else float("inf")
    return low, high


def decide(facts: Facts, anchor: Anchor, settings: MotionSettings) -> Decision:
    """Status with reasons, in the order of CONVENTIONS.md."""
    f = float(facts.table.f_hz[0])
    blind = tuple(bool(zone(f, facts, h)) for h in range(1, settings.harmonics + 1))
    status, reasons = _status(facts, anchor, settings)
    return Decision(status, reasons, _advice(status, facts, anchor), blind)


def _status(
    facts: Facts, anchor: Anchor, settings: MotionSettings
) -> tuple[LineStatus, tuple[str, ...]]:
    f, rate = float(facts.table.f_hz[0]), facts.rate_hz
    if not anchor.stamps_true:
        why = "The frames carry no true time stamps, so nothing in this recording can decide."
        return LineStatus.ALIASED, (why, _alike(facts))
    if facts.strength < LINE_EVIDENCE:
        return LineStatus.NONE, ("No periodic motion stands out of the noise.",)
    if rate > 2 * settings.band_hz[1]:
        why = f"{rate:.2f} frames/s exceed twice the band: no alias lies in it."
        return LineStatus.DIRECT, (why,)
    if facts.fast_hz_s > CHIRP_HZ_S and facts.chi2 * facts.noise_scale**2 > CHIRP_MISFIT:
        why = f"The speed changes by up to {facts.fast_hz_s:.1f} Hz a second"
        return LineStatus.CHIRP, (f"{why}: too fast to be resolved.",)
    like = zone(f, facts)
    if like:
        why = f"Near {f:.2f} Hz a line looks like {like} at {rate:.2f} frames/s"
        return LineStatus.BLIND, (f"{why}; no amplitude is given.",)
    size = float(np.linalg.norm(facts.amplitude_mm))
    spread = float(np.linalg.norm(facts.sigma_mm))
    if spread > AMPLITUDE_SHARE * size and facts.table.lead < CONFIRMED_LEAD:
        why = f"The amplitude of {size:.2g} mm is known to {spread:.2g} mm only"
        return LineStatus.BLIND, (f"{why}; no amplitude is given.",)
    if no_anchor(anchor):
        why = "Neither the row times nor the offset of the cameras is known from elsewhere."
        return LineStatus.AMBIGUOUS, (_alike(facts), why)
    lead = facts.table.lead
    if lead < SUPPORTED_LEAD:
        return LineStatus.AMBIGUOUS, (_alike(facts),)
    doubts = _doubts(facts, settings)
    if doubts:
        rival = float(facts.table.f_hz[1]) if facts.table.f_hz.size > 1 else float("nan")
        why = f"Probably {f:.2f} Hz; {rival:.2f} Hz is not excluded"
        return LineStatus.SUPPORTED, (f"{why}: " + "; ".join(doubts) + ".",)
    return LineStatus.CONFIRMED, (f"{f:.3f} Hz given {_anchor_words(anchor)}.",)


def _doubts(facts: Facts, settings: MotionSettings) -> list[str]:
    doubts = []
    lead, f = facts.table.lead, float(facts.table.f_hz[0])
    alike = collision(f, facts)
    asked = COLLISION_LEAD if alike else CONFIRMED_LEAD
    if lead < asked:
        near = f", as it looks like {alike} at this frame rate" if alike else ""
        doubts.append(f"it leads by {lead:.1f} of the {asked:.0f} asked{near}")
    if facts.chi2 > CHI2_LIMIT:
        doubts.append(f"the motion is not quite of this kind (chi2 {facts.chi2:.2f})")
    if facts.beside > BESIDE_LIMIT:
        doubts.append("a second line stands beside it: its speed may wander")
    if facts.noise_scale > NOISE_LIMIT:
        doubts.append(f"the pictures scatter {facts.noise_scale:.1f} times more than they should")
    if facts.stray:
        doubts.append(facts.stray)
    if facts.offset_lost and lead < LOST_LEAD:
        doubts.append("no slow sway shows by how much the cameras are out of step")
    if facts.fast_hz_s > UNEVEN_HZ_S:
        doubts.append(f"its speed seems to change by up to {facts.fast_hz_s:.1f} Hz a second")
    if facts.row_sigmas > ROW_SIGMAS:
        far = f"{facts.row_sigmas:.1f} sigma from those that were told"
        doubts.append(f"the row times that describe the pictures best lie {far}")
    low, high = settings.band_hz
    if not low <= f <= high:
        doubts.append(f"it lies outside the band of {low:g}-{high:g} Hz")
    return doubts


def no_anchor(anchor: Anchor) -> bool:
    """Nothing known from elsewhere that could tell aliases apart."""
    rows = np.isinf([anchor.left_row_time_sigma_s, anchor.right_row_time_sigma_s]).all()
    return bool(rows and not _offset_known(anchor))


def _offset_known(anchor: Anchor) -> bool:
    return bool(np.isfinite(anchor.right_offset_sigma_s)) and anchor.offset_source != "unknown"


def _alike(facts: Facts) -> str:
    near = facts.table.probability >= 0.01
    parts = [
        f"{f:.2f} Hz ({100 * p:.0f} %)"
        for f, p in zip(facts.table.f_hz[near], facts.table.probability[near], strict=True)
    ]
    size = float(np.linalg.norm(facts.amplitude_mm))
    sizes = [f"{(2 * np.pi * f) ** 2 * size * 1e-3:.3g}" for f in facts.table.f_hz[near]]
    return f"{' or '.join(parts)}: {size:.2g} mm would be {' or '.join(sizes)} m/s²."


def _anchor_words(anchor: Anchor) -> str:
    words = []
    for side in ("left", "right"):
        value = 1e6 * getattr(anchor, f"{side}_row_time_s")
        sigma = 1e6 * getattr(anchor, f"{side}_row_time_sigma_s")
        if np.isfinite(sigma):
            source = anchor.row_time_source
            words.append(f"{side} row time {value:.2f} ± {sigma:.2f} µs ({source})")
    if _offset_known(anchor):
        offset, sigma = 1e3 * anchor.right_offset_s, 1e3 * anchor.right_offset_sigma_s
        words.append(f"offset {offset:.2f} ± {sigma:.2f} ms ({anchor.offset_source})")
    return ", ".join(words)


def _advice(status: LineStatus, facts: Facts, anchor: Anchor) -> tuple[str, ...]:
    if status is LineStatus.CONFIRMED:
        return ()
    out = []
    if status is LineStatus.CHIRP:
        out.append("Let the machine run at an even speed for ten seconds.")
    if not anchor.stamps_true:
        out.append("Keep the time stamps of the frames.")
    if np.isinf(anchor.left_row_time_sigma_s):
        out.append("Measure each camera's row time once (olivevib rowtime).")
    if in_step(facts.offset_s, facts.rate_hz):
        out.append("Start the cameras 8-13 ms apart.")
    out.append("Use exposures up to 2 ms and markers of at least 50 mm that move in their plane.")
    out.append("Record two seconds of rest and the start-up.")
    return tuple(out)
