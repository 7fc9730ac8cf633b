"""The calibration's studies at a tiny share: what they measure is what they say."""

from __future__ import annotations

import numpy as np
import pytest

from olivevib.studies import Effort
from olivevib.studies.calibration import faults, honesty, lens_alone, paper_table, scenes


def views(noise=0.1, count=8, seed=1):
    lens = scenes.camera(990.0, 0.1, -0.2, (645.0, 352.0))
    return scenes.tilted(lens, scenes.grid(), count, noise, np.random.default_rng(seed)), lens


def test_three_ways_to_one_lens():
    seen = views(0.02)[0]
    assert lens_alone.ours(seen, scenes.SIZE)[0] == pytest.approx(990, abs=3)
    assert lens_alone.opencv(seen, scenes.SIZE)[0] == pytest.approx(990, abs=3)
    assert np.isfinite(lens_alone.closed(seen, scenes.SIZE)[0])
    assert np.isnan(lens_alone.closed(seen[:2], scenes.SIZE)).all()


def test_the_bound_grows_with_the_noise():
    one, two = (honesty.information_bound(views(noise)[0]) for noise in (0.1, 0.2))
    assert 1.5 < two[0] / one[0] < 2.2 and 0.5 < one[0] < 8


def test_scatter_and_failures_of_sets():
    found = np.full((3, 6, 4), 900.0)
    found[:, ::2, 0] = 910.0
    found[0, 0] = np.nan
    assert paper_table.failures(found, 1280) == 1
    assert paper_table.scatter(found)[0] == pytest.approx(np.std([910, 900] * 3, ddof=1))
    assert paper_table.robust_sd([1.0, 2.0, 3.0]) == pytest.approx(1.4826)


def test_waved_boards_are_late_as_told():
    rig = scenes.converging("none")
    _, late = scenes.waved(rig, scenes.Waving(2.0, 10.0, 0.0 + 1e-6, 0.1), np.random.default_rng(3))
    _, now = scenes.waved(rig, scenes.Waving(2.0, 10.0, 1e-6), np.random.default_rng(3))
    by_frame = {view.frame: view for view in now}
    moved = [view for view in late if view.frame - 1 in by_frame and view.ids.size == 25]
    before = by_frame[moved[3].frame - 1]
    assert before.ids.size < 25 or np.allclose(moved[3].px, before.px, atol=1e-3)


NAMES = ("turned by 90 degrees", "other resolution", "frame counts differ", "wrong square size",
         "cameras swapped", "all frontal")  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_seeded_faults_are_named(name):
    told = faults._faults()[name](Effort(0.1))
    assert told.named, told
