"""``calibrate --preview`` on running cameras: guided, recorded whole, calibrated afterwards."""

from __future__ import annotations

import io
import re

import cv2
import numpy as np
import pytest
from boards_rendered import printed

from olivevib.calibration import guidance, parse_board
from olivevib.cli import live_board, main
from olivevib.cli.console import Console
from olivevib.files.capture import verify
from olivevib.files.container import open_container
from olivevib.files.packets import Packets
from olivevib.geometry import rotation_from_vector
from olivevib.studies.capture.camera import MjpegServer, Plan, number_of
from olivevib.trial import Trial

SPEC = "charuco:4x5,square=54,marker=40.5,dict=DICT_4X4_1000"
SIZE = (400, 300)
FOCAL = 350.0
K = np.array([[FOCAL, 0, 199.5], [0, FOCAL, 149.5], [0, 0, 1]])
BASE_MM, TURN = 150.0, 0.22
LEANS = ((0.0, 0.0), (0.5, 0.0), (-0.5, 0.1), (0.1, 0.5), (0.0, -0.5))
RIGHT = rotation_from_vector([0.0, TURN, 0.0]), np.array([-BASE_MM, 0.0, 16.0])


def drawn(board, R, t):
    """A picture (300, 400) of the board in one camera."""
    art, cell, corner = printed(board)
    scale = board.pitch_mm / cell
    place = np.array([[scale, 0, corner + scale / 2], [0, scale, corner + scale / 2], [0, 0, 1]])
    double = np.array([[2.0, 0, 0.5], [0, 2, 0.5], [0, 0, 1]])
    H = double @ K @ np.column_stack([R[:, 0], R[:, 1], t]) @ place
    shrunk = cv2.GaussianBlur(art, (0, 0), 2.0)
    size = (2 * SIZE[0], 2 * SIZE[1])
    fine = cv2.warpPerspective(shrunk, H, size, flags=cv2.INTER_AREA, borderValue=120)
    return cv2.GaussianBlur(cv2.resize(fine, SIZE, interpolation=cv2.INTER_AREA), (0, 0), 0.6)


def poses(board):
    """Places of the board all over both pictures, leaning to all sides, near and far."""
    middle = board.points_mm.mean(axis=0)
    out = []
    for k, (u, v) in enumerate((u, v) for v in (0.3, 0.5, 0.7) for u in (0.3, 0.45, 0.6, 0.75)):
        for near in (0, 1):
            R = rotation_from_vector([*LEANS[(2 * k + near) % 5], 0.1 * (k % 3)])
            at = np.array([(u - 0.5) * SIZE[0] / FOCAL, (v - 0.5) * SIZE[1] / FOCAL, 1.0])
            out.append((R, at * (520.0 if near else 760.0) - R @ middle))
    return out


@pytest.fixture(scope="module")
def films():
    """Coded pictures of both cameras, every pose held for three frames."""
    board = parse_board(SPEC)
    films = {"left": [], "right": []}
    for R, t in poses(board):
        right = (RIGHT[0] @ R, RIGHT[0] @ t + RIGHT[1])
        for side, seen in (("left", (R, t)), ("right", right)):
            coded = cv2.imencode(".jpg", drawn(board, *seen), [cv2.IMWRITE_JPEG_QUALITY, 92])[1]
            films[side] += [bytes(coded)] * 3
    return films


def server(films, side, fps=12):
    return MjpegServer(Plan(fps=fps, size=SIZE, pictures=films[side]))


def preview(left, right, *more):
    command = ["calibrate", "T", "--preview", "--left", left.address, "--right", right.address]
    return main([*command, "--board", SPEC, *more])


@pytest.mark.slow
def test_the_board_is_guided_recorded_whole_and_can_be_calibrated(
    films, tmp_path, monkeypatch, capsys
):
    """The numbers that count as enough are lowered so that ten seconds do; the rest is as it is."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(guidance, "LEAST_PAIRS", 6)
    monkeypatch.setattr(guidance, "LEAST_SHARE", 0.3)
    monkeypatch.setattr(guidance, "LEAST_DEPTH", 1.2)
    monkeypatch.setattr(live_board, "AFTER_S", 0.5)
    with server(films, "left") as left, server(films, "right") as right:
        code = preview(left, right)
        for side, sent in (("left", left), ("right", right)):
            container, stream = open_container(tmp_path / "T" / "calibration" / f"{side}.nut")
            with container:
                got = [bytes(p) for p, _ in Packets("x", container, stream)]
            numbers = [number_of(data) for data in got]
            assert numbers == list(range(numbers[0], numbers[-1] + 1))  # no frame was left out
            assert got == [sent.data(n) for n in numbers]
            assert verify(tmp_path / "T" / "calibration" / f"{side}.nut").whole
    out, told = capsys.readouterr()
    assert code == 0, told
    assert "ENOUGH NOW" in out and "NEXT" not in out
    assert "██" in out and "nearer side: " in out
    assert int(re.search(r"(\d+) of 6 views", out)[1]) >= 6
    assert "show the board" in told  # was said while it was not enough
    assert "Next: olivevib calibrate T" in told
    settings = Trial.open(tmp_path / "T").settings.calibration
    assert (settings.left, settings.board) == ("calibration/left.nut", SPEC)
    assert main(["calibrate", "T", "--preview"]) in (0, 3)  # the recordings, gone through again
    assert main(["calibrate", "T"]) in (0, 3)
    rig = Trial.open(tmp_path / "T").rig
    assert rig.left.K[0, 0] == pytest.approx(FOCAL, rel=0.03)
    assert rig.baseline_mm == pytest.approx(np.linalg.norm(RIGHT[1]), rel=0.02)


def test_too_short_a_recording_says_what_is_missing_and_takes_its_tree_later(
    films, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    with server(films, "left") as left, server(films, "right") as right:
        assert preview(left, right, "--seconds", "1.2") == 3
        out, told = capsys.readouterr()
        assert "NEXT: show the board" in out
        assert "board-coverage-thin" in told
        assert preview(left, right, "--seconds", "1") == 2  # never over another recording
        assert "there already" in capsys.readouterr().err
        tree = ["capture", "T", "--left", left.address, "--right", right.address, "--no-preview"]
        assert main([*tree, "--seconds", "0.5"]) in (0, 3)
        trial = Trial.open(tmp_path / "T")
        assert trial.settings.cameras.left.video == "left.nut"
        assert trial.settings.calibration.board == SPEC
        capsys.readouterr()
        assert main([*tree, "--seconds", "0.5"]) == 2
    assert "a trial already" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--preview", "--left", "0"], "the right camera is not named"),
        (["--left", "0", "--right", "1"], "go with --preview"),
        (["--preview", "--left", "0", "--right", "1"], "board is not known"),
    ],
)
def test_what_is_missing_is_told_before_a_camera_is_touched(
    words, said, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    assert main(["calibrate", "T", *words]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "T").exists()


class Terminal:
    """A stream that says it is a terminal."""

    def __init__(self):
        self.text = ""

    def write(self, text):
        self.text += text

    def flush(self):
        pass

    def isatty(self):
        return True


def test_a_picture_is_drawn_over_itself_and_sentences_stay_above_it():
    stream = Terminal()
    console = Console(stream)
    assert console.paint(["one", "two"])
    assert console.paint(["three"])
    console.say("said")
    assert console.paint([])
    assert stream.text == "one\ntwo\n\x1b[2F\x1b[Jthree\n\x1b[1F\x1b[Jsaid\n"
    assert not Console(io.StringIO()).paint(["nowhere"])
