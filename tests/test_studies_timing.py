"""What the timing benchmark makes of trials: draws outside the zones, goals from the outcomes."""

from math import nan

from olivevib.planning import Setup, outlook
from olivevib.studies import Effort, timing
from olivevib.studies.timing import LEAST_MM, Draw, Outcome, draw, kept, scene_of


def outcome(status="confirmed", wrong=False, amplitude=0.8) -> Outcome:
    errors = (amplitude, 0.01, 2.0, 0.02, 0.3, 12.0, 0.4)
    return Outcome(status, 0.001, wrong, *errors, 1.1, 9.0, 40.0, "why")


def test_trials_are_drawn_where_something_is_claimed_and_alike_at_any_effort():
    for k in range(30):
        one = draw(Effort(), k)
        assert one == draw(Effort(0.1), k)
        setup = Setup(readout_s=one.readout_ms * 1e-3, offset_s=one.offset_ms * 1e-3)
        assert outlook(setup, one.f_hz).zone is None
        assert one.amplitude_mm >= LEAST_MM[one.readout_ms] - 0.01
    scene = scene_of(draw(Effort(), 1))
    assert 8e-3 <= scene.cameras.right.offset_s <= 13e-3


def test_a_measured_cell_is_not_measured_again(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    one = Draw(1, 25.0, 20, 9.0, 3.0, 2.0)
    calls = []

    def measured(*_):
        calls.append(1)
        return Outcome("ambiguous", nan, False, *(nan,) * 8, 9.0, 40.0, "why")

    monkeypatch.setattr(timing, "measured", measured)
    first, second = kept(one, lambda *_: None), kept(one, lambda *_: None)
    assert calls == [1] and first.status == second.status and second.z_amplitude != 0
    kept(Draw(1, 25.5, 20, 9.0, 3.0, 2.0), lambda *_: None)
    assert len(calls) == 2


def test_goals_follow_the_outcomes():
    one = Draw(1, 25.0, 20, 9.0, 3.0, 2.0)
    good = timing._goals([(one, outcome())] * 60)
    assert [g.reached for g in good[:-1]] == [True] * (len(good) - 1)
    assert good[-1].reached is None  # nothing was blurred
    bad = timing._goals([(one, outcome())] * 59 + [(one, outcome(wrong=True, amplitude=9.0))])
    assert bad[0].reached is False
    few = timing._goals([(one, outcome())])
    assert few[0].reached is None
    assert timing._study([(one, outcome())]).tables[1].rows == (("confirmed", 1, 0),)
    assert good[3].measured.startswith("60 of 60")
