"""A column of times, as written, to seconds: numbers in any unit, epochs, dates, times of day."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, timezone

import numpy as np

from olivevib.arrays import Floats
from olivevib.errors import Caution, InputError
from olivevib.files.accelerometer.names import Meaning
from olivevib.files.accelerometer.record import Channel
from olivevib.files.accelerometer.units import TIME, parse_unit

_EPOCH_S = (9.4e8, 4.2e9)  # 1999 … 2103
_DAY_S = 86400.0
_PLAUSIBLE_HZ = (4.0, 60000.0)


@dataclass(frozen=True)
class Stamps:
    """t_s (N,) seconds, NaN where a cell is unreadable; start: the instant of t = 0, if known."""

    t_s: Floats
    start: datetime | None = None
    cautions: tuple[Caution, ...] = ()


def read_stamps(
    channels: list[Channel],
    name: Meaning,
    source: str,
    *,
    unit: str | None = None,
    rate_hz: float | None = None,
) -> Stamps:
    """Seconds of one time column, or of a date and a time column.

    ``unit`` declares the unit of numbers; ``rate_hz`` (from the header) decides where the column
    names none. Epoch and dated stamps begin at 0, their start is given apart.
    """
    if channels[0].text is None:
        return _numeric(channels[0].values, name, source, unit, rate_hz)
    texts = [str(c) for c in channels[0].text]
    if len(channels) > 1 and channels[1].text is not None:
        texts = [f"{a} {b}" for a, b in zip(texts, channels[1].text, strict=True)]
    return _written(texts, source)


def _numeric(
    values: Floats, name: Meaning, source: str, declared: str | None, rate_hz: float | None
) -> Stamps:
    cautions: tuple[Caution, ...] = ()
    factor = _declared_factor(declared, source) if declared else None
    if factor is None and name.unit is not None and name.unit.quantity == TIME:
        factor = name.unit.factor
    if factor is None:
        factor, cautions = _find_factor(values, name, source, rate_hz)
    good = values[np.isfinite(values)]
    typical = float(np.median(good)) * factor if good.size else 0.0
    if not _EPOCH_S[0] < typical < _EPOCH_S[1]:
        return Stamps(values * factor, cautions=cautions)
    first = float(good[0])
    start = datetime.fromtimestamp(first * factor, tz=UTC)
    return Stamps((values - first) * factor, start, cautions)


def _declared_factor(text: str, source: str) -> float:
    unit = parse_unit(text)
    if unit is None or unit.quantity != TIME:
        raise InputError(
            f"{source}: time_unit = {text} is no unit of time.", "", "Use s, ms, us or ns."
        )
    return unit.factor


def _find_factor(
    values: Floats, name: Meaning, source: str, rate_hz: float | None
) -> tuple[float, tuple[Caution, ...]]:
    """The factor to s of a time column without a unit: epoch, rate in the header, or its steps."""
    good = values[np.isfinite(values)]
    steps = np.diff(good)
    steps = steps[steps > 0]
    if not steps.size:
        return 1.0, ()
    middle = float(np.median(good))
    for factor in (1.0, 1e-3, 1e-6, 1e-9):
        if _EPOCH_S[0] < middle * factor < _EPOCH_S[1]:
            return factor, ()
    mean = float(good[-1] - good[0]) / max(1, good.size - 1)
    step = mean if mean > 0 else float(np.median(steps))
    words = {1.0: "s", 1e-3: "ms", 1e-6: "us", 1e-9: "ns"}
    fits = [f for f in words if _PLAUSIBLE_HZ[0] <= 1 / (step * f) <= _PLAUSIBLE_HZ[1]]
    if rate_hz is not None:
        fits = [f for f in words if 0.9 < step * f * rate_hz < 1.1]
        if len(fits) == 1:
            return fits[0], ()
    if any(abs(s - round(s)) > 1e-9 for s in steps[:100].tolist()) and 1.0 in fits:
        fits = [1.0]  # fractions of a second are written in seconds
    if len(fits) == 1:
        text = f"The time column {name.name or '1'} of {source} names no unit: taken as "
        remedy = "If that is wrong, give time_unit."
        return fits[0], (Caution("sensor-time-unit-assumed", text + words[fits[0]] + ".", remedy),)
    guesses = ", ".join(f"{words[f]}: {1 / (step * f):.6g} Hz" for f in words)
    raise InputError(
        f"{source}: the time column {name.name or '1'} names no unit.",
        f"Its mean step of {step:.6g} would mean, in {guesses}.",
        "Give time_unit (s, ms, us or ns), or rate_hz.",
    )


_WRITTEN = re.compile(
    r"\s*(?:(\d{1,4})[-/.](\d{1,2})[-/.](\d{1,4}))?[T ,_]*"
    r"(?:(\d{1,3}):(\d{2})(?::(\d{2}))?(?:[.,:](\d+))?)?\s*([AaPp])?(?:\.?[Mm]\.?)?\s*"
    r"(Z|UTC|(?:UTC)?[+-]\d{2}:?\d{2})?\s*"
)


def _written(texts: list[str], source: str) -> Stamps:
    """Seconds of written dates and times; passing midnight adds a day where no date stands."""
    matches = [_WRITTEN.fullmatch(text) for text in texts]
    day_first = _day_first(matches)
    days = np.array([_day(m, day_first) for m in matches])
    clock = np.array([_clock(m) for m in matches])
    if np.isnan(clock).all():
        raise InputError(
            f"{source}: the time column holds no times.",
            f"Its first cell is {texts[0][:40]!r}." if texts else "",
            "Name the time column (time_column), or give rate_hz.",
        )
    if np.isnan(days).all():
        turns = np.diff(clock, prepend=clock[:1]) < -_DAY_S / 2
        return Stamps(clock + _DAY_S * np.cumsum(turns))
    first = int(np.flatnonzero(np.isfinite(days + clock))[0])
    t_s = (days - days[first]) * _DAY_S + (clock - clock[first])
    match = matches[first]
    zone = _zone(match[9] if match else None)
    day = datetime.fromordinal(int(days[first])).replace(tzinfo=zone)
    start = day + timedelta(seconds=float(clock[first]))
    if day_first is None:
        text = f"The date {texts[first][:30]!r} of {source} may be day/month or month/day."
        remedy = "Give the start as year-month-day if it matters."
        return Stamps(t_s, None, (Caution("sensor-date-ambiguous", text, remedy),))
    return Stamps(t_s, start)


def _day_first(matches: list[re.Match[str] | None]) -> bool | None:
    """Day before month? None where dates such as 03/04/2025 leave it open."""
    seen = [m for m in matches if m and m[1]]
    if not seen or all(len(m[1]) == 4 for m in seen):
        return True
    if any(int(m[1]) > 12 for m in seen):
        return True
    if any(int(m[2]) > 12 for m in seen):
        return False
    return True if "." in seen[0][0].split(":")[0] else None


def _day(match: re.Match[str] | None, day_first: bool | None) -> float:
    if not match or not match[1]:
        return np.nan
    a, b, c = int(match[1]), int(match[2]), int(match[3])
    if len(match[1]) == 4:
        year, month, day = a, b, c
    else:
        year = c if c > 99 else 2000 + c
        day, month = (a, b) if day_first in (True, None) else (b, a)
    try:
        return float(datetime(year, month, day).toordinal())
    except ValueError:
        return np.nan


def _clock(match: re.Match[str] | None) -> float:
    """Seconds since midnight; ``mm:ss.fff`` where only one colon and a fraction stand."""
    if not match or not match[4]:
        return np.nan
    a, b, c, fraction = int(match[4]), int(match[5]), match[6], match[7]
    part = float(f"0.{fraction}") if fraction else 0.0
    if c is None and fraction:
        return a * 60.0 + b + part
    if match[8]:
        a = a % 12 + (12 if match[8] in "Pp" else 0)
    return a * 3600.0 + b * 60.0 + float(c or 0) + part


def _zone(text: str | None) -> timezone | None:
    if not text:
        return None
    digits = re.sub(r"[^\d+-]", "", text)
    if not digits:
        return UTC
    sign = -1 if digits[0] == "-" else 1
    offset = timedelta(hours=int(digits[1:3]), minutes=int(digits[3:5]))
    return timezone(sign * offset) if offset < timedelta(hours=24) else None


def written_start(text: str) -> datetime | None:
    """The instant that ``text`` spells as date and time, or None where it is not both."""
    match = _WRITTEN.fullmatch(text)
    if not match or not match[1] or not match[4] or _day_first([match]) is None:
        return None
    day, clock = _day(match, _day_first([match])), _clock(match)
    if not np.isfinite(day + clock):
        return None
    start = datetime.fromordinal(int(day)).replace(tzinfo=_zone(match[9]))
    return start + timedelta(seconds=clock)
