"""The dominant line of a motion: found on the true times, fitted jointly on all axes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.special import gammaincinv

from olivevib.arrays import Bools, Floats
from olivevib.signals import Samples
from olivevib.vibration.blocks import block_means, block_size, undone
from olivevib.vibration.chirp import Chirp, find_chirp
from olivevib.vibration.clock import Clock, clock_of, measured
from olivevib.vibration.lsscan import OVERSAMPLING, Scan, scan
from olivevib.vibration.sinefit import SineFit, Tones, fit_sines
from olivevib.vibration.sway import sway_columns, sways
from olivevib.vibration.types import Line, LineStatus
from olivevib.vibration.verdict import Finding, SamplingFacts, fold, judge

_FEWEST = 12  # samples below which nothing is called a line
_APART = 1.5  # bins of 1/T that two waves must lie apart to be told apart safely
_EVEN_ENOUGH = 1e-3  # periods
_MOST = 0.5  # of the motion that a line must explain not to be asked about its speed
_ROUNDING = 1e-9  # of the line: what is left below that is arithmetic, not motion
_LOCAL = 16  # bins either side whose median is the local noise


@dataclass(frozen=True)
class LineSettings:
    """How a line is looked for.

    false_alarm: probability that white noise alone yields a line. harmonics: highest multiple
    fitted with the line. neighbours: how many further tones the joint fit may take in. sway:
    whether slow motion is fitted along where there is any (not for an accelerometer).
    """

    false_alarm: float = 1e-3
    harmonics: int = 3
    neighbours: int = 3
    sway: bool = True

    def __post_init__(self) -> None:
        if not 0 < self.false_alarm < 1:
            raise ValueError(f"false_alarm must lie between 0 and 1, got {self.false_alarm}")
        if self.harmonics < 1 or self.neighbours < 0:
            raise ValueError("harmonics must be at least 1 and neighbours at least 0")


@dataclass(frozen=True)
class LineFit:
    """A line and the fit behind it (None: no line); sway_hz: slower motion was fitted along."""

    line: Line
    fit: SineFit | None
    sway_hz: float = 0.0


def dominant_line(
    samples: Samples, facts: SamplingFacts, settings: LineSettings = LineSettings()
) -> Line:
    """The strongest line of a motion with amplitudes on its axes, sigmas, status and reasons."""
    return fit_line(samples, facts, settings).line


def fit_line(samples: Samples, facts: SamplingFacts, settings: LineSettings) -> LineFit:
    """Find, fit and judge the dominant line of samples (N, C), C <= 3.

    Axis powers are added, never the spectrum of the resultant (it doubles the frequency of a
    straight motion). The line is looked for where the band, or an alias of it, can be seen; slow
    sway is fitted along where there is any; harmonics and strong neighbours join the fit.
    Status "none" where nothing stands out of the noise.
    """
    t_s, values = measured(samples)
    if t_s.size < _FEWEST:
        return _nothing(samples, t_s, f"Only {t_s.size} samples: too few to look for a line.")
    search = _Search.of(t_s, values, facts, settings)
    fit, sway = search.fitted()
    if settings.sway and (fit is None or not search.explains(fit)):
        chirp = find_chirp(samples, facts.sway_hz)
        if chirp is not None:
            return _nothing(samples, t_s, _too_fast(chirp), LineStatus.CHIRP)
    if fit is None:
        return _nothing(samples, t_s, "No line stands out of the noise.")
    return _judged(search, fit, sway, samples)


def _too_fast(chirp: Chirp) -> str:
    return (
        f"The speed changes too fast for one line: seen between {chirp.low_hz:.1f} and "
        f"{chirp.high_hz:.1f} Hz. Let the machine run at one speed for five seconds."
    )


def _nothing(
    samples: Samples, t_s: Floats, reason: str, status: LineStatus = LineStatus.NONE
) -> LineFit:
    unknown = np.full(3, np.nan)
    middle = float(t_s.mean()) if t_s.size else 0.0
    line = Line(
        f_hz=np.nan,
        f_sigma_hz=np.nan,
        status=status,
        candidates_hz=(),
        amplitude=unknown,
        amplitude_sigma=unknown,
        phase_rad=unknown,
        t_ref_s=middle,
        unit=samples.unit,
        harmonics=np.empty((0, 3)),
        reasons=(reason,),
    )
    return LineFit(line, None)


@dataclass(frozen=True)
class _Search:
    t_s: Floats
    values: Floats
    facts: SamplingFacts
    settings: LineSettings
    clock: Clock
    block: int  # samples that were averaged into one
    sample_hz: float
    scans: list[tuple[SineFit, Scan]] = field(default_factory=list)  # the last one made

    @classmethod
    def of(
        cls, t_s: Floats, values: Floats, facts: SamplingFacts, settings: LineSettings
    ) -> _Search:
        clock = clock_of(t_s)
        dense = facts.direct and clock.complete and clock.worst_periods < _EVEN_ENOUGH
        block = block_size(clock.rate_hz, facts.band_hz[1], t_s.size) if dense else 1
        if block > 1:
            t_s, values = block_means(t_s, values, block)
        shown = clock if block == 1 else clock_of(t_s)
        return cls(t_s, values, facts, settings, shown, block, clock.rate_hz)

    @property
    def bin_hz(self) -> float:
        return 1.0 / float(self.t_s[-1] - self.t_s[0])

    @property
    def top_hz(self) -> float:
        half = self.clock.rate_hz / 2
        return min(half, self.facts.band_hz[1]) if self.facts.direct else half

    @property
    def left_top_hz(self) -> float:
        """Up to where what a fit leaves is looked at: neighbours, noise around the line."""
        half = self.clock.rate_hz / 2
        return min(half, 3 * self.facts.band_hz[1]) if self.facts.direct else half

    def fitted(self) -> tuple[SineFit | None, Floats | None]:
        """The line above the sway first; only where there is none, one among the sway (blind)."""
        slow_hz = self.facts.sway_hz if self.settings.sway else 0.0
        sway = sway_columns(self.t_s, slow_hz)
        fit = self.one(sway, self.facts.sway_hz)
        if fit is not None and sway is not None:
            rest = self.values - fit.motion(self.t_s)
            if not sways(sway, rest, fit.noise, self.settings.false_alarm):
                sway = None
                fit = self.one(None, self.facts.sway_hz) or fit
        if fit is None and not self.facts.direct:
            return self.one(None, 0.0), None
        return fit, sway

    def explains(self, fit: SineFit) -> bool:
        """The waves hold most of what they leave and they together hold."""
        power = float(np.sum(fit.motion(self.t_s) ** 2))
        return power > _MOST * (power + float(np.sum(fit.residual**2)))

    def one(self, sway: Floats | None, from_hz: float) -> SineFit | None:
        values = self.values if sway is None else self.values - sway @ (sway.T @ self.values)
        found = scan(self.t_s, values, self.top_hz, 0 if sway is None else sway.shape[1])
        allowed = (found.f_hz >= from_hz) & self.reachable(found.f_hz)
        start = strongest(found, allowed, self.settings.false_alarm)
        if start is None:
            return None
        return self.joint(start, sway)

    def reachable(self, f_hz: Floats) -> Bools:
        """Which seen frequencies the band can produce, itself or folded."""
        low, high = self.facts.band_hz
        if self.facts.direct:
            return np.asarray((f_hz >= low) & (f_hz <= high))
        rate = self.facts.frame_rate_hz
        k = np.arange(int(np.ceil(high / rate)) + 2)[:, None] * rate
        inside = [(k + s * f_hz >= low) & (k + s * f_hz <= high) for s in (-1, 1)]
        return np.asarray((inside[0] | inside[1]).any(axis=0))

    def joint(self, start_hz: float, sway: Floats | None) -> SineFit:
        """The line with its harmonics, then with neighbours that stand out of what is left."""
        fit = self.with_harmonics(start_hz, (), sway)
        for _ in range(self.settings.neighbours):
            if float(fit.noise.max()) < _ROUNDING * float(fit.amplitude.max()):
                break
            left = self.left(fit, sway)
            allowed = left.f_hz > (self.facts.sway_hz if sway is not None else 0.0)
            start = strongest(left, allowed, self.settings.false_alarm)
            if start is None:
                break
            wider = self.with_harmonics(float(fit.f_hz[0]), (*fit.f_hz[1:], start), sway)
            if not self.told_apart(wider):
                break
            fit = wider
        return fit

    def left(self, fit: SineFit, sway: Floats | None) -> Scan:
        """The scan of what a fit leaves, made once for each fit."""
        if not self.scans or self.scans[-1][0] is not fit:
            lost = 0 if sway is None else sway.shape[1]
            self.scans[:] = [(fit, scan(self.t_s, fit.residual, self.left_top_hz, lost))]
        return self.scans[-1][1]

    def with_harmonics(
        self, f_hz: float, others: tuple[float, ...], sway: Floats | None
    ) -> SineFit:
        multiples = self.multiples(f_hz, others, sway is not None)
        tones = Tones((0,) * len(multiples), multiples)
        for _ in others:
            tones = tones.adding()
        return fit_sines(self.t_s, self.values, np.array([f_hz, *others]), tones, sway)

    def multiples(self, f_hz: float, others: tuple[float, ...], swaying: bool) -> tuple[int, ...]:
        """1 and the harmonics that fall on no other wave, on no fold and not into the sway."""
        rate, apart = self.clock.rate_hz, _APART * self.bin_hz
        seen = [fold(f, rate) for f in (f_hz, *others)]
        low = max(apart, self.facts.sway_hz + apart if swaying else 0.0)
        kept = [1]
        for m in range(2, self.settings.harmonics + 1):
            at = fold(m * f_hz, rate)
            if low < at < rate / 2 - apart and min(abs(at - s) for s in seen) > apart:
                kept.append(m)
                seen.append(at)
        room = (self.t_s.size - 8) // 6
        return tuple(kept[: max(1, room)])

    def told_apart(self, fit: SineFit) -> bool:
        """The free tones stayed apart, and each amplitude is larger than its error."""
        seen = np.sort([fold(float(f), self.clock.rate_hz) for f in fit.f_hz])
        if (np.diff(seen) < 0.5 * self.bin_hz).any():
            return False
        strength = (fit.amplitude / np.maximum(fit.amplitude_sigma, 1e-300)).max(axis=1)
        first = [fit.tones.group.index(k) for k in range(fit.tones.count)]
        return bool((strength[first] > 3).all())


def strongest(found: Scan, allowed: Bools, false_alarm: float) -> float | None:
    """The frequency of greatest power among those that noise does not explain, or None.

    A line must stand out of white noise and of the noise around it (coloured noise, drift and
    wandering motion raise whole ranges): the evidence is divided by how far the median of its
    surroundings lies above what white noise gives.
    """
    if not allowed.any():
        return None
    evidence = found.evidence
    width = float(allowed.sum() * (found.f_hz[1] - found.f_hz[0]))
    strong = np.flatnonzero(allowed & (evidence > found.total.size))
    order = strong[np.argsort(found.power[strong])[::-1]]
    for k in order[:200]:
        if found.false_alarm(float(evidence[k]), width) >= false_alarm:
            continue  # noise explains it even before its surroundings are looked at
        worth = evidence[k] / _above_white(evidence, int(k), found.total.size)
        if found.false_alarm(float(worth), width) < false_alarm:
            return _summit(found, int(k))
    return None


def _above_white(evidence: Floats, k: int, axes: int) -> float:
    far, near = _LOCAL * OVERSAMPLING, 2 * OVERSAMPLING
    around = np.concatenate(
        [evidence[max(0, k - far) : max(0, k - near)], evidence[k + near : k + far]]
    )
    if around.size < 4 * OVERSAMPLING:
        return 1.0
    return max(1.0, float(np.median(around) / gammaincinv(axes, 0.5)))


def _summit(found: Scan, k: int) -> float:
    """The scan point of most evidence within one bin of k: noisy axes must not shift the start."""
    low = max(0, k - OVERSAMPLING)
    return float(found.f_hz[low + int(np.argmax(found.evidence[low : k + OVERSAMPLING + 1]))])


def _judged(search: _Search, fit: SineFit, sway: Floats | None, samples: Samples) -> LineFit:
    finding = _finding(search, fit, samples.unit)
    if not finding.candidates_hz:
        low, high = search.facts.band_hz
        reason = f"The strongest line cannot come from the band of {low:g}-{high:g} Hz."
        return _nothing(samples, search.t_s, reason)
    if abs(finding.candidates_hz[0] - fit.f_hz[0]) > search.bin_hz:
        fit = search.with_harmonics(finding.candidates_hz[0], tuple(fit.f_hz[1:]), sway)
        finding = _finding(search, fit, samples.unit)
    sway_hz = 0.0 if sway is None else search.facts.sway_hz
    coloured = _coloured(search, fit, sway)
    if search.block > 1:
        fit = undone(fit, search.block, search.sample_hz)
    return LineFit(_line(search, fit, coloured, finding, samples.unit), fit, sway_hz)


def _finding(search: _Search, fit: SineFit, unit: str) -> Finding:
    facts = search.facts
    seen = float(fit.f_hz[0])
    if not facts.direct:
        seen = fold(seen, facts.frame_rate_hz)
    largest = float(fit.amplitude[0].max()) if unit == "mm" else np.nan
    return judge(seen, facts, largest, search.clock.span_s)


def _line(search: _Search, fit: SineFit, coloured: Floats, finding: Finding, unit: str) -> Line:
    blind = finding.status is LineStatus.BLIND
    unknown = np.full(3, np.nan)
    return Line(
        f_hz=float(fit.f_hz[0]),
        f_sigma_hz=float(fit.f_sigma_hz[0] * coloured.max()),
        status=finding.status,
        candidates_hz=finding.candidates_hz,
        amplitude=unknown if blind else _three(fit.amplitude[0]),
        amplitude_sigma=unknown if blind else _three(_amplitude_sigma(search, fit, coloured)),
        phase_rad=unknown if blind else _three(fit.phase_rad[0]),
        t_ref_s=fit.t_ref_s,
        unit=unit,
        harmonics=np.empty((0, 3)) if blind else _harmonics(fit, search.settings.harmonics),
        reasons=finding.reasons,
    )


def _amplitude_sigma(search: _Search, fit: SineFit, coloured: Floats) -> Floats:
    """(C,) noise, and what the exposure may take from the amplitude, which is not corrected.

    An exposure E averages a sine of frequency f down by sinc(f E) at most.
    """
    lost = 1.0 - float(np.sinc(fit.f_hz[0] * search.facts.exposure_s))
    return np.asarray(np.hypot(fit.amplitude_sigma[0] * coloured, lost * fit.amplitude[0]))


def _coloured(search: _Search, fit: SineFit, sway: Floats | None) -> Floats:
    """(C,) factor by which the noise around the line exceeds the white level, 1 where it is not.

    var A = Sn/T and var f = 3 Sn/(pi^2 A^2 T^3) need the density *at* the line.
    """
    left = search.left(fit, sway)
    seen = fold(float(fit.f_hz[0]), search.clock.rate_hz)
    distance = np.abs(left.f_hz - seen) / search.bin_hz
    near = (distance < _LOCAL / 2) & (distance > 1)
    if near.sum() < 4 * OVERSAMPLING:
        return np.ones(fit.noise.size)
    level = np.median(left.explained[near], axis=0) / (2 * np.log(2))
    white = np.where(fit.noise > 0, fit.noise**2, 1.0)
    ratio = np.where(fit.noise > 0, level / white, 1.0)
    return np.asarray(np.where(ratio > 2, np.sqrt(ratio), 1.0))


def _three(values: Floats) -> Floats:
    out = np.full(3, np.nan)
    out[: values.size] = values
    return out


def _harmonics(fit: SineFit, highest: int) -> Floats:
    """(H, 3) amplitudes at 2f, 3f, ...; NaN where a harmonic falls on a fold or another wave."""
    out = np.full((highest - 1, 3), np.nan)
    for j, (k, m) in enumerate(zip(fit.tones.group, fit.tones.multiples, strict=True)):
        if k == 0 and m > 1:
            out[m - 2] = _three(fit.amplitude[j])
    return out
