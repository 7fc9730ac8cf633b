"""Generated logger files: separator x decimal mark x unit x header x stamps, and what is wrong."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from olivevib.arrays import Floats
from olivevib.errors import InputError
from olivevib.files.accelerometer import read_accelerometer

G = 9.80665
SEPARATORS = [(",", "."), (";", "."), ("\t", "."), ("|", "."), (" ", "."), (";", ","), ("\t", ",")]
SEPARATORS += [(" ", ","), ("|", ",")]
# spelling, plain name, m/s2 per unit, decimals that keep 1e-3 m/s2
UNITS = [
    ("m/s²", "m/s2", 1.0, 5),
    ("m/s^2", "m/s2", 1.0, 5),
    ("m/s2", "m/s2", 1.0, 5),
    ("g", "g", G, 6),
    ("G", "g", G, 6),
    ("mg", "mg", G / 1000, 3),
    ("mm/s²", "mm/s2", 1e-3, 2),
    ("cm/s^2", "cm/s2", 1e-2, 3),
    ("ft/s²", "ft/s2", 0.3048, 5),
    ("counts", "counts", G / 2048, 0),
    ("", "", 1.0, 5),
]
HEADERS = ["bracket", "square", "suffix", "row", "block", "german", "none"]
STAMPS = ["s", "ms", "us", "iso", "clock", "epoch ms", "epoch s", "header rate", "nothing"]
RATE_HZ = 250.0


@dataclass(frozen=True)
class Variant:
    """One way to write the same recording; unit: spelling, plain name, m/s2 per unit, decimals."""

    separator: str
    decimal: str
    unit: tuple[str, str, float, int]
    header: str
    stamp: str
    encoding: str
    newline: str

    @property
    def unit_is_told(self) -> bool:
        """The file says its unit."""
        return bool(self.unit[0]) and self.header != "none"


def variants(count: int) -> list[Variant]:
    """``count`` of all combinations, always the same ones."""
    every = list(itertools.product(SEPARATORS, UNITS, HEADERS, STAMPS))
    rng = np.random.default_rng(20261120)
    picked = rng.choice(len(every), size=count, replace=False)
    out = []
    for k in picked:
        (separator, decimal), unit, header, stamp = every[int(k)]
        encoding = str(rng.choice(["utf-8", "utf-8-sig", "cp1252", "utf-16"]))
        newline = str(rng.choice(["\n", "\r\n"]))
        if separator == " " and stamp in ("iso", "clock") and header != "none":
            stamp = "s"
        out.append(Variant(separator, decimal, unit, header, stamp, encoding, newline))
    return out


def logger_truth(n: int = 400) -> tuple[Floats, Floats]:
    """Times (N,) and acceleration (N, 3) in m/s2: rest, then shaking."""
    rng = np.random.default_rng(5)
    t_s = np.arange(n) / RATE_HZ
    a = rng.normal(0, 0.02, (n, 3)) + np.array([0.6, -0.9, 9.745])
    shaking = (t_s > 0.9)[:, None]
    a += shaking * np.stack([np.sin(160 * t_s), np.cos(160 * t_s), 0 * t_s], axis=1) * 30
    return t_s, a


def number(value: float, decimals: int, decimal: str) -> str:
    """A number with that decimal mark."""
    return f"{value:.{decimals}f}".replace(".", decimal)


def stamp_cells(variant: Variant, t_s: Floats) -> list[str] | None:
    """The time column; None where the variant has none."""
    start = datetime(2026, 11, 20, 23, 59, 59)
    match variant.stamp:
        case "s":
            return [number(t, 4, variant.decimal) for t in t_s]
        case "ms" | "us":
            scale = {"ms": 1e3, "us": 1e6}[variant.stamp]
            return [str(round(t * scale)) for t in t_s]
        case "iso":
            return [
                (start + timedelta(seconds=float(t))).isoformat("T", "milliseconds") for t in t_s
            ]
        case "clock":
            return [(start + timedelta(seconds=float(t))).strftime("%H:%M:%S.%f")[:12] for t in t_s]
        case "epoch ms":
            return [str(round(1.79e12 + 1000 * t)) for t in t_s]
        case "epoch s":
            return [number(1.79e9 + t, 3, variant.decimal) for t in t_s]
    return None


def names(variant: Variant, with_time: bool) -> tuple[list[str], list[str]]:
    """Column names and the units of a row of units."""
    unit = variant.unit[0]
    time_unit = {"s": "s", "ms": "ms", "us": "us", "epoch ms": "ms", "epoch s": "s"}.get(
        variant.stamp, ""
    )
    match variant.header:
        case "bracket":
            form, time, stems = "{} ({})", "Time", [f"Acceleration {a}" for a in "XYZ"]
        case "square":
            form, time, stems = "{} [{}]", "timestamp", [f"acc_{a}" for a in "xyz"]
        case "suffix":
            form, time, stems = "{}_{}", "time", [f"a{a}" for a in "xyz"]
        case "german":
            form, time, stems = "{} in {}", "Zeit", [f"Beschleunigung {a}" for a in "xyz"]
        case _:
            form, time, stems = "{}", "Time", [f"Acc{a}" for a in "XYZ"]
    inside = variant.header in ("bracket", "square", "suffix", "german")
    one = [form.format(stem, unit) if inside and unit else stem for stem in stems]
    units = [unit] * 3
    if with_time:
        told = form.format(time, time_unit) if inside and time_unit else time
        if not inside and variant.header != "row" and time_unit:
            told = f"Time ({time_unit})"
        one, units = [told, *one], [time_unit or "-", *units]
    if variant.separator == " ":
        one = [name.replace(" ", "_") for name in one]
    return one, units


def written(variant: Variant) -> bytes:
    """The file."""
    t_s, a = logger_truth()
    _, plain, factor, decimals = variant.unit
    stamps = stamp_cells(variant, t_s)
    rows = []
    for k, row in enumerate(a / factor):
        cells = [number(v, decimals, variant.decimal) for v in row]
        rows.append(variant.separator.join([*([stamps[k]] if stamps else []), *cells]))
    head = [f"Logger{variant.separator}Type 7"] if variant.header != "none" else []
    if variant.stamp == "header rate":
        head.append(f"Sample rate: {number(RATE_HZ, 1, variant.decimal)} Hz")
    if variant.header == "block" and plain:
        head.append(f"Unit: {variant.unit[0]}")
    if variant.header != "none":
        one, units = names(variant, stamps is not None)
        head += ["", variant.separator.join(one)]
        if variant.header == "row" and plain:
            head.append(variant.separator.join(units))
    text = variant.newline.join([*head, *rows]) + variant.newline
    return text.encode(variant.encoding)


def problem(variant: Variant, path: Path) -> str:
    """What is wrong with how a variant was read; "" where it is right or rightly refused."""
    path.write_bytes(written(variant))
    t_s, a = logger_truth()
    try:
        record = read_accelerometer(path)
    except InputError as refused:
        if variant.stamp == "nothing":
            return "" if "rate" in str(refused) or "unit" in str(refused) else f"refused: {refused}"
        if variant.stamp in ("ms", "us", "epoch ms") and variant.header == "none":
            return ""  # whole numbers without a name: s, ms and us are all possible
        if not variant.unit_is_told:
            return "" if "unit" in str(refused) else f"refused: {refused}"
        return f"refused: {refused}"
    basis = record.unit_basis
    proposed = variant.unit[1] == "counts"
    if not variant.unit_is_told and not proposed:
        return f"taken as {record.source_unit} ({basis}) without being told"
    if proposed != (basis == "proposed from rest magnitude"):
        return f"basis {basis}"
    tolerance = 0.02 if not proposed else 0.6
    worst = float(np.abs(record.samples.values - a).max())
    if worst > tolerance:
        return f"values off by {worst:.3g} m/s2, taken as {record.source_unit}"
    if abs(record.rate_hz - RATE_HZ) > 0.05:
        return f"rate {record.rate_hz}"
    if variant.stamp in ("s", "ms", "us") and abs(record.samples.t_s[-1] - t_s[-1]) > 1e-3:
        return f"ends at {record.samples.t_s[-1]}"
    return ""
