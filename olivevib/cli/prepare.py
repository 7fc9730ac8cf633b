"""Verbs before the measurement: init, new; and archive, after all of it."""

from __future__ import annotations

import argparse
from pathlib import Path

from olivevib import values
from olivevib.cli.console import Console


def init(arguments: argparse.Namespace, console: Console) -> int:
    """Make the folders of a workspace."""
    from olivevib.trial.workspace import make_workspace

    folder = Path(arguments.dir)
    made = make_workspace(folder)
    console.say(
        f"{folder} is a workspace" + (f"; made {', '.join(p.name for p in made)}." if made else ".")
    )
    console.say("Next: olivevib new TRIAL --left FILE --right FILE …  (see olivevib new --help)")
    return 0


def new(arguments: argparse.Namespace, console: Console) -> int:
    """Make a trial from two recordings."""
    from olivevib import pipeline
    from olivevib.trial.workspace import find_preset, place_for_new

    size, own_sizes = values.sizes(arguments.size)
    left_row, right_row = values.row_times(arguments.row_time)
    plan = pipeline.NewTrial(
        left=arguments.left,
        right=arguments.right,
        calibration_left=arguments.calibration_left,
        calibration_right=arguments.calibration_right,
        board=arguments.board,
        rig=arguments.rig,
        markers=arguments.markers,
        size_mm=size,
        sizes_mm=own_sizes,
        ids=values.id_list(arguments.ids),
        shutter=arguments.shutter,
        row_time_us=(left_row, right_row),
        exposure_ms=arguments.exposure,
        band_hz=values.band(arguments.band),
        left_stamps=arguments.left_stamps,
        right_stamps=arguments.right_stamps,
        sensors=pipeline.sensor_plans(
            arguments.accelerometer,
            arguments.accelerometer_marker,
            arguments.accelerometer_axes,
            arguments.accelerometer_lever,
        ),
        preset=find_preset(arguments.preset, Path()) if arguments.preset else None,
        link=arguments.link,
        settings=values.settings(arguments.set),
    )
    folder = place_for_new(arguments.trial, Path())
    trial = pipeline.new_trial(folder, plan, console.tick)
    for words in pipeline.unsaid(plan):
        console.say(f"  not said: {words}")
    console.say(f"made {trial.folder}; describe it in {trial.folder / 'trial.toml'}")
    console.say(f"Next: olivevib run {arguments.trial}")
    return 0


def preset(arguments: argparse.Namespace, console: Console) -> int:
    """Keep how a trial's accelerometer file is read, for other trials."""
    from olivevib import pipeline
    from olivevib.cli.trials import trial_of

    trial = trial_of(arguments.trial, console)
    path = pipeline.keep_preset(trial, arguments.name, arguments.sensor, Path())
    print(path)
    console.say(f"Next: olivevib new TRIAL … --accelerometer FILE --preset {arguments.name}")
    return 0


def archive(arguments: argparse.Namespace, console: Console) -> int:
    """Leave trials out of lists, or take them back; nothing on the disk moves."""
    from olivevib.cli.trials import trial_of

    for name in arguments.trials:
        trial = trial_of(name, console)
        trial.changed({"session.archived": None if arguments.undo else True})
        console.say(f"{trial.name} is {'listed again' if arguments.undo else 'archived'}.")
    return 0
