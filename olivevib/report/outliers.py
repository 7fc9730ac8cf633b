"""What of a season to look at first: values far from their like, sensors that disagree."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from olivevib.report.clean import clean
from olivevib.report.words import measure

FEWEST = 5  # values of a group from which one can lie outside it
REACH = 1.5  # interquartile ranges beyond the quartiles (Tukey)
QUANTITIES = (
    ("displacement_pp_mm", "displacement, peak to peak", "mm"),
    ("acceleration_rms_m_s2", "acceleration, rms", "m/s2"),
    ("transmissibility", "transmissibility", ""),
    ("seen_fraction", "share of frames in which it was seen", ""),
)


@dataclass(frozen=True)
class Outlier:
    """One value to look at: whose it is, what it is, and what its like are."""

    trial: str
    marker: int
    what: str
    value: str
    usual: str


def outliers(rows: Iterable[Mapping[str, Any]]) -> list[Outlier]:
    """Values beyond Tukey's fences among the markers of the same place, and sensors that differ.

    rows: of the season's table; only headline phases count. Nothing is left out of any figure for
    being listed here.
    """
    shown = [row for row in rows if row["headline"]]
    out = []
    for key, what, unit in QUANTITIES:
        groups: dict[str, list[Mapping[str, Any]]] = defaultdict(list)
        for row in shown:
            if row[key] is not None and row["place"] != "fixed":
                groups[row["place"] or ""].append(row)
        for place, members in sorted(groups.items()):
            out += _outside(members, key, f"{what} on the {place}" if place else what, unit)
    for row in shown:
        if row["verdict"] == "differs":
            gain = measure(row["gain"], "", row["gain_sigma"])
            found = ("camera and accelerometer differ: gain", gain, "1")
            out.append(Outlier(clean(row["trial"], 60), row["marker"], *found))
    return out


def _outside(members: list[Mapping[str, Any]], key: str, what: str, unit: str) -> list[Outlier]:
    values = np.array([row[key] for row in members], dtype=np.float64)
    if values.size < FEWEST:
        return []
    low, middle, high = (float(v) for v in np.percentile(values, [25, 50, 75]))
    reach = REACH * (high - low)
    fences = measure(low - reach, digits=3), measure(high + reach, unit, digits=3)
    usual = f"{fences[0]} to {fences[1]}, median {measure(middle, unit, digits=3)}"
    usual += f" (n = {values.size})"
    far = (values < low - reach) | (values > high + reach)
    return [
        Outlier(clean(row["trial"], 60), row["marker"], what, measure(v, unit, digits=3), usual)
        for row, v, is_far in zip(members, values.tolist(), far, strict=True)
        if is_far
    ]
