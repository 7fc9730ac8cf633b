"""From recordings to a trial: what was captured is named in trial.toml, where it already lies."""

from __future__ import annotations

import statistics
import tomllib
from contextlib import suppress
from pathlib import Path

from olivevib.errors import UsageError
from olivevib.files.atomic import write_text_atomic
from olivevib.files.capture import read_sidecar, sidecar_of
from olivevib.files.trial_folders import FILE
from olivevib.pipeline.capture.plan import Captured, CapturePlan
from olivevib.pipeline.capture.record import RECORD
from olivevib.pipeline.new import NewTrial, new_trial
from olivevib.progress import Tick, silent
from olivevib.trial import Trial
from olivevib.trial.camera_book import CameraMode, recall, workspace_of

CALIBRATION = "calibration"


def place_of(folder: Path, plan: CapturePlan) -> Path:
    """Where the recordings of a trial go: into its folder, the board's into calibration/.

    UsageError for the tree of a trial that has its recordings already; one of a board alone
    (``board_trial``) still waits for its tree.
    """
    if plan.board is not None:
        return folder / CALIBRATION
    if (folder / FILE).exists() and _has_tree(folder):
        raise UsageError(
            f"{folder} is a trial already.",
            "A capture never overwrites one.",
            "Choose another name; --board SPEC records the calibration board of this trial.",
        )
    return folder


def trial_from(
    folder: Path,
    plan: CapturePlan,
    captured: Captured,
    size_mm: float | None = None,
    tick: Tick = silent,
) -> Trial | None:
    """Make the trial of a captured tree, or tell a trial of its captured board.

    None where the recordings of both cameras are not there (yet): a board that was captured before
    the tree waits in calibration/ and is found by it. size_mm: outer side of the markers.
    """
    if len(captured.videos) < 2:
        return None
    if plan.board is not None:
        return _with_board(folder, plan) if (folder / FILE).exists() else None
    left, right = (captured.videos[side] for side in ("left", "right"))
    board = board_in(folder)
    calibration = {side: folder / CALIBRATION / f"{side}.nut" for side in ("left", "right")}
    told = NewTrial(
        left=str(left),
        right=str(right),
        left_stamps=str(sidecar_of(left)),
        right_stamps=str(sidecar_of(right)),
        calibration_left=str(calibration["left"]) if board else None,
        calibration_right=str(calibration["right"]) if board else None,
        board=board,
        markers=plan.markers,
        ids=plan.ids,
        size_mm=size_mm,
        band_hz=plan.band_hz,
        simulated=any(name.startswith("simulated:") for name in (plan.left, plan.right)),
    )
    there = (folder / FILE).exists()
    trial = _with_tree(folder, told) if there else new_trial(folder, told, tick)
    facts = _camera_facts(folder)
    return trial.changed(facts) if facts else trial


def board_trial(folder: Path, plan: CapturePlan, captured: Captured) -> Trial | None:
    """The trial of a captured board, made where there is none yet: ``calibrate`` can run on it.

    The tree may be captured into it later. None where not both recordings are there.
    """
    if len(captured.videos) < 2:
        return None
    if not (folder / FILE).exists():
        first = (
            "# An olivevib trial whose board was recorded first; olivevib capture adds the tree.\n"
        )
        simulated = any(name.startswith("simulated:") for name in (plan.left, plan.right))
        mark = "\n[session]\nsimulated = true\n" if simulated else ""
        write_text_atomic(folder / FILE, first + mark)
    return _with_board(folder, plan)


def _has_tree(folder: Path) -> bool:
    cameras = Trial.open(folder).settings.cameras
    return bool(cameras.left.video or cameras.right.video)


def _with_tree(folder: Path, told: NewTrial) -> Trial:
    """A trial of a board alone, told of the tree that was captured into its folder."""
    changes: dict[str, object] = {
        "markers.library": told.markers,
        "markers.ids": list(told.ids) or None,
        "markers.size_mm": told.size_mm,
        "vibration.band_hz": list(told.band_hz) if told.band_hz else None,
    }
    for side in ("left", "right"):
        changes[f"cameras.{side}.video"] = Path(getattr(told, side)).name
        changes[f"cameras.{side}.stamps"] = Path(getattr(told, f"{side}_stamps")).name
    if told.simulated:
        changes["session.simulated"] = True
    return Trial.open(folder).changed({k: v for k, v in changes.items() if v is not None})


def _camera_facts(folder: Path) -> dict[str, object]:
    """What is known of the cameras beside the recordings: exposure, and row time by the book."""
    out: dict[str, object] = {}
    workspace = workspace_of(folder)
    record = tomllib.loads((folder / RECORD).read_text(encoding="utf-8"))
    for side in ("left", "right"):
        told = record[side]
        camera = str(told.get("serial") or told["title"])
        width, height = told["size_px"]
        mode = CameraMode(camera, (int(width), int(height)), float(told.get("rate_hz", 0.0)))
        entry = recall(workspace, mode) if workspace else None
        if entry is not None:
            out["cameras.shutter"] = "rolling"
            out[f"cameras.{side}.row_time_us"] = entry.row_time_us
            out[f"cameras.{side}.row_time_sigma_us"] = entry.sigma_us
            out[f"cameras.{side}.row_time_source"] = entry.kind
        exposure = _exposure_ms(folder / f"{side}.nut")
        if exposure is not None:
            out[f"cameras.{side}.exposure_ms"] = exposure
    return out


def _exposure_ms(video: Path) -> float | None:
    """The middle exposure of a recording as the driver told it; None where it did not."""
    sidecar = read_sidecar(sidecar_of(video))
    known = [line.exposure_us for line in sidecar.lines if line.exposure_us] if sidecar else []
    return statistics.median(known) / 1000 if known else None


def board_in(folder: Path) -> str | None:
    """The SPEC of the board that was captured for this trial; None where none was."""
    with suppress(OSError, tomllib.TOMLDecodeError):
        told = tomllib.loads((folder / CALIBRATION / RECORD).read_text(encoding="utf-8"))
        there = all((folder / CALIBRATION / f"{side}.nut").is_file() for side in ("left", "right"))
        if there and isinstance(told.get("board"), str):
            return str(told["board"])
    return None


def _with_board(folder: Path, plan: CapturePlan) -> Trial:
    return Trial.open(folder).changed(
        {
            "calibration.left": f"{CALIBRATION}/left.nut",
            "calibration.right": f"{CALIBRATION}/right.nut",
            "calibration.board": plan.board,
        }
    )
