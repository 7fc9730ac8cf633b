"""Which folders of a workspace are trials; light, so that a list can be shown before all else."""

from __future__ import annotations

from pathlib import Path

FILE = "trial.toml"


def list_trials(workspace: Path) -> list[Path]:
    """The trial folders of a workspace, sorted by name."""
    return sorted(path.parent for path in (workspace / "trials").glob(f"*/{FILE}"))
