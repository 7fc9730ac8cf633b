"""The study of the vibration goals runs, and its cheap parts reach what they promise."""

from __future__ import annotations

import re

import pytest
from studies.vibration import STUDIES


@pytest.mark.slow
@pytest.mark.parametrize("name", [n for n in STUDIES if n != "s11"])
def test_every_study_yields_rows(name):
    rows = STUDIES[name](24)
    assert rows
    assert all(len(row) == 4 and all(row) for row in rows)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "reach"), [("s1", 1.05), ("s7", 1.1)])
def test_frequency_errors_stay_at_the_bound(name, reach):
    """400 trials know the ratio to 3.5 %."""
    for row in STUDIES[name](400):
        ratio = re.match(r"([\d.]+) x bound", row[2])
        if ratio:
            assert float(ratio[1]) < reach + 0.07
