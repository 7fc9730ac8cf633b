"""What the tests share: where the real recordings lie, and deterministic threads."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from olivevib.threads import use_one_thread

use_one_thread(os.environ)  # before a test loads numpy: results must not hang on the cores


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The real recordings that nobody here made; tests on them skip where they are absent."""
    folder = Path(__file__).resolve().parents[2] / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("the real recordings are not beside this checkout")
    return folder
