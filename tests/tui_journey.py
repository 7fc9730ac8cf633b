"""The whole journey from raw files to a report and a DXF, as keys: for the pilot and for tmux."""

from __future__ import annotations

import shutil
from pathlib import Path

SAMPLE = Path(__file__).resolve().parents[1] / "trials" / "sample"
RAW = ("left.nut", "right.nut", "calibration", "accelerometer.csv")
WAIT = "wait"  # until no work runs any more

# from the empty list of trials; "text:" is typed and not counted
KEYS = (
    *("n", "enter", "text:raw/left.nut", *["enter"] * 4),
    *("ctrl+o", "down", "enter", "enter", "enter", "text:67.8", "enter", "text:1-6", "enter"),
    *("text:aruco:DICT_4X4_50", "enter", "text:global", "enter", "enter", "text:2", "enter"),
    *("text:5-14", "enter"),
    *("enter", "text:2", "ctrl+s", WAIT, "r", WAIT),
    *("v", "escape", "c", "escape", "e", "e", WAIT, *["down"] * 6, "enter", WAIT),
)
MOST = 40


def keystrokes() -> int:
    """Keys of the journey besides what is typed."""
    return sum(key != WAIT and not key.startswith("text:") for key in KEYS)


def raw_workspace(folder: Path) -> Path:
    """A workspace without trials, and the sample's raw files in ``raw/`` of it."""
    for name in ("trials", "reports", "markers"):
        (folder / name).mkdir(parents=True)
    (folder / "raw").mkdir()
    for name in RAW:
        source = SAMPLE / name
        copy = shutil.copytree if source.is_dir() else shutil.copyfile
        copy(source, folder / "raw" / name)
    return folder


def check_outcome(folder: Path) -> None:
    """The report and the DXF are there, every stage is done, and the numbers are right."""
    from olivevib.trial import Trial
    from olivevib.trial.summary import summary

    trial = Trial.open(folder / "trials" / "T01")
    assert {s.state.value for s in trial.states().values()} == {"done"}
    facts = summary(trial)
    assert facts["comparison"]["verdict"] == "agrees"
    assert facts["calibration"]["baseline_mm"] > 100
    assert (trial.folder / "report.html").stat().st_size > 10_000
    assert (trial.folder / "exports" / "T01.dxf").stat().st_size > 1000
