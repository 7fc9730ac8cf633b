"""rig.toml: readable, exact, and clear about every fault."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from olivevib.errors import InputError
from olivevib.files.rig_file import read_facts, read_rig, write_rig
from olivevib.geometry import CameraModel, StereoRig, rotation_from_vector


def camera(rng: np.random.Generator, *, covariance: bool = True) -> CameraModel:
    half = rng.normal(size=(6, 6))
    return CameraModel(
        size_px=(1280, 720),
        K=np.array([[950 + rng.normal(), 0, 640.1], [0, 951 + rng.normal(), 360.2], [0, 0, 1]]),
        distortion=np.array([*rng.normal(size=2), 1e-4, -2e-5, 0]),
        row_time_s=20e-3 / 720,
        row_time_sigma_s=rng.uniform() * 1e-6,
        row_time_source="led",
        covariance=half @ half.T if covariance else None,
    )


def rig(seed: int = 1, *, covariance: bool = True) -> StereoRig:
    rng = np.random.default_rng(seed)
    half = rng.normal(size=(18, 18)) * np.logspace(-8, 2, 18)[:, None]
    cov = half @ half.T
    return StereoRig(
        left=camera(rng, covariance=covariance),
        right=camera(rng, covariance=covariance),
        R_right_left=rotation_from_vector(rng.normal(0, 0.2, 3)),
        t_right_left_mm=rng.normal(0, 300, 3),
        covariance=(cov + cov.T) / 2 if covariance else None,
    )


def same_array(a: np.ndarray | None, b: np.ndarray | None) -> bool:
    if a is None or b is None:
        return a is b
    return a.tobytes() == b.tobytes()


def same(a: StereoRig, b: StereoRig) -> None:
    for x, y in ((a.left, b.left), (a.right, b.right)):
        assert x.size_px == y.size_px and x.row_time_source == y.row_time_source
        for name in ("K", "distortion", "covariance"):
            assert same_array(getattr(x, name), getattr(y, name)), name
        for name in ("row_time_s", "row_time_sigma_s"):
            assert same_array(np.array(getattr(x, name)), np.array(getattr(y, name))), name
    for name in ("R_right_left", "t_right_left_mm", "covariance"):
        assert same_array(getattr(a, name), getattr(b, name)), name


@pytest.mark.parametrize("covariance", [True, False])
def test_every_number_comes_back_bit_by_bit(tmp_path: Path, covariance: bool) -> None:
    for seed in range(20):
        made = rig(seed, covariance=covariance)
        write_rig(tmp_path / "rig.toml", made, {})
        same(made, read_rig(tmp_path / "rig.toml"))


@settings(deadline=None, max_examples=80)
@given(st.floats(-1e-3, 1e-3), st.floats(0, 1e-3), st.floats(1e-3, 1e6), st.floats(-1e9, 1e9))
def test_odd_numbers_come_back_too(
    tmp_path_factory: pytest.TempPathFactory, row: float, sigma: float, fx: float, tx: float
) -> None:
    path = tmp_path_factory.mktemp("r") / "rig.toml"
    plain = rig(covariance=False)
    K = plain.left.K.copy()
    K[0, 0], K[0, 1] = fx, sigma
    left = replace(plain.left, K=K, row_time_s=row, row_time_sigma_s=sigma)
    made = replace(plain, left=left, t_right_left_mm=np.array([tx, -0.0, 1e-300]))
    write_rig(path, made, {})
    same(made, read_rig(path))


def test_unknown_row_time_and_lopsided_covariance(tmp_path: Path) -> None:
    made = rig()
    left = replace(
        made.left, row_time_s=0.0, row_time_sigma_s=float("nan"), row_time_source="unknown"
    )
    cov = np.array(made.covariance)
    cov[2, 7] = np.nextafter(cov[2, 7], 1e9)
    made = replace(made, left=left, covariance=cov)
    write_rig(tmp_path / "rig.toml", made, {})
    same(made, read_rig(tmp_path / "rig.toml"))


def test_the_file_speaks_to_a_person(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    made = rig()
    facts = {"epipolar_rms_px": 0.31, "views": 40, "holdout_rms_mm": None, "board": 'char"uco\n'}
    write_rig(path, made, facts)
    text = path.read_text("utf-8")
    assert text.count("# px, sigma") == 8 and "# a raw sensor row" not in text
    assert "# holdout_rms_mm: not known" in text
    table = tomllib.loads(text)
    assert table["quality"] == {"epipolar_rms_px": 0.31, "views": 40, "board": 'char"uco\n'}
    left, right = made.projection_matrices()
    assert np.array_equal(table["projection"]["left"], left)
    assert np.array_equal(table["projection"]["right"], right)
    assert table["stereo"]["baseline_mm"] == pytest.approx(made.baseline_mm, abs=1e-3)
    assert table["left"]["row_time_us"] == pytest.approx(20e3 / 720)
    assert len(table["covariance"]["rig"]) == 18 and len(table["covariance"]["rig"][17]) == 1
    assert read_facts(path) == table["quality"]
    write_rig(tmp_path / "again.toml", read_rig(path), facts)
    assert (tmp_path / "again.toml").read_bytes() == path.read_bytes()


BY_HAND = """
[left]
size_px = [1280, 720]
fx = 950
fy = 950
cx = 640
cy = 360.5
k1 = -0.1

[right]
size_px = [1280, 720]
fx = 955.5
fy = 955.5
cx = 639
cy = 362

[stereo]
R_right_left = [[0.980, 0.0, -0.199], [0.0, 1.0, 0.0], [0.199, 0.0, 0.980]]
t_right_left_mm = [-420, 0, 40]
"""


def test_a_rig_written_by_hand(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    path.write_text(BY_HAND)
    got = read_rig(path)
    assert got.left.distortion.tolist() == [-0.1, 0, 0, 0, 0]
    assert got.left.row_time_source == "unknown" and np.isnan(got.left.row_time_sigma_s)
    assert got.covariance is None and got.baseline_mm == pytest.approx(421.9, abs=0.1)
    assert got.angle_deg == pytest.approx(11.48, abs=0.02)
    assert read_facts(path) == {}


def test_a_rotation_vector_instead_of_the_matrix(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    lines = [line for line in BY_HAND.splitlines() if not line.startswith("R_")]
    path.write_text("\n".join([*lines, "rotation_vector_deg = [0, -11.5, 0]"]))
    assert read_rig(path).angle_deg == pytest.approx(11.5)


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("fx = 950\n", "", "left.fx: is missing"),
        ("fx = 950\n", "fxx = 950\n", "left.fxx: unknown; did you mean fx?"),
        ("fx = 950\n", "fx = -950\n", "left.fx: must be positive"),
        ("fx = 950\n", 'fx = "950"\n', "left.fx: must be a number"),
        ("fx = 950\n", "fx = inf\n", "left.fx: must be a number"),
        ("fx = 950\n", "fx = true\n", "left.fx: must be a number"),
        ("[1280, 720]", "[1280.5, 720]", "left.size_px: must be"),
        ("[stereo]", "[steroe]", "steroe: unknown; did you mean stereo?"),
        ("[stereo]", "[steroe]", "stereo: the table [stereo] is missing"),
        ("[-420, 0, 40]", "[-420, 0]", "stereo.t_right_left_mm: must be 3 numbers"),
        ("0.0, -0.199]", "0.0]", "stereo.R_right_left: must be 3 rows of 3 numbers"),
        ("[0.980, 0.0", "[0.5, 0.0", "not a rotation"),
        ("k1 = -0.1", 'row_time_source = "guess"', "left.row_time_source: must be one of"),
        ("k1 = -0.1", "row_time_sigma_us = -1", "left.row_time_sigma_us: must not be negative"),
        ("[right]", "[covariance]\nleft = [[1]]\n[right]", "covariance.left: must be 6 rows"),
        ("[left]", "format = 9\n[left]", "format: 9 is not known here"),
        ("[left]", "quality = 3\n[left]", None),
    ],
)
def test_each_fault_names_its_key(tmp_path: Path, old: str, new: str, fault: str | None) -> None:
    path = tmp_path / "rig.toml"
    assert old in BY_HAND
    path.write_text(BY_HAND.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        read_rig(path)
    assert str(path) in caught.value.what
    assert (fault or "quality: must be a table") in str(caught.value)


def test_all_faults_at_once(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    text = BY_HAND.replace("fx = 950\n", "focal = 950\n").replace("cy = 362", "cy = []")
    path.write_text(text.replace("t_right_left_mm", "t_rightleft_mm"))
    with pytest.raises(InputError) as caught:
        read_rig(path)
    assert "5 faults" in caught.value.what
    for key in ("left.focal", "left.fx", "right.cy", "stereo.t_rightleft_mm", "t_right_left_mm"):
        assert key in caught.value.why


def test_no_toml_names_the_line(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    path.write_text("[left]\nfx = 950\nfy = = 3\n")
    with pytest.raises(InputError, match="line 3"):
        read_rig(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="no TOML"):
        read_rig(path)
    with pytest.raises(InputError, match="does not exist"):
        read_rig(tmp_path / "none.toml")


def test_skew_of_the_closed_form_comes_back(tmp_path: Path) -> None:
    made = rig()
    K = made.left.K.copy()
    K[0, 1] = -3.7281
    skewed = replace(made, left=replace(made.left, K=K))
    write_rig(tmp_path / "rig.toml", skewed, {})
    same(read_rig(tmp_path / "rig.toml"), skewed)
    assert tomllib.loads((tmp_path / "rig.toml").read_text())["left"]["skew"] == -3.7281


def test_what_cannot_be_written_is_refused(tmp_path: Path) -> None:
    made = rig()
    K = made.left.K.copy()
    K[2, 0] = 1e-3
    for left in (
        replace(made.left, K=K),
        replace(made.left, row_time_s=float("nan")),
        replace(made.left, row_time_source="guess"),
    ):
        with pytest.raises(ValueError, match=r"K of the left camera|row time"):
            write_rig(tmp_path / "rig.toml", replace(made, left=left), {})
    assert not list(tmp_path.iterdir())


@settings(deadline=None, max_examples=60)
@given(st.text("[]=.left\n rigstoK1 0-9\"'#{},", max_size=80))
def test_no_text_crashes(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    path = tmp_path_factory.mktemp("r") / "rig.toml"
    path.write_text(BY_HAND + text)
    try:
        read_rig(path)
    except InputError as error:
        assert error.what
