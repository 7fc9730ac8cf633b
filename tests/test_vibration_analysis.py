"""The door of the room: a whole trial in, phases, spectra and one row a marker and phase out."""

from __future__ import annotations

import numpy as np
import pytest

from olivevib.progress import Cancelled
from olivevib.signals import Samples
from olivevib.studies.vibration.records import (
    Shaker,
    Tone,
    acceleration,
    camera,
    displacement,
    truth,
)
from olivevib.vibration import (
    LineStatus,
    Phase,
    SamplingFacts,
    VibrationSettings,
    analyse,
)
from olivevib.vibration.windows import NAMES

SLOW = Shaker(f_hz=12.0, amplitude_mm=3.0)
DIRECT = SamplingFacts(30.0, stamps_true=True, band_hz=(5.0, 14.0), band_declared=True)
DEFAULT = SamplingFacts(30.0, stamps_true=True, row_time_known=True, row_time_s=2.8e-5)


def motion_of(shaker, markers=2, lost=0.0, seed=1):
    rng = np.random.default_rng(seed)
    t, path = truth(shaker, rng, rate_hz=4000.0)
    out = {}
    for marker in range(markers):
        times = np.arange(0, shaker.limits[-1], 1 / 30) + 1e-3 * marker
        times = times[rng.random(times.size) >= lost]
        out[7 + marker] = camera(t, path * (1 + marker), rng, times, 0.05, 0.0, shaker)
    return out, path


@pytest.fixture(scope="module")
def direct():
    return analyse(motion_of(SLOW)[0], DIRECT)


def test_the_demo_case_is_direct_and_right(direct):
    assert direct.spectrum_phase == "steady"
    for marker, factor in ((7, 1), (8, 2)):
        row = direct.row(marker)
        assert row.line.status is LineStatus.DIRECT
        assert row.line.f_hz == pytest.approx(12.0, abs=0.005)
        size = np.sqrt(np.sum(row.line.amplitude**2))
        assert size == pytest.approx(3.0 * factor * np.hypot(1, 0.5), rel=0.02)
        total = np.sqrt(np.sum(row.acceleration.line_amplitude**2))
        assert total == pytest.approx((2 * np.pi * 12) ** 2 * size * 1e-3, rel=1e-3)
        assert row.acceleration_rms_m_s2 == pytest.approx(total / np.sqrt(2), rel=0.15)
        assert row.displacement_pp_mm > 2 * 3.0 * factor
        assert len(row.candidates) == 1


def test_every_marker_has_a_row_in_every_phase(direct):
    names = [p.name for p in direct.phases]
    assert names[:3] == ["rest", "start-up", "steady"]
    assert [(r.id, r.phase) for r in direct.table] == [(m, n) for m in (7, 8) for n in names]
    assert direct.row(7, "rest").line.status in (LineStatus.NONE, LineStatus.CHIRP)
    assert direct.row(99) is None


def test_spectra_share_one_grid_up_to_half_the_rate(direct):
    for quantity, unit in (("displacement", "mm"), ("velocity", "mm/s"), ("acceleration", "m/s2")):
        s = direct.spectra[quantity]
        assert (s.quantity, s.unit, s.phase) == (quantity, unit, "steady")
        assert s.f_hz[0] == 0.0
        assert s.f_hz[-1] == pytest.approx(15.0, abs=s.resolution_hz)
        assert s.amplitude.shape == (s.f_hz.size, 2, 3)
        band = s.f_hz > 5.0  # below lies the sway
        peak = s.f_hz[band][int(np.argmax(s.amplitude[band, 0].sum(axis=1)))]
        assert peak == pytest.approx(12.0, abs=2 * s.resolution_hz)
    a = direct.spectra["acceleration"].lines[0]
    assert a.unit == "m/s2"
    np.testing.assert_allclose(a.amplitude, direct.row(7).acceleration.line_amplitude)


def test_without_a_declared_band_no_single_acceleration_is_given():
    result = analyse(motion_of(SLOW)[0], DEFAULT)
    row = result.row(7)
    assert row.line.status is LineStatus.AMBIGUOUS
    np.testing.assert_allclose(row.line.candidates_hz, [12.0, 18.0, 42.0], atol=0.01)
    assert np.isnan(row.acceleration_rms_m_s2)
    assert np.isnan(row.velocity.rms).all()
    assert np.isnan(result.spectra["acceleration"].amplitude).all()
    assert np.isfinite(row.displacement.rms).all()
    given = [c.acceleration_rms_m_s2 for c in row.candidates]
    np.testing.assert_allclose(
        np.array(given) / given[0], (np.array(row.line.candidates_hz) / 12.0) ** 2, rtol=2e-3
    )
    assert [c.code for c in result.cautions] == ["frequency-undecided"]


def test_a_supported_line_has_the_acceleration_of_its_candidate():
    facts = SamplingFacts(30.0, stamps_true=True, band_hz=(16.0, 28.0), band_declared=True)
    row = analyse(motion_of(Shaker(f_hz=25.0))[0], facts).row(7)
    assert row.line.status is LineStatus.SUPPORTED
    assert row.line.f_hz == pytest.approx(25.0, abs=0.01)
    size = 4e-3 * np.hypot(1, 0.5) * (2 * np.pi * 25) ** 2 / np.sqrt(2)
    assert row.acceleration_rms_m_s2 == pytest.approx(size, rel=0.15)


def test_lost_frames_change_little():
    whole, gappy = (
        analyse(motion_of(SLOW, markers=1, lost=lost)[0], DIRECT).row(7) for lost in (0.0, 0.15)
    )
    assert gappy.line.f_hz == pytest.approx(whole.line.f_hz, abs=0.005)
    np.testing.assert_allclose(gappy.line.amplitude, whole.line.amplitude, atol=0.06)
    assert gappy.acceleration_rms_m_s2 == pytest.approx(whole.acceleration_rms_m_s2, rel=0.03)


def test_phases_from_a_person_are_taken_as_they_are():
    motion, _ = motion_of(SLOW, markers=1)
    phases = (Phase("rest", 0.0, 1.0), Phase("steady", 3.5, 6.5))
    result = analyse(motion, DIRECT, phases=phases)
    assert result.phases == phases
    assert result.row(7).start_s == 3.5
    assert result.row(7).samples == pytest.approx(90, abs=1)


def test_printed_numbers_do_not_depend_on_window_segments_or_unit_of_time():
    """The scaling matrix: the line, its figures and total power move by less than 0.1 %.

    Whole cycles in the record, so that its plain RMS is the same at every rate.
    """
    rng = np.random.default_rng(2)
    tone = Tone(7.25, np.array([3.0, 1.0, 0.4]), np.array([0.0, 1.0, 2.0]))
    reference = None
    for rate in (30.0, 60.0, 240.0):
        t = np.arange(round(12 * rate)) / rate + rng.uniform(-5, 5)
        facts = SamplingFacts(rate, stamps_true=True, band_hz=(5.0, 14.0))
        for name in NAMES:
            for segments in (1, 3):
                settings = VibrationSettings(window=name, segments=segments)
                steady = (Phase("steady", t[0], t[-1]),)
                result = analyse({1: displacement(t, tone.at(t))}, facts, settings, steady)
                row, s = result.row(1), result.spectra["displacement"]
                numbers = np.concatenate(
                    [
                        row.line.amplitude,
                        [row.line.f_hz, row.acceleration_rms_m_s2, row.displacement.rms[0]],
                        np.sqrt(s.psd[:, 0].sum(axis=0) * s.resolution_hz),
                    ]
                )
                reference = numbers if reference is None else reference
                np.testing.assert_allclose(numbers, reference, rtol=1e-3)
    np.testing.assert_allclose(reference[:3], tone.amplitude, rtol=1e-4)


def test_a_marker_hardly_seen_keeps_its_rows_with_nan():
    motion, _ = motion_of(SLOW, markers=1)
    few = displacement(motion[7].t_s[100:104], motion[7].values[100:104])
    result = analyse(motion | {9: few}, DIRECT)
    row = result.row(9)
    assert row.line.status is LineStatus.NONE
    assert np.isnan(row.displacement.rms).all()
    assert np.isnan(result.spectra["displacement"].amplitude[:, 1]).all()


@pytest.mark.parametrize("motion", [{}, {1: displacement([], np.empty((0, 3)))}])
def test_nothing_seen_is_no_failure(motion):
    result = analyse(motion, DIRECT)
    assert len(result.table) == len(motion)
    assert result.spectra["displacement"].f_hz.size == 0
    assert "no-steady-phase" in [c.code for c in result.cautions]


def test_other_units_are_refused():
    with pytest.raises(ValueError, match="mm"):
        analyse({1: acceleration(np.arange(3.0), np.zeros((3, 3)))}, DIRECT)
    flat = Samples(np.arange(3.0), np.zeros((3, 1)), "displacement", "mm", ("x",))
    with pytest.raises(ValueError, match="three axes"):
        analyse({1: flat}, DIRECT)


def test_samples_that_were_not_measured_are_left_out():
    motion, _ = motion_of(SLOW, markers=1)
    values = motion[7].values.copy()
    values[50:60] = np.nan
    result = analyse({7: displacement(motion[7].t_s, values)}, DIRECT)
    assert result.row(7).line.f_hz == pytest.approx(12.0, abs=0.005)


def test_work_is_told_and_cancels():
    motion, _ = motion_of(SLOW)
    seen = []

    def tick(done, total, note):
        seen.append((done, total))
        if done == 3:
            raise Cancelled

    with pytest.raises(Cancelled):
        analyse(motion, DIRECT, tick=tick)
    assert [d for d, _ in seen] == [0, 1, 2, 3]


def test_twice_the_same_is_the_same_to_the_bit():
    motion, _ = motion_of(SLOW, markers=1)
    a, b = (analyse(motion, DEFAULT) for _ in range(2))
    for quantity in a.spectra:
        assert a.spectra[quantity].amplitude.tobytes() == b.spectra[quantity].amplitude.tobytes()
    assert repr(a.table) == repr(b.table)


@pytest.mark.parametrize(
    ("exposure_ms", "code"), [(2.0, None), (8.0, "exposure-blur"), (25.0, "exposure-too-long")]
)
def test_long_exposures_are_told(exposure_ms, code):
    motion, _ = motion_of(SLOW, markers=1)
    facts = SamplingFacts(
        30.0, stamps_true=True, band_hz=(5.0, 14.0), exposure_s=1e-3 * exposure_ms
    )
    assert [c.code for c in analyse(motion, facts).cautions] == ([code] if code else [])
