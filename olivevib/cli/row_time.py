"""Verb rowtime: the time between two sensor rows, from a flashing lamp or a waved board."""

from __future__ import annotations

import argparse
from pathlib import Path

from olivevib.cli.console import Console


def row_time(arguments: argparse.Namespace, console: Console) -> int:
    """Measure a camera's row time and keep it in the workspace."""
    from olivevib.pipeline.row_time import measure_row_time
    from olivevib.trial.camera_book import remember, workspace_of

    video = Path(arguments.file)
    if arguments.led is None:
        return _from_board(arguments, console)
    measured = measure_row_time(video, arguments.led, arguments.camera, console.tick)
    print(measured.words)
    warned = console.cautions(measured.cautions)
    workspace = workspace_of(Path()) or workspace_of(video.parent)
    if not measured.mode.camera:
        console.say("Not kept: the recording does not say whose it is. Name it with --camera.")
    elif workspace is None:
        console.say("Not kept: there is no workspace here (olivevib init makes one).")
    else:
        path = remember(workspace, measured.entry)
        console.say(f"kept for {measured.mode.camera} in {path}; new trials of it will use it")
    micro = measured.entry.row_time_us
    console.say(f"In a trial that exists: --set cameras.left.row_time_us={micro:g}")
    return 3 if warned else 0


def _from_board(arguments: argparse.Namespace, console: Console) -> int:
    """Tell the row times that the waved board of a trial's calibration showed, and keep them."""
    from olivevib.cli.trials import trial_of
    from olivevib.pipeline.row_time import board_row_times
    from olivevib.trial.camera_book import remember, workspace_of

    trial = trial_of(arguments.file, console)
    workspace = workspace_of(trial.folder)
    for measured in board_row_times(trial):
        print(measured.words)
        mode = measured.entry.mode
        if not mode.camera or workspace is None or not mode.fps:
            console.say(f"Not kept: nothing says whose camera, in which mode, {measured.side} is.")
        else:
            console.say(f"kept for {mode.camera} in {remember(workspace, measured.entry)}")
    console.say(f"{trial.name} itself uses them already (rig.toml, row_time_source board).")
    return 0
