"""Whether the stated ellipses hold the stated share: clean, compressed and correlated noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from olivevib.progress import Tick
from olivevib.studies.detection.canvas import Look, photo
from olivevib.studies.detection.readers import facts, ours
from olivevib.studies.detection.scenes import Cell, Develop, Score, fresh_noise, pooled
from olivevib.studies.detection.weather import demosaiced, jpeg, smoothed_noise
from olivevib.studies.study import Cell as Entry
from olivevib.studies.study import Effort, Goal, Study, Table

CELLS = ((24, 0), (24, 45), (32, 30), (48, 0), (48, 45), (48, 65), (64, 30), (64, 70), (96, 30))
NOISES: tuple[tuple[str, Develop, float], ...] = (
    ("white, 2", photo, 2.0),
    ("white, 0.5", photo, 0.5),
    ("white, 6", photo, 6.0),
    ("JPEG 90", jpeg(90), 2.0),
    ("JPEG 70", jpeg(70), 2.0),
    ("JPEG 50", jpeg(50), 2.0),
    ("demosaiced", demosaiced, 3.0),
    ("denoised", smoothed_noise, 3.0),
)
FITS = 1000
ASKED = (0.93, 0.97)


def run(effort: Effort, tick: Tick) -> Study:
    """Share of centres inside their own 95 % ellipse in every cell."""
    peer, fits = ours(), effort.count(FITS, 24)
    scores: dict[tuple[str, int, int], Score] = {}
    for n, (name, develop, noise) in enumerate(NOISES):
        for k, (size, tilt) in enumerate(CELLS):
            tick(n * len(CELLS) + k, len(NOISES) * len(CELLS), f"{name}: {size} px, {tilt} deg")
            cell = Cell(size, (tilt, tilt), replace(Look(), noise=noise), None, develop)
            scores[name, size, tilt] = fresh_noise(
                peer,
                cell,
                fits,
                lambda m, n=n, k=k: effort.draws(3, n, k, m),  # type: ignore[misc]
            )
    tick(1, 1, "honesty")
    rows: tuple[tuple[Entry, ...], ...] = tuple(
        (name, *(_percent(scores[name, s, t]) for s, t in CELLS), _percent(_all(scores, name)))
        for name, _, _ in NOISES
    )
    errors: tuple[tuple[Entry, ...], ...] = tuple(
        (name, *(round(scores[name, s, t].rmse_px, 5) for s, t in CELLS)) for name, _, _ in NOISES
    )
    heads = tuple(f"{s} px/{t} deg" for s, t in CELLS)
    return Study(
        name="detection-honesty",
        title="Whether stated ellipses hold what they state",
        tables=(
            Table("Centres inside their 95 % ellipse, %", ("noise", *heads, "all"), rows),
            Table("Error of the centre, rmse px", ("noise", *heads), errors),
        ),
        goals=_goals(scores, fits),
        facts=(*facts(), ("fits a cell, at least", str(fits))),
    )


def _percent(score: Score) -> float:
    return round(100 * score.inside, 1)


def _all(scores: dict[tuple[str, int, int], Score], name: str) -> Score:
    return pooled([score for (noise, _, _), score in scores.items() if noise == name])


def _goals(scores: dict[tuple[str, int, int], Score], fits: int) -> tuple[Goal, ...]:
    inside = {key: score.inside for key, score in scores.items()}
    low, high = min(inside, key=lambda k: inside[k]), max(inside, key=lambda k: inside[k])
    out = [k for k, share in inside.items() if not ASKED[0] <= share <= ASKED[1]]
    everything = pooled(list(scores.values()))
    text = [f"{100 * inside[k]:.1f} % ({k[0]}, {k[1]} px, {k[2]} deg)" for k in (low, high)]
    measured = f"{text[0]} to {text[1]}; {len(out)} of {len(inside)} cells outside"
    asked = "93 to 97 %"
    pool = everything.inside
    return (
        Goal("inside the 95 % ellipse, every cell", asked, measured, not out),
        Goal(
            "inside the 95 % ellipse, pooled",
            asked,
            f"{100 * pool:.2f} %",
            bool(ASKED[0] <= pool <= ASKED[1]),
        ),
        Goal(
            "more than 0.1 px off without a flag",
            "0",
            f"{everything.silent} of {int(everything.found.sum())}",
            everything.silent == 0,
        ),
        Goal(
            "flagged although clean",
            "0",
            f"{int(everything.flagged.sum())}",
            not np.any(everything.flagged),
        ),
    )
