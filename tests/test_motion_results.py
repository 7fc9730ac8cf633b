"""The continuous-time fit through the files, the trajectory and the lines."""

from dataclasses import replace
from math import inf, nan

import numpy as np
import pytest

from olivevib.files.store import StageFile
from olivevib.pipeline.fitted import with_lines
from olivevib.pipeline.row_time import BoardRowTime
from olivevib.reconstruction.continuous import decided, stored_fit, trajectory_of
from olivevib.reconstruction.motion import (
    Anchor,
    BranchTable,
    MarkerMotion,
    Motion,
    MotionFit,
    Timing,
)
from olivevib.reconstruction.trajectory import Trajectory
from olivevib.signals import Samples, State
from olivevib.trial.camera_book import BOARD, CameraMode, Entry
from olivevib.trial.records.motion import motion_columns, motion_from, motion_text
from olivevib.trial.records.tracks import CameraRecord, StoredTracks, tracks_file, tracks_from
from olivevib.trial.stages import Fingerprint
from olivevib.vibration import LineStatus, SamplingFacts, analyse

F_HZ, KNOTS, H = 25.0, 12, 2
ORBIT = np.array([3.0, 0.5, 1.0, 0.002, 0.0, 0.0])


def marker(number: int) -> MarkerMotion:
    size = 6 * KNOTS + 12 * H + 5
    covariance = np.diag(np.full(size, 0.01**2))
    cosine, sine = np.zeros((H, 6)), np.zeros((H, 6))
    cosine[0], sine[0, :3], cosine[1] = ORBIT, [0.0, 1.2, 0.0], 0.1 * ORBIT
    sway = np.zeros((KNOTS, 6))
    place = np.array([10.0 * number, 0, 1400])
    return MarkerMotion(
        number, np.eye(3), place, sway, cosine, sine, covariance, (False, True), 0.97
    )


def fit(status: LineStatus = LineStatus.CONFIRMED, **more) -> MotionFit:
    f = np.array([25.0, 5.0, 35.0])
    table = BranchTable(
        f, -10.0 * np.arange(3), np.array([0.6, 0.4, 1e-9]), np.zeros(3), np.ones(3)
    )
    covariance = np.diag([1e-6, 1e-10, 1e-12, 1e-16, 1e-16])
    told = {
        "kind": "steady",
        "markers": (marker(3), marker(7)),
        "timing": Timing(F_HZ, 0.009, 1e-5, 2.78e-5, 2.69e-5, 360.0, covariance),
        "branches": table,
        "status": status,
        "reasons": ("25.00 Hz given the row time.",),
        "next_time": ("Record so.",),
        "anchor": Anchor(right_offset_sigma_s=inf),
        "noise_scale": 1.1,
        "noise_source": "misfit",
        "chi2": 1.02,
        "first_knot_s": -0.5,
        "knot_s": 0.15,
        "start_s": 1.0,
        "end_s": 3.0,
        "shift_s": 0.01,
    }
    return MotionFit(**(told | more))


def wave(t: np.ndarray) -> np.ndarray:
    w = 2 * np.pi * F_HZ * (t - 2.01)
    first = np.cos(w)[:, None] * ORBIT[:3] + np.sin(w)[:, None] * np.array([0, 1.2, 0])
    return first + np.cos(2 * w)[:, None] * 0.1 * ORBIT[:3]


def evaluated(one: MotionFit, t: np.ndarray) -> Motion:
    n, m = t.size, len(one.markers)
    xyz = np.stack([p.t0_mm + wave(t) for p in one.markers], axis=1)
    some, sigma = np.zeros((n, m, 3)), np.full((n, m, 3), 0.02)
    ids = np.array([p.id for p in one.markers])
    return Motion(t, ids, xyz, some, sigma, sigma, some, some, sigma)


@pytest.fixture
def frames() -> Trajectory:
    """30 frames/s from 0 to 4 s; marker 3 hidden from 1.5 to 1.8 s, marker 9 never fitted."""
    t, ids = np.arange(121) / 30, np.array([3, 7, 9])
    xyz = np.stack([np.array([10.0 * i, 0, 1400]) + wave(t) for i in ids], axis=1)
    state = np.zeros((121, 3), np.int64)
    gap = (t > 1.5) & (t < 1.8)
    xyz[gap, 0], state[gap, 0] = np.nan, int(State.HIDDEN)
    sigma = np.full((121, 3, 3), 0.05)
    return Trajectory(
        t_s=t,
        ids=ids,
        sample_t_s=t[:, None] + np.array([0.002, 0.004, 0.019]),
        xyz_mm=xyz,
        sigma_xyz_mm=sigma,
        covariance_mm2=np.einsum("nmi,ij->nmij", sigma**2, np.eye(3)),
        rotation_rad=np.zeros((121, 3, 3)),
        sigma_rotation_rad=sigma,
        state=state,
        epipolar_px=np.zeros((121, 3)),
        frame="left camera",
        method="optimal",
    )


@pytest.fixture(autouse=True)
def analytic(monkeypatch):
    """The model's values by formula: what is tested here is what is made of them."""
    monkeypatch.setattr(MotionFit, "evaluate", evaluated)


def test_the_fit_survives_the_file_to_the_last_bit():
    one = replace(fit(), psi=np.arange(4.0), growth=0.1, amplitude_refused="too long")
    file = StageFile("reconstruct", 2, {}, {}, motion_columns(one), {"motion": motion_text(one)})
    back = motion_from(file)
    assert back is not None
    assert motion_text(back) == motion_text(one)
    assert back.anchor.right_offset_sigma_s == inf and np.isnan(back.timing.row_time_keeps[0])
    for name in ("sway", "cosine", "sine", "covariance", "R0", "t0_mm", "blind"):
        for a, b in zip(one.markers, back.markers, strict=True):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    np.testing.assert_array_equal(back.branches.evidence, one.branches.evidence)
    np.testing.assert_array_equal(back.psi, one.psi)
    empty = replace(one, markers=(), status=LineStatus.NONE)
    file = replace(file, variables=motion_columns(empty), attributes={"motion": motion_text(empty)})
    assert motion_from(file).markers == ()


def test_a_fine_grid_inside_frames_outside_gaps_stay_gaps(frames):
    path = trajectory_of(fit(), frames)
    inside = (path.t_s >= 1.01) & (path.t_s <= 3.01)
    np.testing.assert_allclose(np.diff(path.t_s[inside]), 1 / 240, atol=1e-9)
    assert (np.diff(path.t_s) > 0).all()
    for k in (3, 7, 9):
        assert path.samples(k).t_s.size  # every marker's own times increase
    seen = path.seen
    hidden = inside & (path.t_s > 1.53) & (path.t_s < 1.78)
    assert not seen[hidden, 0].any() and seen[hidden, 1].all()
    assert (path.state[hidden, 0] == State.HIDDEN).all()
    here = inside & seen[:, 0]
    np.testing.assert_allclose(path.xyz_mm[here, 0], np.array([30, 0, 1400]) + wave(path.t_s[here]))
    assert seen[:, 2].sum() == 121  # its own samples, all of them, no more
    assert set(path.state[~inside & seen[:, 1], 1]) == {int(State.FLAGGED)}
    own = path.sample_t_s[seen[:, 2], 2]
    assert np.isin(np.round(own, 9), np.round(frames.sample_t_s[:, 2], 9)).all()
    assert path.method == "continuous" and {f.id for f in path.fits} == {3, 7}


def test_stored_fit_keeps_frequency_first_in_its_covariance():
    one = fit()
    kept = stored_fit(one, one.markers[0])
    assert kept.covariance.shape == (1 + 12 * H, 1 + 12 * H)
    assert kept.sway.shape == (6, KNOTS) and kept.t_ref_s == pytest.approx(2.01)


def analysed(one: MotionFit, fine: bool):
    t = np.arange(1.02, 3.0, 1 / 240 if fine else 1 / 30)
    motion = {m.id: Samples(t, wave(t), "displacement", "mm", ("x", "y", "z")) for m in one.markers}
    facts = SamplingFacts(240.0 if fine else 30.0, stamps_true=True)
    return with_lines(analyse(motion, facts), one)


def test_lines_take_frequency_amplitude_and_acceleration_from_the_fit():
    result = analysed(fit(), fine=True)
    row = result.row(3)
    assert row is not None
    line = row.line
    assert (line.status, line.f_hz, line.candidates_hz) == ("confirmed", 25.0, (25.0,))
    np.testing.assert_allclose(line.amplitude, [3.0, np.hypot(0.5, 1.2), 1.0])
    np.testing.assert_allclose(line.amplitude_sigma, 0.01)
    assert np.isnan(line.harmonics[0]).all()  # blind
    turn = 2 * np.pi * 25.0 * (2.3 - line.t_ref_s) + line.phase_rad
    first = ORBIT[:3] * np.cos(2 * np.pi * 25 * 0.29) + np.array([0, 1.2, 0]) * np.sin(
        2 * np.pi * 25 * 0.29
    )
    np.testing.assert_allclose(line.amplitude * np.cos(turn), first, atol=1e-9)
    true = (2 * np.pi * 25) ** 2 * 3e-3
    assert row.acceleration.line_amplitude[0] == pytest.approx(true, rel=1e-9)
    wanted = np.sqrt(np.sum(wave_acceleration() ** 2, axis=1).mean())
    assert row.acceleration_rms_m_s2 == pytest.approx(wanted, rel=0.02)
    assert not result.cautions or all(c.code != "frequency-undecided" for c in result.cautions)


def wave_acceleration() -> np.ndarray:
    t = np.arange(1.02, 3.0, 1 / 2400)
    w, a = 2 * np.pi * F_HZ, 2 * np.pi * F_HZ * (t - 2.01)
    first = np.cos(a)[:, None] * ORBIT[:3] + np.sin(a)[:, None] * np.array([0, 1.2, 0])
    return -1e-3 * w**2 * (first + 4 * 0.1 * np.cos(2 * a)[:, None] * ORBIT[:3])


def test_an_open_frequency_lists_candidates_with_probabilities_and_no_acceleration():
    one = fit(LineStatus.AMBIGUOUS)
    assert not decided(one)
    result = analysed(one, fine=False)
    row = result.row(7)
    assert row is not None
    assert row.line.candidates_hz == (5.0, 25.0) and row.line.probabilities == (0.4, 0.6)
    assert np.isnan(row.acceleration_rms_m_s2)
    assert [c.f_hz for c in row.candidates] == [5.0, 25.0]
    assert row.candidates[1].acceleration_rms_m_s2 > 20 * row.candidates[0].acceleration_rms_m_s2
    assert "frequency-undecided" in {c.code for c in result.cautions}


def test_a_fit_without_a_frequency_leaves_the_lines_alone():
    one = fit(LineStatus.NONE)
    one = replace(one, kind="none", timing=replace(one.timing, frequency_hz=nan))
    t = np.arange(0, 3, 1 / 30)
    plain = analyse(
        {3: Samples(t, wave(t), "displacement", "mm", ("x", "y", "z"))}, SamplingFacts(30.0)
    )
    assert with_lines(plain, one) is plain
    assert not decided(one)


def test_a_fit_that_does_not_describe_the_pictures_decides_nothing():
    one = replace(fit(LineStatus.SUPPORTED), chi2=3624.0)
    assert not decided(one)
    row = analysed(one, fine=False).row(7)
    assert row is not None
    assert (row.line.status, row.line.probabilities) == ("ambiguous", ())
    assert row.line.candidates_hz == (5.0, 25.0)
    assert "misfit" in row.line.reasons[0]


def test_tracks_keep_the_clock_fit_of_every_frame():
    stamps = np.array([0.0, 0.0331, nan, 0.1002])
    camera = CameraRecord(
        *("left.nut", "mjpeg", (64, 48), 3, 1, 0, "container", "line"),
        *(30.0, 0.01, 1e-4, 2e-4, 2.8e-5, 5e-7, "led"),
    )
    fitted = np.arange(4) / 30
    both = {"left": camera, "right": camera}
    stored = StoredTracks(
        *((), (), both, dict.fromkeys(both, stamps), (), "template", ()),
        fitted_s=dict.fromkeys(both, fitted),
    )
    back = tracks_from(tracks_file(stored, Fingerprint({}, {})))
    np.testing.assert_array_equal(back.fitted_s["right"], fitted)
    np.testing.assert_array_equal(back.stamp_s["left"], stamps)
    assert back.cameras["left"].row_time_source == "led"


def test_a_waved_board_tells_row_times_and_the_book_keeps_their_source():
    entry = Entry(CameraMode("S1", (1280, 720), 30.0), 27.8, 0.3, f"{BOARD} of T04")
    told = BoardRowTime("left", entry)
    assert "readout 20.02 ms" in told.words and entry.kind == "board"
    assert replace(entry, source="lamp at 500 Hz, 13.5 stripes").kind == "led"
