"""Corner tracks in time: where a camera would have seen each board point at another instant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Bools, Floats, Ints
from olivevib.calibration.views import BoardView, frame_period_s, times

LONGEST_GAP_S = 0.4  # across longer gaps nobody knows how the hand moved
LONGEST_GAP_PERIODS = 2.5
ORDERS = (2, 4, 6)  # samples through which a track is drawn: as many as are near
DISAGREEMENT = 0.3  # share of the difference to the next lower order taken as error


@dataclass(frozen=True)
class Samples:
    """All points of all views of one camera, sorted by point id, then time: rows of one table."""

    id: Ints
    t_s: Floats
    px: Floats
    sigma_px: Floats
    period_s: float


@dataclass(frozen=True)
class Local:
    """A point's motion about a query instant: px(dt) = sum coefficient_k dt^k, dt in s.

    ok (Q,): whether the instant lies within half a period of samples that are close enough;
    coefficients (Q, 6, 2) px/s^k; sigma_px (Q,) with the error of the interpolation;
    velocity_sigma (Q,) px/s of each axis.
    """

    ok: Bools
    coefficients: Floats
    sigma_px: Floats
    velocity_sigma: Floats

    @property
    def velocity(self) -> Floats:
        """Velocity (Q, 2) at the query instant, px/s."""
        return self.coefficients[:, 1]


def tabulate(
    views: Sequence[BoardView], row_time_s: float = 0.0, reference_row: float = 0.0
) -> Samples:
    """The samples of stamped views; the row time moves each point to its own instant."""
    stamps = times(views)
    counts = [view.ids.size for view in views]
    ids = np.concatenate([view.ids for view in views])
    px = np.concatenate([view.px for view in views])
    t = np.repeat(stamps, counts) + row_time_s * (px[:, 1] - reference_row)
    sigma = np.concatenate([view.sigma_px for view in views])
    order = np.lexsort((t, ids))
    return Samples(ids[order], t[order], px[order], sigma[order], frame_period_s(stamps))


def motion_at(samples: Samples, ids: Ints, t_s: Floats) -> Local:
    """Each point ``ids`` (Q,) at the instants ``t_s`` (Q,): a polynomial through its neighbours.

    Six, four or two samples, as many as are near on both sides; within half a period beyond the
    last of two near samples the line is prolonged; else not ok.
    """
    index, good = _stencil(samples, ids, t_s)
    nodes, px = samples.t_s[index] - t_s[:, None], samples.px[index]
    coefficients = np.zeros((ids.size, ORDERS[-1], 2))
    error, usable = np.zeros(ids.size), np.zeros(ids.size, dtype=np.int64)
    gain = np.zeros(ids.size)
    for order in ORDERS:
        part = slice(ORDERS[-1] // 2 - order // 2, ORDERS[-1] // 2 + order // 2)
        use = good[:, part].all(axis=1)
        finer, gain[use] = _interpolate(nodes[use, part], px[use, part])
        error[use] = np.linalg.norm(finer[:, 0] - coefficients[use, 0], axis=1)
        coefficients[use] = 0.0
        coefficients[use, :order] = finer
        usable[use] = order
    middle = ORDERS[-1] // 2 - 1
    before, after = -nodes[:, middle], nodes[:, middle + 1]
    share = np.clip(before / np.maximum(before + after, 1e-12), 0, 1)
    outside = np.maximum(np.maximum(-before, -after), 0.0) / samples.period_s
    blind = np.linalg.norm(coefficients[:, 1], axis=1) * samples.period_s
    error = np.where(
        usable > ORDERS[0], DISAGREEMENT * error, 0.1 * blind * (share * (1 - share) + outside)
    )
    sigma = samples.sigma_px[index]
    noise = np.hypot((1 - share) * sigma[:, middle], share * sigma[:, middle + 1])
    return Local(usable > 0, coefficients, np.hypot(noise, error), gain * sigma[:, middle])


def _stencil(samples: Samples, ids: Ints, t_s: Floats) -> tuple[Ints, Bools]:
    """Rows (Q, 6) of the neighbours of each query, and which of them are near enough.

    The two in the middle bracket the instant, or are the first or last two samples of the point.
    """
    first = np.searchsorted(samples.id, ids, side="left")
    last = np.searchsorted(samples.id, ids, side="right") - 1
    low, span = float(samples.t_s.min()), float(np.ptp(samples.t_s)) + 2.0
    key = samples.id * span + (samples.t_s - low)
    before = np.searchsorted(key, ids * span + np.clip(t_s - low, -0.5, span - 1.5), "right") - 1
    lower = np.clip(before, first, np.maximum(last - 1, first))
    half = ORDERS[-1] // 2
    index = lower[:, None] + np.arange(1 - half, 1 + half)
    same = (index >= first[:, None]) & (index <= last[:, None])
    index = np.clip(index, 0, samples.id.size - 1)
    t = samples.t_s[index]
    near = np.diff(t, axis=1) <= min(LONGEST_GAP_S, LONGEST_GAP_PERIODS * samples.period_s)
    outside = np.maximum(t[:, half - 1] - t_s, t_s - t[:, half])
    good = same.copy()
    good[:, half - 1 : half + 1] &= (near[:, half - 1] & (outside <= 0.5 * samples.period_s))[
        :, None
    ]
    good[:, half - 1] &= same[:, half]
    good[:, half] &= same[:, half - 1]
    for k in range(half - 2, -1, -1):
        good[:, k] &= good[:, k + 1] & near[:, k] & (outside <= 0)
        good[:, -1 - k] &= good[:, -2 - k] & near[:, -1 - k] & (outside <= 0)
    return index, good


def _interpolate(nodes: Floats, px: Floats) -> tuple[Floats, Floats]:
    """Coefficients (Q, m, 2) in s through m samples (Q, m, 2) at ``nodes`` (Q, m).

    And by how much (Q,) the noise of one sample is felt in the velocity, 1/s.
    """
    unit = np.maximum(np.abs(nodes).max(axis=1, initial=0.0), 1e-9)[:, None]
    powers = np.arange(nodes.shape[1])
    scaled = (nodes / unit)[:, :, None] ** powers
    apart = np.diff(nodes, axis=1).min(axis=1, initial=np.inf) > 1e-4 * unit[:, 0]
    scaled[~apart] = np.eye(nodes.shape[1])
    back = np.linalg.inv(scaled) / (unit**powers)[:, :, None]
    gain = np.sqrt((back[:, 1] ** 2).sum(axis=1))
    return np.asarray(back @ px, dtype=np.float64), np.asarray(gain, dtype=np.float64)


def polynomial(c: Floats, dt: Floats) -> tuple[Floats, Floats]:
    """Value and derivative (N, 2) at ``dt`` (N,) of polynomials with coefficients (N, m, 2)."""
    value, slope = c[:, -1].copy(), np.zeros_like(c[:, 0])
    for k in range(c.shape[1] - 2, -1, -1):
        slope = slope * dt[:, None] + value
        value = value * dt[:, None] + c[:, k]
    return value, slope


def shifted(c: Floats, by_s: Floats) -> Floats:
    """The polynomials (N, m, 2) in dt that equal those of ``c`` in (dt - by_s), by_s (N,)."""
    out, by = np.zeros_like(c), by_s[:, None]
    for k in range(c.shape[1] - 1, -1, -1):  # Horner: out * (dt - by_s) + c_k
        out[:, 1:] = out[:, :-1] - by[:, None] * out[:, 1:]
        out[:, 0] = c[:, k] - by * out[:, 0]
    return out


def at_rest(local: Local, view: Ints) -> Bools:
    """Points (Q,) of views whose motion cannot be told from the noise of their pixels.

    ``view`` (Q,) numbers the views. Noise taken for motion would pretend to know the lag.
    """
    noise = 2 * np.maximum(local.velocity_sigma, 1e-30) ** 2
    ratio = np.where(local.ok, (local.velocity**2).sum(axis=1) / noise, 0.0)
    count = np.maximum(np.bincount(view, local.ok), 1)
    mean = np.bincount(view, ratio) / count
    return np.asarray((mean < np.maximum(2.0, 1 + 4 / np.sqrt(count)))[view], dtype=np.bool_)


def speeds(views: Sequence[BoardView]) -> Floats:
    """How fast the board's image moves in each stamped view (V,), px/s (NaN: unknown)."""
    samples, out = tabulate(views), np.full(len(views), np.nan)
    for k, view in enumerate(views):
        local = motion_at(samples, view.ids, np.full(view.ids.size, view.t_s))
        if local.ok.any():
            out[k] = float(np.median(np.linalg.norm(local.velocity[local.ok], axis=1)))
    return out
