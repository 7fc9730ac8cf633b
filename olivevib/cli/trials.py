"""The trial that a word on the command line means."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from olivevib.cli.console import Console

if TYPE_CHECKING:
    from olivevib.trial import Trial


def folder_of(name: str, console: Console) -> Path:
    """Its folder; says which one was taken where the word could mean two."""
    from olivevib.trial.workspace import find_trial, hidden_by

    folder = find_trial(name, Path())
    other = hidden_by(folder, name, Path())
    if other is not None:
        console.say(f"{name}: taken is ./{folder}; the trial {other} is another one")
    return folder


def trial_of(name: str, console: Console) -> Trial:
    """The trial, opened; raises as ``find_trial`` and ``Trial.open`` do."""
    from olivevib.trial import Trial

    return Trial.open(folder_of(name, console))
