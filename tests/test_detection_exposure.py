"""What the exposure takes from an amplitude: the table, its limits, and one cell rendered anew."""

import numpy as np
import pytest

from olivevib.detection.exposure_gain import exposure_gain
from olivevib.studies import Effort
from olivevib.studies.exposure import run


@pytest.mark.parametrize("blur", [0.0, 0.04, 0.08, 0.13])
def test_the_fine_detector_keeps_the_mean_of_the_motion(blur):
    found = exposure_gain(25.0, blur / 25.0, 2.0)
    assert found is not None
    assert found.gain == pytest.approx(np.sinc(blur), abs=1.5e-3)
    assert found.sigma < 0.0015


def test_long_blur_depends_on_the_size_and_says_so():
    small, large = exposure_gain(25.0, 0.01, 0.5), exposure_gain(25.0, 0.01, 4.0)
    assert small and large
    assert large.gain > small.gain + 0.01
    assert large.sigma > 0.003
    assert exposure_gain(25.0, 0.01, 12.0).sigma > 2 * large.sigma


def test_beyond_the_table_there_is_no_amplitude():
    assert exposure_gain(25.0, 0.0101, 2.0) is None
    assert exposure_gain(22.0, 0.006, 2.0) is not None


def test_an_unmeasured_localiser_has_a_sigma_as_large_as_the_doubt():
    found = exposure_gain(25.0, 0.008, 2.0, "edges")
    assert found is not None
    low = float(np.sinc(0.2))
    assert found.gain - found.sigma == pytest.approx(low)
    assert found.gain + found.sigma == pytest.approx(1.0)


def test_rendered_again_the_table_holds():
    study = run(Effort(1 / 12), lambda *_: None)
    (table,) = study.tables
    for row in table.rows:
        assert row[3] == pytest.approx(row[5], abs=0.012)
    assert study.goals[1].reached
