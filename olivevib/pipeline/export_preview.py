"""What an export will hold, before it is written: its size, its first lines, each marker's gaps."""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np

from olivevib.files.exports import EVEN, even_part, only_markers
from olivevib.pipeline.outputs import export
from olivevib.trial import Trial

TEXTS = ("csv", "txt", "trc", "ply")  # formats whose first lines a person can read
LINES = 3
_HEAD = 4000


@dataclass(frozen=True)
class Gap:
    """Times at which a marker was not seen: how many, in how many stretches, the longest in s."""

    marker: int
    times: int
    stretches: int
    longest_s: float


@dataclass(frozen=True)
class ExportPreview:
    """size: bytes of the file. head: first lines of a text format. gaps: of markers that have any.

    times, markers: how many; span_s: from the first time to the last; frame: whose axes.
    """

    size: int
    head: tuple[str, ...]
    times: int
    markers: tuple[int, ...]
    span_s: float
    frame: str
    gaps: tuple[Gap, ...]


def export_preview(trial: Trial, to: str, ids: tuple[int, ...] | None = None) -> ExportPreview:
    """The export as it would be written now, written nowhere; raises as ``export`` does."""
    out = io.BytesIO()
    export(trial, to, out, ids)
    path = trial.trajectory
    if path is None:
        raise trial.need("reconstruct")
    path = only_markers(path, ids)
    if to in EVEN:
        path = even_part(path).trajectory
    text = out.getvalue()[:_HEAD].decode("utf-8", "replace").splitlines()[:LINES]
    kept = tuple(int(i) for i in path.ids)
    unseen = np.asarray(~np.isfinite(path.xyz_mm).all(axis=2))
    return ExportPreview(
        size=len(out.getvalue()),
        head=tuple(text) if to in TEXTS else (),
        times=path.t_s.size,
        markers=kept,
        span_s=float(path.t_s[-1] - path.t_s[0]),
        frame=path.frame,
        gaps=tuple(
            _gap(i, unseen[:, k], path.t_s) for k, i in enumerate(kept) if unseen[:, k].any()
        ),
    )


def _gap(marker: int, unseen: np.ndarray, t_s: np.ndarray) -> Gap:
    """Of unseen (N,) at times t_s (N,), s; a stretch lasts from the sample before to the next."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], unseen.astype(np.int8), [0]])))
    first, after = edges[::2], edges[1::2]
    start = t_s[np.maximum(first - 1, 0)]
    end = t_s[np.minimum(after, t_s.size - 1)]
    return Gap(marker, int(unseen.sum()), first.size, float((end - start).max()))
