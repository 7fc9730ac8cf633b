"""What a file's header says of rate, unit and start; and loggers known by their header."""

from __future__ import annotations

import re
from datetime import datetime

from olivevib.files.accelerometer.record import Table
from olivevib.files.accelerometer.stamps import written_start
from olivevib.files.accelerometer.units import ACCELERATION, RAW, TIME, Unit, parse_unit

_RATE_KEY = re.compile(
    r"(sampl|abtast|campion|échant|echant|muestreo|data|scan|acquisition|log).{0,25}"
    r"(rate|freq|frequenz|frequenza|fréquence|frecuencia)|^(fs|odr|rate|samplerate|sps|frequenz\w*|"
    r"frequency|sampling|abtastrate)\b"
)
_STEP_KEY = re.compile(
    r"^(delta_?[xt]|dt|(sampl|abtast|campion|time|log).{0,25}(interval|period|step|inkrement|intervall))"
)
_UNIT_KEY = re.compile(
    r"^(y[_ ]?)?(acc\w*[_ ]?)?(unit|units|unità|unita|unite|unité|unités|einheit|einheiten|unidad|"
    r"unidades)\b|unit_label|units? of (measure|acc)"
)
_NUMBER = re.compile(r"([+-]?\d[\d.,']*(?:[eE][+-]?\d+)?)\s*([^\s\d]*)")
_START_KEY = re.compile(
    r"^(start|start[_ ]?time|start[_ ]?date|date|time|begin|recorded|datum|data)\b"
)


def header_rate_hz(table: Table) -> float | None:
    """The sampling rate that the header declares, Hz; from a rate or from a step."""
    for key, value in table.metadata:
        match = _NUMBER.match(value.strip())
        if not match or not (_RATE_KEY.search(key) or _STEP_KEY.search(key)):
            continue
        number = header_number(match[1], table.decimal)
        bracket = re.search(r"[\[(](.*?)[\])]", key)
        unit = (match[2] or (bracket[1] if bracket else "")).strip("[]().;,").casefold()
        rate = _as_rate(number, unit, step=not _RATE_KEY.search(key))
        if rate is not None:
            return rate
    return None


def _as_rate(number: float | None, unit: str, *, step: bool) -> float | None:
    if number is None or not 0 < number < 1e9:
        return None
    if not step:
        scale = {"khz": 1e3, "mhz": 1e6, "ksps": 1e3, "ks/s": 1e3}.get(unit, 1.0)
        known = unit in ("", "hz", "sps", "s/s", "samples/s", "hertz", "1/s") or scale != 1.0
        return number * scale if known else None
    time = parse_unit(unit) if unit else Unit("s", TIME)
    return 1 / (number * time.factor) if time is not None and time.quantity == TIME else None


def header_number(text: str, decimal: str) -> float | None:
    """A number of the header: ``3072,1`` under a decimal comma, ``10,000`` as thousands else."""
    if decimal == "," or ("," in text and "." not in text and not re.search(r",\d{3}\b", text)):
        text = text.replace(".", "").replace(",", ".") if "," in text else text
    try:
        return float(text.replace(",", "").replace("'", ""))
    except ValueError:
        return None


def header_unit(table: Table) -> Unit | None:
    """The one unit of acceleration (or counts, volts) that the header declares, or None."""
    for key, value in table.metadata:
        if not _UNIT_KEY.search(key):
            continue
        whole = parse_unit(value)
        words = [whole] if whole else [parse_unit(w) for w in re.split(r"[\s,;|]+", value)]
        found = {u for u in words if u is not None and u.quantity in (ACCELERATION, RAW)}
        if len(found) == 1:
            return found.pop()
    return None


def header_start(table: Table) -> datetime | None:
    """Date and time of the start that the header declares, or None."""
    parts: dict[str, str] = {}
    for key, value in table.metadata:
        if _START_KEY.match(key):
            parts.setdefault(key, value)
    texts = [*parts.values()]
    if "date" in parts and "time" in parts:
        texts.insert(0, f"{parts['date']} {parts['time']}")
    for text in texts:
        start = written_start(
            re.sub(
                r",\s*(?=\d\d:)",
                " ",
                text.split(", ")[0] if re.match(r"\d{4}-\d\d-\d\d \d", text) else text,
            )
        )
        if start is not None:
            return start
    return None


def known_logger(table: Table) -> tuple[str, str] | None:
    """(logger, unit) where the header is that of a logger which never writes its unit.

    PicoQuake writes g, GCDC loggers counts, Klipper (``#time,accel_x,…``) mm/s2.
    """
    words = " ".join(f"{k} {v}" for k, v in table.metadata[:20]).casefold()
    if "picoquake" in words:
        return "PicoQuake", "g"
    if "gcdataconcepts" in words:
        return "GCDC", "counts"
    names = tuple(c.name for c in table.channels)
    if (
        names == ("time", "accel_x", "accel_y", "accel_z")
        and ("header mark", "#") in table.metadata
    ):
        return "Klipper", "mm/s2"
    return None
