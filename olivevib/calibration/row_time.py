"""The time between two sensor rows, from a lamp that flashes at a known frequency.

Each row of a rolling shutter looks at another moment, so a flashing lamp draws stripes: the light
at row v of frame n is b(v) cos(2 pi f (t_n + v t_row) + phase). The period of the stripes in rows
gives the row time, t_row = 1 / (f x rows a period); the way they travel from frame to frame gives
the readout direction. Source: knowledge of the field (sampling time, 6.1).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from olivevib.arrays import Floats, floats
from olivevib.errors import InputError

LEAST_STRIPES = 1.5  # periods over the picture's height
MOST_CYCLES = 0.45  # periods a row: above, rows cannot tell stripes from their mirror
LEAST_EXPLAINED = 0.3  # of what varies from frame to frame, by the stripes
LEAST_FRAMES = 8
PADDING = 8  # zeros added for the first search, in heights
BLOCKS = 10
FLOOR = 0.01  # what few stripes cost, as a share of the row time over their number squared
STANDING = 0.9
SURE = 0.3  # difference of both directions' agreement (-1 … 1) from which the sign is known


@dataclass(frozen=True)
class RowTime:
    """row_time_s: signed where ``sign_known``, else positive.

    sigma_s: scatter between blocks of frames, and what the unknown spread of the light costs where
    only few stripes fit into the picture (1 % over their number squared, found by simulation).
    stripes: periods over the picture; explained: their share of what changes between frames.
    """

    row_time_s: float
    sigma_s: float
    sign_known: bool
    stripes: float
    explained: float


def row_time_from_led(profiles: ArrayLike, t_s: ArrayLike, led_hz: float) -> RowTime:
    """Row time from the mean brightness of each raw row, (N, H), of N frames at times t_s (N,).

    led_hz: how often the lamp flashes a second. The stripes must travel (led_hz no multiple of the
    frame rate), so that they differ from what stands in the picture. Raises InputError where there
    are too few frames or no clear stripes.
    """
    rows = floats("profiles", profiles, (None, None))
    times = floats("t_s", t_s, (rows.shape[0],))
    if rows.shape[0] < LEAST_FRAMES:
        raise InputError(
            f"{rows.shape[0]} frames are too few for a row time.",
            f"At least {LEAST_FRAMES} are needed.",
            "Record a few seconds of the lamp.",
        )
    moving = _moving(rows)
    coarse = _coarse(moving)
    envelope = _envelope(moving, coarse)
    cycles = _refined(moving, envelope, coarse)
    explained = _explained(moving, envelope, cycles)
    stripes = cycles * rows.shape[1]
    phasors = _phasors(moving, envelope, cycles)
    if explained < LEAST_EXPLAINED or stripes < LEAST_STRIPES or _stands(phasors):
        raise _no_stripes(explained, stripes, led_hz)
    sign, known = _direction(phasors, times, led_hz)
    sigma = math.hypot(_sigma(moving, envelope, cycles), FLOOR * cycles / stripes**2)
    return RowTime(sign * cycles / led_hz, sigma / led_hz, known, stripes, explained)


def _moving(rows: Floats) -> Floats:
    """What changes from frame to frame (N, H) beside the brightness of the whole picture."""
    scene = rows.mean(axis=0)
    whole = rows @ scene / float(scene @ scene)
    out: Floats = rows - whole[:, None] * scene
    return out


def _envelope(moving: Floats, cycles: float) -> Floats:
    """How strong the stripes are at each row (H,), smoothed over one of their periods."""
    power = np.mean(moving**2, axis=0)
    box = np.ones(min(power.size, max(1, round(1.0 / cycles))))
    inside = np.convolve(np.ones(power.size), box, "same")
    out: Floats = np.sqrt(np.convolve(power, box, "same") / inside)
    return out


def _coarse(moving: Floats) -> float:
    """Periods a row of the strongest stripes, from the power summed over all frames."""
    height = moving.shape[1]
    window = np.hanning(height)
    power = np.zeros(PADDING * height // 2 + 1)
    for row in moving:
        power += np.abs(np.fft.rfft(row * window, PADDING * height)) ** 2
    cycles = np.fft.rfftfreq(PADDING * height)
    power[(cycles < 1.0 / height) | (cycles > MOST_CYCLES)] = 0.0
    return float(cycles[int(np.argmax(power))])


def _refined(moving: Floats, envelope: Floats, cycles: float) -> float:
    """Periods a row that explain most, near a first guess."""
    from scipy.optimize import minimize_scalar  # heavy: a report needs none

    near = 0.5 / moving.shape[1]
    found = minimize_scalar(
        lambda k: -_explained(moving, envelope, k),
        bounds=(max(1e-6, cycles - near), cycles + near),
        method="bounded",
        options={"xatol": 1e-9},
    )
    return float(found.x)


def _basis(envelope: Floats, cycles: float) -> Floats:
    """Cosine and sine of the stripes over the rows (2, H), without their mean."""
    turn = 2 * np.pi * cycles * np.arange(envelope.size)
    pair = envelope * np.array([np.cos(turn), np.sin(turn)])
    out: Floats = pair - pair.mean(axis=1, keepdims=True)
    return out


def _explained(moving: Floats, envelope: Floats, cycles: float) -> float:
    """Share of the variation that stripes of this period account for, each frame its own phase."""
    basis = _basis(envelope, cycles)
    along = moving @ basis.T
    solved = np.linalg.solve(basis @ basis.T, along.T)
    return float(np.sum(along.T * solved) / np.sum(moving**2))


def _phasors(moving: Floats, envelope: Floats, cycles: float) -> np.ndarray:
    """Complex amplitude (N,) of the stripes of each frame: cos(2 pi k v + its angle)."""
    basis = _basis(envelope, cycles)
    cosine, sine = np.linalg.solve(basis @ basis.T, basis @ moving.T)
    return np.asarray(cosine - 1j * sine)


def _stands(phasors: np.ndarray) -> bool:
    """True where the stripes do not travel: a pattern that grows and fades, or jumps to and fro."""
    return bool(abs(np.sum(phasors**2)) > STANDING * np.sum(np.abs(phasors) ** 2))


def _direction(phasors: np.ndarray, t_s: Floats, led_hz: float) -> tuple[float, bool]:
    """Which way the rows are read, from the turn of the phase between frames; and if it is sure.

    Read downward the phase gains 2 pi f dt from frame to frame, read upward it loses as much.
    """
    turn = 2 * np.pi * led_hz * np.diff(t_s)
    gained = phasors[1:] * np.conj(phasors[:-1])
    weight = float(np.sum(np.abs(gained)))
    down = float(np.sum((gained * np.exp(-1j * turn)).real)) / weight
    up = float(np.sum((gained * np.exp(1j * turn)).real)) / weight
    if abs(down - up) < SURE:
        return 1.0, False
    return (1.0 if down > up else -1.0), True


def _sigma(moving: Floats, envelope: Floats, cycles: float) -> float:
    """Scatter of the periods a row between blocks of frames, for all of them together."""
    blocks = [b for b in np.array_split(np.arange(len(moving)), BLOCKS) if b.size]
    found = [_refined(moving[b], envelope, cycles) for b in blocks]
    return float(np.std(found, ddof=1)) / math.sqrt(len(found))


def _no_stripes(explained: float, stripes: float, led_hz: float) -> InputError:
    if stripes < LEAST_STRIPES and explained >= LEAST_EXPLAINED:
        why = f"Only {stripes:.1f} stripes fit into the picture."
        return InputError(
            "the stripes are too wide for a row time.",
            why,
            f"Flash faster than {led_hz:g} Hz. A global shutter draws no stripes at all.",
        )
    return InputError(
        "the recording shows no stripes that travel.",
        f"Stripes account for {explained:.0%} of what changes from frame to frame.",
        "Let the lamp fill the picture (paper before the lens), expose for less than half a flash, "
        "and choose a frequency that is no multiple of the frame rate. A global shutter has none.",
    )
