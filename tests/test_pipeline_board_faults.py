"""Board recordings through the pipeline: what the technician reads, and the paper's calibration."""

from pathlib import Path

import cv2
import numpy as np
import pytest
import small_trial
from small_videos import make_video

from olivevib import pipeline
from olivevib.calibration.artwork import charuco_board
from olivevib.calibration.boards import parse_board
from olivevib.calibration.diagnosis import diagnose
from olivevib.errors import InputError
from olivevib.files.rig_file import read_facts, read_rig
from olivevib.geometry import rotation_from_vector
from olivevib.pipeline import NewTrial, new_trial
from olivevib.trial import Trial

SPEC = "charuco:4x5,square=54,marker=40.5,dict=DICT_4X4_50"
SIZE = (640, 480)
K = np.array([[620.0, 0, 318.0], [0, 620.0, 242.0], [0, 0, 1]])
R = rotation_from_vector([0.01, 0.3, -0.02])
T_MM = np.array([-250.0, 4.0, 30.0])
PRINT_PX_MM = 4


def drawn() -> np.ndarray:
    """The printed board with a white margin of one square."""
    board = charuco_board(parse_board(SPEC))
    return board.generateImage((6 * 54 * PRINT_PX_MM, 7 * 54 * PRINT_PX_MM), None, 54 * PRINT_PX_MM)


def stills(folder: Path, right: bool, change=lambda grey: grey, views: int = 8) -> Path:
    """Pictures of the board in various tilts, the same for both cameras, lightly blurred."""
    folder.mkdir()
    art, rng = drawn(), np.random.default_rng(4)
    to_mm = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, PRINT_PX_MM]]) / PRINT_PX_MM
    to_mm[:2, 2] -= 54  # the margin
    middle_mm = np.array([108.0, 135.0, 0.0])
    for k in range(views):
        turn = rotation_from_vector(rng.uniform(-0.5, 0.5, 3))
        t = rng.uniform([-30, -20, 720], [30, 20, 880]) - turn @ middle_mm
        pose, shift = (R @ turn, R @ t + T_MM) if right else (turn, t)
        H = K @ np.column_stack([pose[:, 0], pose[:, 1], shift]) @ to_mm
        seen = cv2.warpPerspective(art, H, SIZE, flags=cv2.INTER_AREA, borderValue=190)
        seen = cv2.GaussianBlur(seen, (0, 0), 0.8)
        cv2.imwrite(str(folder / f"still_{k:02d}.png"), change(seen))
    return folder


@pytest.fixture(scope="module")
def videos(tmp_path_factory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("videos")
    names = {side: folder / f"{side}.avi" for side in ("left", "right")}
    for path in names.values():
        make_video(path, frames=3, size=SIZE)
    return names


def trial(folder: Path, videos: dict[str, Path], board: str = SPEC, change=lambda grey: grey):
    plan = NewTrial(
        left=str(videos["left"]),
        right=str(videos["right"]),
        calibration_left=str(stills(folder / "left", right=False)),
        calibration_right=str(stills(folder / "right", right=True, change=change)),
        board=board,
        markers="aruco:DICT_4X4_50",
        size_mm=small_trial.SIZE_MM,
    )
    return new_trial(folder / "T01", plan)


def refusal(made: Trial) -> InputError:
    with pytest.raises(InputError) as caught:
        pipeline.run_stage(made, "calibrate")
    return caught.value


def test_a_mirrored_recording_is_named_as_such(tmp_path, videos):
    error = refusal(trial(tmp_path, videos, change=lambda grey: cv2.flip(grey, 1)))
    assert "right board recording" in error.what and "0 of 8 frames" in error.what
    assert "mirrored" in error.why and "8 of 8" in error.why
    assert "flip" in error.remedy


def test_a_board_declared_inverted_that_is_not_is_told(tmp_path, videos):
    error = refusal(trial(tmp_path, videos, board=SPEC + ",inverted"))
    assert "left board recording" in error.what and "not inverted" in error.why
    assert error.remedy.endswith(SPEC)


def clouds(grey: np.ndarray) -> np.ndarray:
    """A picture of the same size and brightness without a board."""
    noise = np.random.default_rng(1).normal(0, 400, grey.shape)
    return np.clip(cv2.GaussianBlur(noise, (0, 0), 9) + 150, 0, 255).astype(np.uint8)


def test_pictures_without_a_board_list_what_was_tried(tmp_path, videos):
    error = refusal(trial(tmp_path, videos, change=clouds))
    assert "No board found" in error.why
    for tried in ("inverted", "mirrored", "turned", "columns and rows", "dictionaries"):
        assert tried in error.why, tried


def test_the_papers_calibration_end_to_end(tmp_path, videos):
    made = trial(tmp_path, videos).changed({"calibration.paper": True})
    cautions = pipeline.run_stage(made, "calibrate")
    assert "paper-calibration" in [caution.code for caution in cautions]
    rig, record = read_rig(made.folder / "rig.toml"), made.reopen().calibration
    assert rig.left.K[0, 1] != 0 and (rig.left.distortion == 0).all() and rig.covariance is None
    assert np.abs(rig.left.K - K).max() < 0.01 * 620
    assert np.linalg.norm(rig.t_right_left_mm - T_MM) < 0.02 * 250
    assert record.holdout_rms_percent < 0.5 and np.isnan(record.right_offset_sigma_s)
    assert "closed form" in read_facts(made.folder / "rig.toml")["verdict"]


def frames_of(video: Path, count: int = 8) -> list[np.ndarray]:
    """Grey frames spread over a recording."""
    reader, frames = cv2.VideoCapture(str(video)), []
    while (got := reader.read())[0]:
        frames.append(cv2.cvtColor(got[1], cv2.COLOR_BGR2GRAY))
    return frames[:: len(frames) // count][:count]


WEBCAM_BOARD = "charuco:4x5,square=54,marker=40.5,dict=DICT_4X4_1000"


@pytest.mark.shared
@pytest.mark.parametrize(
    ("video", "declared", "cause"),
    [
        ("webcam4_charuco_C_mirrored_cam/cam_1.mp4", WEBCAM_BOARD + ",inverted", "mirrored"),
        ("webcam4_charuco_A/cam_2.mp4", WEBCAM_BOARD, "inverted"),
    ],
)
def test_real_recordings_are_diagnosed(shared_data, video, declared, cause):
    found = diagnose(parse_board(declared), frames_of(shared_data / "calibration" / video))
    assert found.cause == cause, found.text
    assert found.board == parse_board(WEBCAM_BOARD + ",inverted")
