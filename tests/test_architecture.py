"""The rules of ARCHITECTURE.md, each with a planted violation that the guard must catch."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


def contracts(folder: Path) -> subprocess.CompletedProcess[str]:
    """Run the import contracts on the package in ``folder``."""
    command = [sys.executable, "-c", "from importlinter.cli import lint_imports_command as c; c()"]
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    return subprocess.run(
        [*command, "--no-cache"],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    shutil.copytree(
        ROOT / "olivevib", tmp_path / "olivevib", ignore=shutil.ignore_patterns("__pycache__")
    )
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    return tmp_path


def test_the_contracts_hold(copy):
    result = contracts(copy)
    assert result.returncode == 0, result.stdout


@pytest.mark.parametrize(
    ("room", "line"),
    [
        ("geometry.py", "import h5py"),
        ("signals.py", "import pathlib"),
        ("vibration/types.py", "import matplotlib"),
        ("detection/detection.py", "import olivevib.tracking"),
        ("files/atomic.py", "import olivevib.trial"),
        ("pipeline/run.py", "import textual"),
        ("trial/trial.py", "import olivevib.cli"),
    ],
)
def test_a_planted_violation_is_caught(copy, room, line):
    path = copy / "olivevib" / room
    text = path.read_text(encoding="utf-8")
    future = "from __future__ import annotations\n"
    assert future in text
    path.write_text(text.replace(future, f"{future}{line}\n", 1), encoding="utf-8")
    result = contracts(copy)
    assert result.returncode != 0
    assert "BROKEN" in result.stdout


HEAVY = ("scipy", "pandas", "matplotlib", "textual", "cv2", "numpy", "h5py", "av")


def loaded_by(code: str) -> set[str]:
    """Which heavy packages a fresh interpreter has loaded after ``code``."""
    report = f"import sys; print(*[m for m in {HEAVY!r} if m in sys.modules])"
    script = f"import contextlib, io\nwith contextlib.redirect_stdout(io.StringIO()):\n{code}"
    result = subprocess.run(
        [sys.executable, "-c", f"{script}\n{report}"], capture_output=True, text=True, check=True
    )
    return set(result.stdout.split())


def test_help_loads_nothing_heavy():
    code = (
        "    from olivevib.cli import main\n"
        "    with contextlib.suppress(SystemExit):\n        main(['--help'])"
    )
    assert loaded_by(code) == set()
    assert "scipy" in loaded_by("    import scipy")  # the guard sees what is loaded


def test_numeric_rooms_load_without_the_app():
    code = "    import olivevib.tracking, olivevib.reconstruction, olivevib.calibration"
    assert not loaded_by(code) & {"textual", "matplotlib", "pandas", "h5py", "av"}
