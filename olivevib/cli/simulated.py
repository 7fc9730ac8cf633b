"""Verbs on simulated trials: simulate, demo."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from olivevib.cli.console import Console
from olivevib.errors import UsageError

if TYPE_CHECKING:
    from olivevib.pipeline.truth import MarkerTruth, TruthReport


def simulate(arguments: argparse.Namespace, console: Console) -> int:
    """Record a named scenario into a new trial folder, or list the scenarios."""
    from olivevib.pipeline.simulated import simulated_trial, truth_folder
    from olivevib.simulation import SCENARIOS
    from olivevib.trial.workspace import named

    if arguments.list:
        for scenario in SCENARIOS:
            print(f"{scenario.name:12} {scenario.title}")
        return 0
    if not arguments.dir or not arguments.scenario:
        raise UsageError(
            "simulate needs a folder and a scenario.",
            "",
            "Write: olivevib simulate DIR --scenario NAME   (olivevib simulate --list)",
        )
    folder = named(Path(arguments.dir))
    simulated_trial(folder, arguments.scenario, arguments.seed, console.tick)
    console.say(f"recorded {folder}; the truth stands apart in {truth_folder(folder)}")
    console.say(f"Next: olivevib run {folder}")
    return 0


def demo(arguments: argparse.Namespace, console: Console) -> int:
    """Render a trial, run every stage, and print measured against true values."""
    from olivevib import pipeline
    from olivevib.pipeline.simulated import simulated_trial, truth_folder
    from olivevib.pipeline.truth import compare_with_truth
    from olivevib.trial.workspace import named

    name = "beyond" if arguments.beyond else "demo"
    folder = named(Path(arguments.dir or name))
    console.say(f"A simulated trial in {folder}: rendered, then measured as if it were recorded.")
    trial = simulated_trial(folder, name, arguments.seed, console.tick, arguments.seconds)
    warned = 0
    for outcome in pipeline.run(trial, console.tick):
        console.say(f"  {outcome.stage}: {outcome.words}")
        warned += console.cautions(outcome.cautions)
    trial = trial.reopen()
    (page,) = pipeline.report([trial], None, console.tick)
    print(truth_text(compare_with_truth(trial, truth_folder(folder))))
    console.say(f"Report: {page}   Next: olivevib show {folder}")
    return 3 if warned else 0


def truth_text(report: TruthReport) -> str:
    """Measured against true, a row a marker, with sigmas."""
    lines = [
        "measured against the known truth of the simulation",
        f"  (after a rigid alignment of the frames: {report.shift_mm:.2f} mm, "
        f"{report.turn_mrad:.2f} mrad, the calibration's own error)",
        "",
        f"{'':14}{'rms error, mm':^18}{'error / sigma':^17}"
        f"{'amplitude, mm (largest axis)':^31}{'frequency, Hz':^30}",
        f"{'id':>5} {'found':>7} {'lateral':>9} {'depth':>8} {'lateral':>8} {'depth':>7}"
        f"{'measured':>13} {'sigma':>7} {'true':>8}  {'measured':>9} {'sigma':>7} {'true':>8}"
        "  status",
    ]
    for m in report.markers:
        lines.append(
            f"{m.id:5d} {m.seen:7.1%} {m.lateral_mm:9.4f} {m.depth_mm:8.4f} {m.z_lateral:8.2f} "
            f"{m.z_depth:7.2f}{m.amplitude_mm:13.4f} {m.amplitude_sigma_mm:7.4f} "
            f"{m.true_amplitude_mm:8.4f}  {_frequency(m)} {m.true_f_hz:8.4f}  {m.status}"
        )
    lines += [
        "",
        f"  all markers: {report.lateral_mm:.4f} mm rms lateral, {report.depth_mm:.4f} mm depth",
    ]
    return "\n".join(lines)


def _frequency(m: MarkerTruth) -> str:
    """A frequency where it is known; never a bare number where it is not."""
    if m.status in ("direct", "confirmed", "supported"):
        return f"{m.f_hz:9.4f} {m.f_sigma_hz:7.4f}"
    return f"{'not decided':>17}"
