"""Transmissibility from the reference marker to every other, at the dominant line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from olivevib.vibration import Line, LineRatio, Survey, line_ratio


@dataclass(frozen=True)
class Transmissibility:
    """Ratios of the dominant line, marker over reference: ids to LineRatio, in order of the id."""

    reference: int
    ratios: Mapping[int, LineRatio]


def surveyed(survey: Survey | None) -> Transmissibility | None:
    """What the analysis found; None where no marker shares its line with the reference."""
    if survey is None:
        return None
    found = {t.response: t.ratio for t in survey.transmissions if t.ratio is not None}
    return Transmissibility(survey.transmissions[0].reference, found) if found else None


def in_phase(lines: Mapping[int, Line], reference: int) -> Transmissibility | None:
    """The same for the lines of any one phase, by marker id."""
    of = lines.get(reference)
    if of is None or not np.isfinite(of.amplitude).all() or not np.any(of.amplitude > 0):
        return None
    found = {
        i: ratio
        for i, line in sorted(lines.items())
        if i != reference and (ratio := line_ratio(line, of)) is not None
    }
    return Transmissibility(reference, found) if found else None
