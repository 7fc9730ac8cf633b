"""Verb plan: what the cameras will be able to tell, before the trial."""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from olivevib.cli.console import Console
from olivevib.errors import UsageError

if TYPE_CHECKING:
    from olivevib.planning import Outlook, Setup


MORE = "; olivevib plan --help tells how to change it"


def plan(arguments: argparse.Namespace, console: Console) -> int:
    """Say of one frequency, or of the whole band, what a recording like this will tell."""
    from olivevib.planning import advice, outlook
    from olivevib.planning.words import frequencies, one_words, table_words

    setup = _setup(arguments)
    try:
        found = [outlook(setup, f, arguments.amplitude) for f in frequencies(arguments.frequency)]
    except ValueError as error:
        raise UsageError(f"This cannot be planned: {error}.", "", "Correct it.") from error
    told = advice(setup, found[0]) if len(found) == 1 else ()
    if arguments.json:
        print(json.dumps(_plain(_facts(setup, found, told)), indent=1, ensure_ascii=False))
    elif len(found) == 1:
        print(one_words(setup, found[0], told, MORE))
    else:
        print(table_words(setup, found))
        console.say("More of one frequency: --frequency HZ")
    return 0


def _setup(arguments: argparse.Namespace) -> Setup:
    from olivevib import values
    from olivevib.planning import Setup

    try:
        return Setup(
            fps=arguments.fps,
            readout_s=_seconds(arguments.readout),
            offset_s=_seconds(arguments.offset),
            marker_mm=arguments.marker,
            distance_mm=arguments.distance,
            exposure_s=arguments.exposure * 1e-3,
            focal_px=arguments.focal_px,
            baseline_mm=arguments.baseline,
            rows=arguments.rows,
            seconds=arguments.seconds,
            band_hz=values.band(arguments.band),
        )
    except ValueError as error:
        raise UsageError(f"This cannot be planned: {error}.", "", "Correct the option.") from error


def _seconds(ms: float | None) -> float | None:
    return None if ms is None else ms * 1e-3


def _facts(setup: Setup, found: list[Outlook], told: tuple[str, ...]) -> dict[str, Any]:
    from olivevib.planning.words import zones_of

    return {
        "setup": asdict(setup),
        "marker_px": setup.marker_px,
        "zones": [asdict(zone) for zone in zones_of(setup)],
        "frequencies": [asdict(o) for o in found],
        "advice": list(told),
    }


def _plain(value: Any) -> Any:
    """A value that JSON can hold: what is not a finite number is null."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _plain(v) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return value
