"""Verb rowtime: the time between two sensor rows, from a flashing lamp or a waved board."""

from __future__ import annotations

import argparse
from pathlib import Path

from olivevib.cli.console import Console


def row_time(arguments: argparse.Namespace, console: Console) -> int:
    """Measure a camera's row time and keep it in the workspace."""
    from olivevib.pipeline.row_time import keep_row_time, measure_row_time
    from olivevib.trial.camera_book import workspace_of

    video = Path(arguments.file)
    if arguments.led is None:
        return _from_board(arguments, console)
    measured = measure_row_time(video, arguments.led, arguments.camera, console.tick)
    print(measured.words)
    warned = console.cautions(measured.cautions)
    workspace = workspace_of(Path()) or workspace_of(video.parent)
    console.say(keep_row_time(measured.entry, workspace))
    micro = measured.entry.row_time_us
    console.say(f"In a trial that exists: --set cameras.left.row_time_us={micro:g}")
    return 3 if warned else 0


def _from_board(arguments: argparse.Namespace, console: Console) -> int:
    """Tell the row times that the waved board of a trial's calibration showed, and keep them."""
    from olivevib.cli.trials import trial_of
    from olivevib.pipeline.row_time import board_row_times, keep_row_time
    from olivevib.trial.camera_book import workspace_of

    trial = trial_of(arguments.file, console)
    workspace = workspace_of(trial.folder)
    for measured in board_row_times(trial):
        print(measured.words)
        console.say(keep_row_time(measured.entry, workspace))
    console.say(f"{trial.name} itself uses them already (rig.toml, row_time_source board).")
    return 0
