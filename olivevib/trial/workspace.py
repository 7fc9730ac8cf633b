"""The folder with ``trials/``, ``reports/`` and ``markers/``, and how a trial is named in it."""

from __future__ import annotations

from pathlib import Path

from olivevib.errors import UsageError
from olivevib.files.atomic import as_input_error
from olivevib.files.trial_folders import FILE, list_trials

FOLDERS = ("trials", "reports", "markers")


def make_workspace(folder: Path) -> list[Path]:
    """Create the three folders where they are missing; returns those that were made.

    InputError where the disk refuses them.
    """
    made = [folder / name for name in FOLDERS if not (folder / name).is_dir()]
    for path in made:
        try:
            path.mkdir(parents=True)
        except OSError as error:
            raise as_input_error(error, path) from error
    return made


def named(folder: Path) -> Path:
    """The folder by a name of its own, where it was given as ``.`` or ``..``.

    UsageError for the root of a disk: beside it nothing can stand.
    """
    whole = folder if folder.name not in ("", "..") else folder.resolve()
    if not whole.name:
        raise UsageError(f"{folder} cannot be a trial.", "", "Name a folder of your own.")
    return whole


def find_trial(name: str, workspace: Path) -> Path:
    """The folder of a trial: a path, or a name under ``trials/``; UsageError with near names."""
    for candidate in (Path(name), workspace / "trials" / name):
        if (candidate / FILE).is_file():
            return candidate
    known = ", ".join(t.name for t in list_trials(workspace)) or "none yet"
    raise UsageError(
        f"there is no trial {name!r}.",
        f"Neither {name} nor trials/{name} holds a {FILE}; trials here: {known}.",
        "Give a folder or a name, or make one: olivevib new TRIAL --left FILE --right FILE",
    )


def hidden_by(taken: Path, name: str, workspace: Path) -> Path | None:
    """Another trial that the name could have meant; None where ``taken`` is the only one."""
    other = workspace / "trials" / name
    there = (other / FILE).is_file() and other.resolve() != taken.resolve()
    return other if there else None


def find_preset(name: str, workspace: Path) -> str:
    """The file of a preset: a name under ``presets/`` of the workspace, or a path as it is."""
    kept = workspace / "presets" / f"{name}.toml"
    return str(kept) if name and kept.is_file() else name


def find_library(name: str, workspace: Path) -> str:
    """A marker library by name or file; a bare file name is also looked for under ``markers/``."""
    kept = workspace / "markers" / name
    beside = name.endswith(".toml") and not Path(name).exists() and kept.exists()
    return str(kept) if beside else name


def place_for_new(name: str, workspace: Path) -> Path:
    """Where a new trial goes: a bare name under ``trials/`` of a workspace, else the path given."""
    path = Path(name)
    bare = len(path.parts) == 1 and not path.is_absolute()
    folder = workspace / "trials" / name if bare and (workspace / "trials").is_dir() else path
    if (folder / FILE).exists():
        raise UsageError(
            f"{folder} is a trial already.",
            "A new trial never overwrites one.",
            "Choose another name, or remove the folder yourself if it is not wanted.",
        )
    return folder
