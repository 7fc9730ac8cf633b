"""The study of vibration runs at a small share, and says what it could not measure."""

from __future__ import annotations

import pytest

from olivevib.studies import Effort
from olivevib.studies.vibration import comparisons, conversions, cost, imports, lines, peers

QUIET = lambda *_: None  # noqa: E731
SMALL = Effort(0.004)


@pytest.mark.parametrize(
    "part",
    [
        lines.frequency,
        lines.amplitude,
        lines.neighbours,
        lines.gaps,
        conversions.derivative,
        conversions.damping,
        imports.matrix,
        imports.speed,
        cost.cost,
    ],
    ids=lambda part: part.__name__,
)
def test_a_small_share_measures_every_goal(part):
    found = part(SMALL, QUIET)
    assert found.table.rows
    assert found.goals
    assert not [goal for goal in found.goals if goal.reached is False], found.goals


def test_a_trial_of_each_kind_is_compared(monkeypatch):
    kinds = (comparisons.CASES[1], comparisons.CASES[-1])
    monkeypatch.setattr(comparisons, "CASES", kinds)
    found = comparisons.comparison(SMALL, QUIET)
    assert [row[0] for row in found.table.rows] == [case.name for case in kinds]
    assert found.goals[-1].reached


def test_recordings_that_are_not_there_leave_goals_unmeasured(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    for part in (conversions.beam, imports.real):
        assert {goal.reached for goal in part(SMALL, QUIET).goals} == {None}


def test_peers_are_measured_or_said_to_be_missing():
    names = [row[0] for row in peers.beside(SMALL, QUIET).table.rows]
    assert names[0] == "olivevib"
    assert any(name.startswith("scipy") for name in names)
    assert any(name.startswith("endaq") for name in names)
