"""The verdict of a trial in three plain sentences: what was seen, how it moves, what to trust."""

from __future__ import annotations

import numpy as np

from olivevib.comparison import Verdict
from olivevib.report.clean import clean
from olivevib.report.content import ReportContent
from olivevib.report.lines import KNOWN, MEANING, MOST, OPEN, candidates_text, describe
from olivevib.report.tables import candidate_accelerations
from olivevib.report.words import count, measure, number, percent, triple
from olivevib.values import listed
from olivevib.vibration import largest
from olivevib.vibration.types import Line, LineStatus

LARGEST = "peak, along the long axis of its orbit"
AXES = "x\u00a0/\u00a0y\u00a0/\u00a0z"
_REASON = {
    LineStatus.BLIND: "the line looks like slow sway at this frame rate",
    LineStatus.CHIRP: "the speed changes too fast for a line",
}
_AGREEMENT = {
    Verdict.AGREES: "camera and accelerometer agree",
    Verdict.DIFFERS: "camera and accelerometer differ",
    Verdict.UNDECIDED: "whether camera and accelerometer agree is undecided",
    Verdict.NO_OVERLAP: "camera and accelerometer recorded no common stretch of time",
}


def verdict(content: ReportContent) -> tuple[str, ...]:
    """Three sentences; each says what is not known rather than leaving it out.

    Where a stage has failed, or what is shown is not of the trial as it is now, that comes first.
    """
    told = (_seen(content), _vibration(content), _trust(content))
    trouble = _trouble(content)
    return (trouble, *told) if trouble else told


def _trouble(content: ReportContent) -> str:
    """What has failed, cannot be read or is out of date; empty where all is in order."""
    parts = []
    unread = sum(c.code == "file-damaged" for c in content.cautions)
    if unread:
        parts.append(f"{count(unread, 'file')} of this trial cannot be read and is left out below")
    stages = content.summary.get("stages") or {}
    for state, (one, several) in _STATES.items():
        found = [name for name, told in stages.items() if (told or {}).get("state") == state]
        if found:
            reason = clean((stages[found[0]] or {}).get("reason") or "", 300).rstrip(".")
            words = f"{listed(found)} {one if len(found) == 1 else several}"
            parts.append(words + (f" ({reason})" if reason else ""))
    return f"Mind this first: {'; '.join(parts)}." if parts else ""


_MADE = "up to date: what is shown was made from other files or settings"
_STATES = {  # of one stage, of several
    "failed": ("failed", "failed"),
    "blocked": ("could not run", "could not run"),
    "stale": (f"is not {_MADE}", f"are not {_MADE}"),
    "missing": ("has not run", "have not run"),
}


def _seen(content: ReportContent) -> str:
    path = content.trajectory
    if path is None or not path.seen.any():
        return "No marker has been located in space yet."
    found = path.seen.any(axis=0)
    told = {m["id"]: m["seen_fraction"] for m in content.summary.get("markers") or []}
    each = zip(path.ids[found].tolist(), path.seen[:, found].mean(axis=0), strict=True)
    shares = np.array([told.get(i, share) for i, share in each])
    sigma = np.nanmedian(path.sigma_xyz_mm[path.seen], axis=0)
    known = triple(sigma, "mm")
    span = measure(path.t_s[-1] - path.t_s[0], "s", digits=3)
    if shares.min() == 1:
        often = "every one in every frame"
    else:
        often = (
            f"a typical one in {percent(float(np.median(shares)))} of the frames,"
            f" the worst in {percent(float(shares.min()))}"
        )
    were = "was" if found.sum() == 1 else "were"
    return (
        f"{count(int(found.sum()), 'marker')} {were} located in space over {span}"
        f" ({count(content.frames, 'frame')}), {often}; a position is known to {known}"
        f" ({AXES}, one standard deviation)."
    )


def strongest(content: ReportContent) -> tuple[int, Line] | None:
    """The marker whose line has the largest amplitude in any direction, and that line."""
    lines = {
        i: line
        for i, line in content.lines().items()
        if np.isfinite(line.amplitude).all() and line.status in (*KNOWN, *OPEN)
    }
    if not lines:
        return None
    best = max(lines, key=lambda i: largest(lines[i])[0])
    return best, lines[best]


def _vibration(content: ReportContent) -> str:
    if not content.lines():
        return "Its vibration has not been analysed yet."
    found = strongest(content)
    if found is None:
        return _without_amplitude(content)
    marker_id, line = found
    name = content.marker_name(marker_id)
    moves = f"by {measure(largest(line)[0], 'mm', largest(line)[1])} ({LARGEST})"
    if line.status in OPEN and line.candidates_hz:
        either = candidates_text(line.candidates_hz, line.probabilities)
        rms = candidate_accelerations(content, marker_id)[:MOST]
        shake = " or ".join(number(a, 3) for _, a, _ in rms)
        return (
            f"Marker {name} moves most, {moves}, but its frequency is {line.status}: {either}"
            " all give these pictures"
            + (f", so its acceleration is {shake} m/s² rms" if shake else "")
            + "; nothing here decides which."
        )
    others = [other.status for i, other in content.lines().items() if i != marker_id]
    same = sum(status is line.status for status in others)
    rest = f"; {same} of the {len(others)} others are {line.status} too" if others else ""
    if others and same == len(others):
        rest = f"; all others are {line.status} too"
    return f"Marker {name} moves most, {moves}, at {describe(line)}{rest}."


def _without_amplitude(content: ReportContent) -> str:
    """What is said where no marker has a line with an amplitude."""
    lines = list(content.lines().values())
    statuses = [line.status for line in lines if line.status is not LineStatus.NONE]
    if not statuses:
        return "No vibration line stands out of the noise at any marker."
    most = max(dict.fromkeys(statuses), key=statuses.count)
    return (
        f"No amplitude can be given: at {statuses.count(most)} of {count(len(lines), 'marker')}"
        f" {_REASON.get(most, MEANING[most])} ({most})."
    )


def _trust(content: ReportContent) -> str:
    calibration = content.summary.get("calibration") or {}
    mm, share = calibration.get("holdout_rms_mm"), calibration.get("holdout_rms_percent")
    parts = []
    if mm is None and share is None:
        parts.append("How well the calibration measures distances is not known")
    else:
        parts.append(
            "Distances on calibration views that the fit never saw are right to"
            f" {measure(mm, 'mm', digits=2)} ({measure(share, '%', digits=2)}) rms"
        )
    if not content.comparisons:
        parts.append("there is no accelerometer to compare with")
    else:
        verdicts = dict.fromkeys(c.verdict for c in content.comparisons)
        old = ((content.summary.get("stages") or {}).get("compare") or {}).get("old")
        but = f", but these numbers {clean(old, 300)}" if old else ""
        parts.append(", ".join(_AGREEMENT[v] for v in verdicts) + but)
    n = len(content.cautions)
    if n:
        parts.append(f"{count(n, 'warning')} to read below")
    elif _trouble(content):
        parts.append("what did not run could raise no warning")
    else:
        parts.append("no warning was raised")
    return "; ".join(parts) + "."
