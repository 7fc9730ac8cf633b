"""The continuous-time fit on projected points with known truth: frequency, amplitude, verdict."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_motion_parts import anchor_of, scene

from olivevib.reconstruction.continuous import decided
from olivevib.reconstruction.motion import Anchor, MotionSettings, fit_motion
from olivevib.reconstruction.motion.decide import Facts, decide, zone
from olivevib.reconstruction.motion.evaluate import phase_of
from olivevib.reconstruction.motion.offset import Lines, with_offset
from olivevib.reconstruction.motion.prepared import candidate_frequencies, prepare
from olivevib.reconstruction.motion.spline import knots_over
from olivevib.reconstruction.motion.strays import stray_of
from olivevib.reconstruction.motion.types import BranchTable
from olivevib.reconstruction.motion.wander import Ridge
from olivevib.studies import blind
from olivevib.studies.blind_scenes import Scene, orbit, rig, sight
from olivevib.studies.study import Effort
from olivevib.vibration.types import LineStatus

CLAIMS = (LineStatus.CONFIRMED, LineStatus.SUPPORTED)
NEAR = MotionSettings(band_hz=(16.0, 44.0), band_declared=True)


def fitted(s, seed=0, settings=None, anchor=None):
    seen = sight(s, rig(), np.random.default_rng(seed))
    return seen, fit_motion(seen, rig(), anchor or anchor_of(s), settings)


def test_a_shaker_above_the_frame_rates_half_is_measured_and_confirmed():
    s = scene(25.3)
    seen, fit = fitted(s)
    assert fit.status is LineStatus.CONFIRMED, fit.reasons
    assert fit.kind == "steady"
    assert abs(fit.f_hz - 25.3) < 2e-3
    t = fit.timing
    offset = s.offset_s + seen.reference_row * (s.readout_s[1] - s.readout_s[0]) / 720
    assert abs(t.right_offset_s - offset) < 100e-6
    assert abs(t.left_row_time_s / (s.readout_s[0] / 720) - 1) < 0.03
    amplitude = np.hypot(fit.markers[0].cosine[0], fit.markers[0].sine[0])[:3]
    assert np.abs(amplitude - np.abs(s.amplitude[0, 0, :3]))[:2].max() < 0.03
    assert np.abs(amplitude - np.abs(s.amplitude[0, 0, :3]))[2] < 0.15
    assert 0.8 < fit.chi2 < 1.3
    assert "led" in fit.reasons[0]


def test_the_motion_between_frames_and_its_acceleration_come_out_within_their_sigma():
    s = scene(25.3)
    _, fit = fitted(s)
    at = np.linspace(0.4, 3.6, 700)
    motion = fit.evaluate(at)
    true = s.motion(0, at)[:, :3]
    error = motion.xyz_mm[:, 0] - true
    error -= error.mean(axis=0)  # the place is the mean pose's, not the motion's
    assert error[:, :2].std() < 0.03
    z = error / motion.sigma_xyz_mm[:, 0]
    assert 0.3 < np.sqrt(np.mean(z**2)) < 2.0
    e = 1e-4
    rate = (s.motion(0, at + e) - s.motion(0, at - e))[:, :3] / (2 * e)
    assert np.abs(motion.velocity_mm_s[:, 0] - rate)[:, :2].std() < 0.02 * np.abs(rate).max()
    bend = (s.motion(0, at + e) - 2 * s.motion(0, at) + s.motion(0, at - e))[:, :3] / e**2 * 1e-3
    difference = motion.acceleration_m_s2[:, 0] - bend
    assert difference[:, :2].std() < 0.02 * np.abs(bend).max()
    assert np.isnan(fit.evaluate(np.array([-1.0])).xyz_mm).all()


@pytest.mark.parametrize("case", ["global", "unknown"])
def test_nothing_is_claimed_with_nothing_to_tell_by(case):
    if case == "global":
        s = scene(readout_s=(0.0, 0.0), offset_s=0.0, drift=0.0, drops=0.0)
        anchor = Anchor(0.0, 0.0, 0.0, 0.0, "global", 0.0, 2e-5, 0.0, "calibration", True, 1e-6)
    else:
        s, anchor = scene(), Anchor(right_offset_s=0.009)
    _, fit = fitted(s, anchor=anchor, settings=NEAR)
    assert fit.status not in CLAIMS, fit.reasons


def test_without_true_stamps_it_stays_aliased():
    s = scene()
    _, fit = fitted(s, anchor=replace(anchor_of(s), stamps_true=False), settings=NEAR)
    assert fit.status is LineStatus.ALIASED


def test_a_line_at_the_frame_rate_is_blind_in_step():
    s = scene(29.4, offset_s=0.0, drift=0.0)
    _, fit = fitted(s, settings=NEAR)
    assert fit.status in (LineStatus.BLIND, LineStatus.NONE), fit.reasons


def test_sigma_agrees_with_repeated_noise():
    s = scene(23.7, mm=1.5)
    z = []
    for seed in range(8):
        seen, fit = fitted(s, seed, NEAR)
        assert abs(fit.f_hz - 23.7) < 0.05
        t = fit.timing
        offset = s.offset_s + seen.reference_row * (s.readout_s[1] - s.readout_s[0]) / 720
        got = np.hypot(fit.markers[0].cosine[0], fit.markers[0].sine[0])
        sigma = fit.markers[0].amplitude_sigma()[0]
        z += [
            (t.frequency_hz - 23.7) / t.sigma("frequency_hz"),
            (t.right_offset_s - offset) / t.sigma("right_offset_s"),
            *((got - np.abs(s.amplitude[0, 0])) / sigma)[:3],
        ]
    assert 0.6 < np.sqrt(np.mean(np.square(z))) < 1.5


def test_a_wandering_speed_is_followed():
    s = scene(21.3, kind="wandering", span_s=4.0)
    _, fit = fitted(s, settings=NEAR)
    assert fit.kind == "wandering"
    assert abs(fit.f_hz - 21.3) < 0.05
    at = np.linspace(0.4, 3.6, 200)
    e = 1e-4
    true = (s.phase(at + e) - s.phase(at - e)) / (4 * np.pi * e)
    found = phase_of(fit, at - fit.shift_s)[1] / (2 * np.pi)
    assert np.std(found - true) < 0.02
    assert fit.chi2 < 1.4


def test_a_small_line_that_wanders_is_not_confirmed_at_one_of_its_sides():
    """Too small for its wandering to be followed: the line beside it says that it is not steady."""
    s = scene(14.85, mm=0.4, kind="wandering", span_s=4.5)
    _, fit = fitted(s)
    assert fit.status is not LineStatus.CONFIRMED
    _, still = fitted(replace(s, kind="steady"))
    assert still.status is LineStatus.CONFIRMED


@dataclass(frozen=True)
class SpinningUp(Scene):
    """A speed that rises all the time, by hz_s."""

    hz_s: float = 2.0

    def phase(self, t_s):
        return 2 * np.pi * (self.f_hz * t_s + self.hz_s / 2 * (t_s - self.span_s / 2) ** 2)


def spinning_up(hz_s):
    s = scene(21.0)
    return SpinningUp(**{f.name: getattr(s, f.name) for f in fields(s)}, hz_s=hz_s)


def test_a_speed_that_rises_evenly_is_followed():
    s = spinning_up(2.0)
    _, fit = fitted(s)
    assert fit.kind == "wandering"
    assert abs(fit.f_hz - 21.0) < 0.05
    at = np.linspace(0.4, 3.6, 200)
    found = phase_of(fit, at - fit.shift_s)[1] / (2 * np.pi)
    assert np.std(found - (21.0 + 2.0 * (at - 2.0))) < 0.02


@pytest.mark.parametrize("hz_s", [6.0, 12.0])
def test_a_speed_that_rises_too_fast_is_not_claimed(hz_s):
    _, fit = fitted(spinning_up(hz_s))
    assert fit.status is LineStatus.CHIRP
    assert "Hz a second" in fit.reasons[0]


def test_free_motion_claims_no_frequency():
    draws = np.random.default_rng(2)
    s = scene(mm=1e-6, sway=((1.3, orbit(draws, 6.0, 0.01)), (3.9, orbit(draws, 1.0, 0.002))))
    _, fit = fitted(s, settings=MotionSettings(periodic=False))
    assert fit.kind == "free"
    assert fit.status is LineStatus.NONE
    at = np.linspace(0.3, 3.7, 200)
    error = fit.evaluate(at).xyz_mm[:, 0] - s.motion(0, at)[:, :3]
    error -= error.mean(axis=0)
    assert error[:, :2].std() < 0.06
    assert error[:, 2].std() < 0.4


def test_the_study_counts_verdicts_against_truth(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    study = blind.run(Effort(share=0.0004, seed=3))
    assert sum(row[1] for row in study.tables[0].rows) == 4
    wrong = next(g for g in study.goals if g.quantity == "wrong branch among confirmed")
    assert wrong.measured.startswith("0 of")
    assert wrong.reached is None  # too few to claim


def test_an_offset_of_many_milliseconds_is_found_from_sway_and_line():
    s = scene(25.3, offset_s=-0.118)
    anchor = replace(anchor_of(s), right_offset_s=0.0, right_offset_sigma_s=np.inf)
    seen, fit = fitted(s, anchor=anchor)
    offset = s.offset_s + seen.reference_row * (s.readout_s[1] - s.readout_s[0]) / 720
    assert fit.status is LineStatus.CONFIRMED
    assert abs(fit.f_hz - 25.3) < 5e-3
    assert abs(fit.timing.right_offset_s - offset) < 150e-6
    assert not fit.timing.offset_slip


def test_a_gain_of_the_blur_scales_amplitudes_and_widens_their_sigma():
    s = scene(23.7)
    seen = sight(s, rig(), np.random.default_rng(0))
    markers = []
    for m in seen.markers:
        sides = [replace(v, exposure_s=np.full(v.frame.size, 5e-3)) for v in (m.left, m.right)]
        markers.append(replace(m, left=sides[0], right=sides[1]))
    blurred = replace(seen, markers=tuple(markers))
    known = replace(NEAR, gain=lambda f, e, px: (0.9, 0.02))
    plain = fit_motion(seen, rig(), anchor_of(s), NEAR)
    corrected = fit_motion(blurred, rig(), anchor_of(s), known)
    size = [np.hypot(f.markers[0].cosine[0], f.markers[0].sine[0])[0] for f in (plain, corrected)]
    assert size[1] / size[0] == pytest.approx(1 / 0.9, rel=2e-3)
    sigma = corrected.markers[0].amplitude_sigma()[0, 0]
    assert sigma == pytest.approx(size[1] * 0.02 / 0.9, rel=0.2)
    refused = fit_motion(blurred, rig(), anchor_of(s), NEAR)
    assert "exposure" in refused.amplitude_refused
    assert refused.status is LineStatus.CONFIRMED


def test_frames_too_far_apart_for_any_knots_are_refused_in_words(monkeypatch):
    monkeypatch.setattr("olivevib.reconstruction.motion.pixels.SPACINGS_S", ())
    with pytest.raises(ValueError, match="too few for a fit"):
        fitted(scene(25.3))


def test_an_unknown_offset_slips_by_no_period_and_hides_no_double():
    """52 ms apart and told nothing: a nearly pure tone is not taken for half its frequency."""
    s = scene(15.717, mm=1.0, offset_s=-0.0524, kind="steady", span_s=4.5)
    s = replace(s, amplitude=s.amplitude * np.array([1.0, 0.1])[None, :, None])
    anchor = replace(anchor_of(s), right_offset_s=0.0, right_offset_sigma_s=np.inf)
    seen, fit = fitted(s, anchor=anchor)
    assert abs(fit.f_hz - 15.717) < 5e-3
    offset = s.offset_s + seen.reference_row * (s.readout_s[1] - s.readout_s[0]) / 720
    assert abs(fit.timing.right_offset_s - offset) < 5 * fit.timing.sigma("right_offset_s")
    assert not fit.timing.offset_slip


def test_a_second_harmonic_that_looks_like_sway_does_not_hide_the_offset():
    """44.757 Hz at 30 frames/s: its second harmonic appears at 0.49 Hz, among the sway."""
    s = scene(44.757, offset_s=-0.0095, span_s=4.5)
    anchor = replace(anchor_of(s), right_offset_s=0.0, right_offset_sigma_s=np.inf)
    seen = sight(s, rig(), np.random.default_rng(0))
    pixels = prepare(seen, rig(), anchor, MotionSettings()).pixels
    near, clear = with_offset(seen, rig(), anchor, MotionSettings(), pixels)
    at_rows = s.offset_s + seen.reference_row * (s.readout_s[1] - s.readout_s[0]) / 720
    assert clear
    assert abs(near.right_offset_s - at_rows) < 2 * near.right_offset_sigma_s
    assert Lines.of(pixels.peaks_hz[0], 30.0).slow_hz == pytest.approx((0.486,), abs=0.01)


def test_an_offset_that_was_searched_in_vain_confirms_nothing():
    _, fit = fitted(scene(25.3))
    facts = Facts(fit.branches, 30.0, 4.0, 0.009, 0.3, 1.0, 1.0, 99.0, np.ones(3), np.zeros(3))
    two, flat = np.array([25.3, 4.7]), np.ones(2)
    near = BranchTable(two, np.array([0.0, -3900.0]), np.array([1.0, 0.0]), 9e-3 * flat, flat)
    lost = replace(facts, table=near, offset_lost=True)
    decision = decide(lost, fit.anchor, MotionSettings())
    assert decision.status is LineStatus.SUPPORTED
    assert "out of step" in decision.reasons[0]
    far = replace(near, evidence=np.array([0.0, -5100.0]))
    sure = decide(replace(lost, table=far), fit.anchor, MotionSettings())
    assert sure.status is LineStatus.CONFIRMED
    assert decide(facts, fit.anchor, MotionSettings()).status is LineStatus.CONFIRMED


@pytest.mark.parametrize(
    ("doubt", "word"),
    [
        ({"chi2": 1.2}, "not quite of this kind"),
        ({"fast_hz_s": 9.4}, "its speed seems to change"),
        ({"row_sigmas": 6.0}, "6.0 sigma from those that were told"),
    ],
)
def test_what_the_wrong_ones_of_3150_blind_trials_had_confirms_nothing(doubt, word):
    _, fit = fitted(scene(25.3))
    facts = Facts(fit.branches, 30.0, 4.0, 0.009, 0.3, 1.0, 1.0, 99.0, np.ones(3), np.zeros(3))
    assert decide(facts, fit.anchor, MotionSettings()).status is LineStatus.CONFIRMED
    decision = decide(replace(facts, **doubt), fit.anchor, MotionSettings())
    assert decision.status is LineStatus.SUPPORTED
    assert word in decision.reasons[0]


def test_a_fit_about_which_the_pictures_scatter_far_more_than_noise_stands_for_no_record():
    """As where rest and start-up of a short recording are taken for the steady part."""
    _, fit = fitted(scene(11.3))
    assert decided(fit)
    assert not decided(replace(fit, noise_scale=120.0))


def test_two_kinds_of_candidates_that_nearly_coincide_are_both_tried():
    """10.02 Hz: its own line and its second harmonic's mirror appear 0.07 Hz apart."""
    s = scene(10.0227, mm=2.0, offset_s=0.0082, kind="steady", span_s=4.5)
    s = replace(s, amplitude=s.amplitude * np.array([1.0, 0.1])[None, :, None])
    seen = sight(s, rig(), np.random.default_rng(1))
    ready = prepare(seen, rig(), anchor_of(s), MotionSettings())
    apart = np.abs(candidate_frequencies(ready) - s.f_hz)
    assert apart.min() < 2e-3
    assert np.sort(apart)[1] < 0.05
    fit = fit_motion(seen, rig(), anchor_of(s))
    assert fit.status is LineStatus.CONFIRMED
    assert abs(fit.f_hz - s.f_hz) < 5e-3


def test_where_harmonics_look_alike_a_larger_lead_is_asked():
    _, fit = fitted(scene(25.3))
    facts = Facts(fit.branches, 30.0, 4.0, 0.009, 0.3, 1.0, 1.0, 99.0, np.ones(3), np.zeros(3))
    two, lead = np.array([20.05, 10.05]), np.array([0.0, -60.0])
    near = BranchTable(two, lead, np.array([1.0, 0.0]), np.full(2, 9e-3), np.ones(2))
    decision = decide(replace(facts, table=near), fit.anchor, MotionSettings())
    assert decision.status is LineStatus.SUPPORTED
    assert "looks like its second harmonic" in decision.reasons[0]
    away = replace(near, f_hz=np.array([21.05, 8.95]))
    assert decide(replace(facts, table=away), fit.anchor, MotionSettings()).status is (
        LineStatus.CONFIRMED
    )


def test_a_wandering_speed_that_is_not_that_of_the_pictures_is_told():
    """Across a fold either way on is as good; far from what a second shows it is not the speed."""
    knots = knots_over(0.0, 4.5, 0.5)
    t = np.linspace(0.0, 4.5, 300)
    ridge = Ridge(np.arange(0.5, 4.1, 0.25), np.full(15, 5.0))
    _, fit = fitted(scene(25.3))

    def told(f_hz: float, bend_hz: float) -> str:
        bend = np.linalg.lstsq(knots.matrix(t, 1), 2 * np.pi * bend_hz * np.sin(t), rcond=None)[0]
        branch = SimpleNamespace(theta=np.concatenate([[f_hz, 0, 0, 0, 0], bend]))
        return stray_of(SimpleNamespace(psi=knots), branch, ridge, (0.0, 4.5), 30.0)

    assert told(25.0, 0.3) == ""
    assert told(35.0, 0.3) == ""
    assert "leaves that of the pictures by 0.8 Hz" in told(25.0, 0.8)
    assert "mirror image" in told(29.9, 0.3)
    facts = Facts(fit.branches, 30.0, 4.0, 0.009, 0.3, 1.0, 1.0, 99.0, np.ones(3), np.zeros(3))
    decision = decide(replace(facts, stray="it strays"), fit.anchor, MotionSettings())
    assert decision.status is LineStatus.SUPPORTED
    assert "it strays" in decision.reasons[0]


def test_an_offset_is_not_clear_where_the_slow_curves_never_agree():
    """At 30.85 Hz the line itself looks like sway, and each camera sees it at other times."""
    s = scene(30.847, mm=2.0, offset_s=0.0105, kind="steady", span_s=5.0)
    anchor = replace(anchor_of(s), right_offset_s=0.0, right_offset_sigma_s=np.inf)
    seen = sight(s, rig(), np.random.default_rng(0))
    pixels = prepare(seen, rig(), anchor, MotionSettings()).pixels
    near, clear = with_offset(seen, rig(), anchor, MotionSettings(), pixels)
    assert not clear
    assert near.right_offset_s == 0.0


def test_slow_motion_that_no_knots_follow_is_no_line_near_the_frame_rate():
    _, fit = fitted(scene(25.3))
    facts = Facts(fit.branches, 30.0, 4.0, 0.0, 0.3, 1.0, 1.0, 99.0, np.ones(3), np.zeros(3))
    assert zone(31.64, facts) == "slow sway"
    assert zone(33.28, facts) == ""
    assert zone(31.64, replace(facts, offset_s=0.010)) == ""


def test_an_offset_that_the_fit_found_itself_is_no_anchor():
    _, fit = fitted(scene(25.3))
    facts = Facts(fit.branches, 30.0, 4.0, 0.009, 0.3, 1.0, 1.0, 99.0, np.ones(3), np.zeros(3))
    found = Anchor(right_offset_s=0.009, right_offset_sigma_s=4e-3, offset_source="unknown")
    assert decide(facts, found, MotionSettings()).status is LineStatus.AMBIGUOUS
    told = replace(found, offset_source="calibration")
    assert decide(facts, told, MotionSettings()).status is LineStatus.CONFIRMED
