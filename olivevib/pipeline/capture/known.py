"""What the workspace's book knows of the cameras that have just recorded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from olivevib.errors import InputError
from olivevib.files.capture import CameraFacts
from olivevib.pipeline.capture.verdict import CameraResult
from olivevib.signals import fit_stamps
from olivevib.trial.camera_book import CameraMode, recall, workspace_of


def known_readout_s(
    folder: Path | None, facts: Mapping[str, CameraFacts], results: Sequence[CameraResult]
) -> float | None:
    """From the first to the last row, s: the shorter of both cameras; None unless both are known.

    A book that cannot be read is none here: the verdict comes first, the fault is told afterwards.
    """
    workspace = workspace_of(folder) if folder is not None else None
    found = []
    for result in results if workspace is not None else ():
        told = facts[result.side]
        if result.stamps_s.size > 1 and workspace is not None:
            rate = fit_stamps(result.stamps_s).rate_hz
            mode = CameraMode(told.serial or told.title, told.size_px, rate)
            with suppress(InputError):
                entry = recall(workspace, mode)
                found += [1e-6 * abs(entry.row_time_us) * told.size_px[1]] if entry else []
    return min(found) if found and len(found) == len(results) else None
