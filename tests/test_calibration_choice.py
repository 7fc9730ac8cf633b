"""Views chosen by information, and neighbouring views that err alike."""

from __future__ import annotations

import numpy as np
import pytest

from olivevib.calibration import CalibrationSettings, choice
from olivevib.calibration.calibrate import make_pair_checked
from olivevib.calibration.choice import choose, spread
from olivevib.calibration.joint import fit_joint, fit_single
from olivevib.calibration.uncertainty import alike_views, widen
from olivevib.studies.calibration import scenes

SETTINGS = CalibrationSettings(most_views=16)


@pytest.fixture(scope="module")
def pair():
    how = scenes.Waving(10.0, 10.0, lag_s=0.012)
    rig = scenes.converging("0.10/-0.20")
    left, right = scenes.waved(rig, how, np.random.default_rng(103))
    return make_pair_checked(left, right, (scenes.SIZE, scenes.SIZE), SETTINGS)


def told_by(pair):
    """What every view of the recording tells, as ``choose`` sees it."""
    few = spread(pair, choice.FIRST)
    return choice._Told.of(pair, fit_joint(few, SETTINGS, fit_single(few, SETTINGS)))


def test_chosen_views_tell_more_than_as_many_spread_in_time(pair):
    told, chosen = told_by(pair), choose(pair, SETTINGS)
    frames = [v.frame for v in pair.left.views]
    worth = {
        name: told.worth(told.prior + told.H[at].sum(axis=0))
        for name, some in (("chosen", chosen.pair), ("spread", spread(pair, 16)))
        for at in [np.array([frames.index(v.frame) for v in some.left.views])]
    }
    assert worth["chosen"] < worth["spread"] - 0.3  # 0.3: a sigma of depth 15 % lower
    assert chosen.all_mm < chosen.sigma_mm < 5
    assert "16 of " in chosen.words and "depth error" in chosen.words


def test_the_choice_is_bounded_and_always_the_same(pair):
    one, two = choose(pair, SETTINGS), choose(pair, SETTINGS)
    frames = [v.frame for v in one.pair.left.views]
    assert frames == [v.frame for v in two.pair.left.views] and one.words == two.words
    assert len(frames) <= 16 + 8 and frames == sorted(frames)
    t = np.array([v.t_s for v in one.pair.left.views])
    assert np.diff(t).min() > 0.09  # never the same picture twice
    assert one.pair.left.track_views == pair.left.track_views  # the tracks keep all


def test_few_views_are_all_used(pair):
    chosen = choose(pair, CalibrationSettings())
    assert chosen.pair is pair and chosen.words == ""


def walk(rng, count, p, rho):
    """Gradients (V, p) of unit variance whose neighbours correlate by ``rho``."""
    out = np.zeros((count, p))
    out[0] = rng.normal(size=p)
    for k in range(1, count):
        out[k] = rho * out[k - 1] + np.sqrt(1 - rho**2) * rng.normal(size=p)
    return out


@pytest.mark.parametrize(("rho", "true"), [(0.0, 1.0), (0.6, 4.0), (0.8, 9.0)])
def test_neighbours_that_err_alike_count_as_one(rho, true):
    """The variance of a sum of correlated gradients is (1 + rho) / (1 - rho) times as large."""
    rng, p, count = np.random.default_rng(7), 8, 120
    H = np.tile(np.eye(p), (count, 1, 1))
    model = np.eye(p) / count
    ratios, sizes = [], []
    for _ in range(40):
        g = walk(rng, count, p, rho)
        g -= g.mean(axis=0)  # where the fit stands, the gradients sum to nothing
        sizes.append(alike_views(model, H, g))
        ratios.append(np.trace(widen(model, H, g, np.zeros((p, p)), sizes[-1])) / np.trace(model))
    assert 0.7 * true < np.mean(ratios) < 1.5 * true
    assert (np.mean(sizes) < 1.5) if rho == 0 else (np.mean(sizes) > 4)


def test_the_lag_is_not_widened_by_the_scatter_of_the_lenses():
    rng, p, count = np.random.default_rng(3), 6, 40
    H = np.tile(np.eye(p), (count, 1, 1))
    g = rng.normal(size=(count, p)) * np.array([1, 4, 4, 4, 4, 4.0])
    model = np.eye(p) / count
    wide = widen(model, H, g, np.zeros((p, p)), 1, 0) * count
    assert wide[0, 0] < 2.5 and np.diag(wide)[1:].min() > 6
