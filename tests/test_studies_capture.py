"""The study of the recorder, at a tiny share."""

from __future__ import annotations

import signal

import pytest

from olivevib.progress import silent
from olivevib.studies import BENCHMARKS, find
from olivevib.studies.capture.damage import flips, sound_frames
from olivevib.studies.capture.lamp import row_time_error
from olivevib.studies.capture.losses import Kills, Run, Vanished, kills, long_run, vanish
from olivevib.studies.capture.recorder import Kept
from olivevib.studies.capture.study import _gone_goal, _kill_goal, _run_goals
from olivevib.studies.study import Effort


def test_flipped_bytes_are_named_and_sound_frames_are_not():
    found = flips(Effort(0.01), 2)
    assert found.altered > 10
    assert found.named == found.altered
    assert found.false_alarms == 0
    assert sound_frames(500, silent) == (500, True)


@pytest.mark.parametrize("readout_s", [0.027, -0.02])
def test_the_row_time_of_the_simulated_lamp_is_found(readout_s):
    assert abs(row_time_error(Effort(), readout_s)) < 0.01


def test_goals_tell_what_was_not_reached():
    sound, broken = Kept(60, 0, 0, 0.0), Kept(60, 2, 1, 3.0)
    runs = [Run(30.0, 2.0, False, 0.05, (sound, sound)), Run(30.0, 2.0, True, 0.6, (sound, broken))]
    assert [goal.reached for goal in _run_goals(runs)] == [False, False, True, False]
    assert _kill_goal(Kills(3, 1, 0, 0)).reached is True
    assert _kill_goal(Kills(3, 2, 0, 0)).reached is False
    assert _gone_goal([Vanished(0.5, 0), Vanished(1.5, 0)]).reached is False


def test_the_study_is_in_the_catalogue():
    assert callable(find(BENCHMARKS, "capture").load())


@pytest.mark.slow
def test_a_short_run_loses_nothing_and_a_kill_at_most_a_frame():
    run = long_run(30.0, 2.0, preview=False)
    assert all(k.frames > 30 and not k.lost and not k.altered for k in run.kept)
    assert kills(Effort(), 1).unusable == 0
    assert vanish(signal.SIGKILL).closed_s < 1
