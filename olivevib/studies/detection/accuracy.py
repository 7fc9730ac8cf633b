"""How far off centres are: against the Cramér-Rao bound and the peers, fresh noise every time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Floats
from olivevib.progress import Tick
from olivevib.studies.detection.bound import centre_bound_px
from olivevib.studies.detection.canvas import Look
from olivevib.studies.detection.readers import Peer, everyone, facts
from olivevib.studies.detection.scenes import (
    Cell,
    Score,
    fresh_noise,
    pooled,
    single,
    window_px,
)
from olivevib.studies.study import Chart, Curve, Effort, Goal, Study, Table

SIZES_PX = (24, 32, 48, 64, 96)
TILTS_DEG = (0, 30, 45, 60, 70)
PSF_PX = (0.4, 0.7, 1.0, 1.5)
PSF_CELLS = ((32, 30), (48, 30), (64, 45))
FITS = 1000
BOUND_POSES = 8  # over which a cell's bound is averaged
FINE, COARSE = 1.5, 1.0  # px a module: where 1.10 and where 1.3 times the bound are asked


@dataclass(frozen=True)
class Row:
    """One cell: what was drawn, its bound, and each detector's score."""

    cell: Cell
    bound_px: float
    scores: dict[str, Score]

    @property
    def ratio(self) -> float:
        """Our RMSE over the bound."""
        return self.scores["olivevib"].rmse_px / self.bound_px

    @property
    def q(self) -> float:
        """Foreshortened module of ours, px."""
        return self.cell.modules_px(11)


def run(effort: Effort, tick: Tick) -> Study:
    """RMSE over bound by size and tilt, and with point spreads that the detector is not told."""
    peers = everyone()
    plain = [
        Cell(s, (t, t))
        for s in SIZES_PX
        for t in TILTS_DEG
        if s * np.cos(np.radians(t)) / 11 >= COARSE
    ]
    blurred = [Cell(s, (t, t), replace(Look(), psf_px=psf)) for s, t in PSF_CELLS for psf in PSF_PX]
    fits = effort.count(FITS, 20)
    rows = []
    for k, cell in enumerate([*plain, *blurred]):
        tick(k, len(plain) + len(blurred), f"{cell.size_px:g} px, {cell.tilt_deg[0]:g} deg")
        rows.append(_row(peers, cell, fits, effort, k))
    tick(1, 1, "accuracy")
    even, unknown = rows[: len(plain)], rows[len(plain) :]
    return Study(
        name="detection-accuracy",
        title="Centres against the Cramér-Rao bound and the peers",
        tables=(
            _table("Point spread 0.7 px", even),
            _table("Other point spreads", unknown),
        ),
        charts=(_chart(even),),
        goals=_goals(even, unknown),
        facts=(
            *facts(),
            ("fits a cell, at least", str(fits)),
            ("poses for a bound", str(BOUND_POSES)),
        ),
    )


def _row(peers: list[Peer], cell: Cell, fits: int, effort: Effort, k: int) -> Row:
    scores = {
        peer.name: fresh_noise(peer, cell, fits, lambda n: effort.draws(2, k, n)) for peer in peers
    }
    bounds = []
    for n in range(min(BOUND_POSES, max(2, fits // 25))):
        _, marker, H = single(peers[0], cell, effort.draws(2, k, n))
        size = (window_px(cell), window_px(cell))
        look = replace(cell.look, samples=3)
        bounds.append(centre_bound_px(peers[0].prints[marker], H, look, size))
    return Row(cell, float(np.sqrt(np.mean(np.square(bounds)))), scores)


def _table(title: str, rows: list[Row]) -> Table:
    names = list(rows[0].scores)
    columns = (
        *("size, px", "tilt, deg", "PSF, px", "px a module", "bound, px", "rmse / bound"),
        *(f"{name}, px" for name in names),
        *("found, %", "inside 95 %, %", "silent > 0.1 px"),
    )
    cells = tuple(
        (
            row.cell.size_px,
            row.cell.tilt_deg[0],
            row.cell.look.psf_px,
            round(row.q, 2),
            round(row.bound_px, 5),
            round(row.ratio, 3),
            *(round(row.scores[name].rmse_px, 5) for name in names),
            round(100 * row.scores["olivevib"].share, 1),
            round(100 * row.scores["olivevib"].inside, 1),
            row.scores["olivevib"].silent,
        )
        for row in rows
    )
    note = "RMSE per axis. An aruco or AprilTag centre counts where its id is right within 3 px."
    return Table(title, columns, cells, note)


def _chart(rows: list[Row]) -> Chart:
    names = [*rows[0].scores, "bound"]
    mine = [row for row in rows if row.cell.size_px == 48]
    tilts = np.array([row.cell.tilt_deg[0] for row in mine], dtype=np.float64)
    curves = tuple(
        Curve(
            name,
            tilts,
            np.array(
                [row.bound_px if name == "bound" else row.scores[name].rmse_px for row in mine]
            ),
        )
        for name in names
    )
    return Chart("48px", "Error of the centre, 48 px", "tilt, deg", "rmse, px", curves, log_y=True)


def _curve(rows: list[Row], name: str) -> Floats:
    both = [row.bound_px if name == "bound" else row.scores[name].rmse_px for row in rows]
    return np.array(both)


def _goals(even: list[Row], unknown: list[Row]) -> tuple[Goal, ...]:
    parts = [
        (f"rmse / bound at >= {FINE} px a module", 1.10, [r for r in even if r.q >= FINE]),
        (f"rmse / bound down to {COARSE} px", 1.3, [r for r in even if COARSE <= r.q < FINE]),
        ("rmse / bound, unknown PSF 0.4 to 1.5 px", 1.3, unknown),
    ]
    goals = []
    for name, asked, rows in parts:
        worst = max(rows, key=lambda row: row.ratio)
        where = f"{worst.cell.size_px:g} px, {worst.cell.tilt_deg[0]:g} deg"
        pool = np.sqrt(np.mean([row.ratio**2 for row in rows]))
        measured = f"worst cell {worst.ratio:.3f} ({where}); all cells {pool:.3f}"
        goals.append(Goal(name, f"<= {asked}", measured, worst.ratio <= asked))
    for peer, share in (("AprilTag 3", 3), ("aruco subpix", 10)):
        known = [r for r in [*even, *unknown] if np.isfinite(r.scores[peer].rmse_px)]
        least = min(known, key=lambda r, p=peer: _gain(r, p))  # type: ignore[misc]
        where = f"{least.cell.size_px:g} px, {least.cell.tilt_deg[0]:g} deg"
        where += f", PSF {least.cell.look.psf_px:g}"
        gains = [_gain(r, peer) for r in known]
        measured = f"1/{min(gains):.1f} ({where}) to 1/{max(gains):.0f}"
        goals.append(
            Goal(f"rmse against {peer}, every cell", f"<= 1/{share}", measured, min(gains) >= share)
        )
    everything = pooled([row.scores["olivevib"] for row in [*even, *unknown]])
    goals.append(
        Goal(
            "more than 0.1 px off without a flag",
            "0",
            f"{everything.silent} of {everything.drawn}",
            everything.silent == 0,
        )
    )
    return tuple(goals)


def _gain(row: Row, peer: str) -> float:
    return row.scores[peer].rmse_px / row.scores["olivevib"].rmse_px
