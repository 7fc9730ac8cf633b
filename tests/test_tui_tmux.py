"""The whole journey in a real terminal."""

from __future__ import annotations

import shutil

import pytest
from tmux_journey import journey


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("tmux") is None, reason="tmux is not installed")
@pytest.mark.parametrize("size", [(120, 40), (80, 24)], ids=["120x40", "80x24"])
def test_the_journey_in_a_real_terminal(tmp_path, size):
    screens = journey(tmp_path / "olive", size)
    assert any("charuco:7x5" in screen for screen in screens)
    assert any("▶1" in screen for screen in screens)
