"""Which trials a batch is about: trials by name, and folders that hold trials somewhere below."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from olivevib.errors import InputError, UsageError
from olivevib.files.trial_folders import FILE


def find_trials(names: Iterable[str], workspace: Path) -> list[Path]:
    """The trial folders, absolute, each once: in the order named, within a folder by name.

    A name is a trial's folder, a name under ``trials/``, or a folder that holds trials at any
    depth. Raises UsageError for a name that leads to no trial, InputError for a folder that
    cannot be read.
    """
    found: dict[Path, None] = {}
    for name in names:
        trials = list(_trials(name, workspace))
        if not trials:
            raise UsageError(
                f"{name} is no trial and holds none.",
                f"No {FILE} was found in {name}, below it, or in trials/{name}.",
                "Give folders of trials; olivevib new TRIAL --left FILE --right FILE makes one.",
            )
        found |= dict.fromkeys(trial.resolve() for trial in trials)
    return list(found)


def _trials(name: str, workspace: Path) -> Iterator[Path]:
    named = workspace / "trials" / name
    if not Path(name).exists() and named.exists():
        yield from _below(named)
    else:
        yield from _below(Path(name))


def _below(folder: Path) -> Iterator[Path]:
    """The folder if it is a trial, else the trials in it; links are followed to trials only."""
    if (folder / FILE).is_file():
        yield folder
    elif folder.is_dir():
        for inside in _folders(folder):
            if not inside.is_symlink() or (inside / FILE).is_file():
                yield from _below(inside)


def _folders(folder: Path) -> list[Path]:
    try:
        return sorted(p for p in folder.iterdir() if p.is_dir() and not p.name.startswith("."))
    except OSError as error:
        raise InputError(
            f"{folder} cannot be read.", error.strerror or str(error), "Check its rights."
        ) from error
