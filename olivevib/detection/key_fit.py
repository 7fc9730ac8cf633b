"""Fitting keys to one frame: all markers at once, arrays over markers and pixels.

Gauss-Newton as in ``refine``: two passes on a quarter of the pixels, then all pixels until nothing
moves. A marker that is covered, in uneven light or too far from its key says so; it is then fitted
by itself with everything that this asks for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Bools, Floats, Grey
from olivevib.detection.key import GEOMETRY, LIGHT, Key, seen_through
from olivevib.detection.pixels import Singles
from olivevib.detection.refine import CLEAR, LEAST_GAIN, MOVED_PX, middle

UNKNOWNS = GEOMETRY + LIGHT + 1
COARSE_PASSES, FULL_PASSES = 2, 3
TOGETHER = 24000  # pixels of all keys of a batch: their Jacobian stays in the cache
Shifts: TypeAlias = NDArray[np.intp]


@dataclass(frozen=True)
class KeyFits:
    """What was found of each of M keys.

    W (M, 3, 3): homography from image, moved back by the shift, to key, normalised coordinates;
    covariance (M, 8, 8) of its first eight entries; gain, rms (M,) grey levels; further (M,) px²
    of blur beyond the key's; weight, cell (M,): mean robust weight, least of a ninth; ncc (M,):
    correlation with the drawing on the whole marker; converged (M,).
    """

    W: Floats
    covariance: Floats
    gain: Floats
    rms: Floats
    further: Floats
    weight: Floats
    cell: Floats
    ncc: Floats
    converged: Bools


class KeyBatch:
    """Keys side by side, padded to the longest: X, Y, used (M, N); made once for many frames."""

    def __init__(self, keys: Sequence[Key]) -> None:
        self.keys = tuple(keys)
        self.full = _Stack([(k, np.arange(k.x.size)) for k in keys])
        self.coarse = _Stack([(k, k.coarse) for k in keys])
        self.cells = np.zeros((len(keys), 9, self.full.X.shape[1]), np.float32)
        for row, key in zip(self.cells, keys, strict=True):
            row[:, : key.x.size] = key.cells


def batches_of(keys: Sequence[Key]) -> list[KeyBatch]:
    """Keys in their order, as many together as the cache holds."""
    out: list[list[Key]] = [[]]
    for key in keys:
        if out[-1] and (len(out[-1]) + 1) * max(k.x.size for k in (*out[-1], key)) > TOGETHER:
            out.append([])
        out[-1].append(key)
    return [KeyBatch(part) for part in out if part]


class _Stack:
    """Some pixels of each key as padded arrays."""

    def __init__(self, parts: Sequence[tuple[Key, NDArray[np.intp]]]) -> None:
        n, m = max(at.size for _, at in parts), len(parts)
        self.x, self.y = np.zeros((m, n), np.intp), np.zeros((m, n), np.intp)
        self.X, self.Y, self.used, self.area = (np.zeros((m, n), np.float32) for _ in range(4))
        for k, (key, at) in enumerate(parts):
            size = at.size
            self.x[k, :size], self.y[k, :size] = key.x[at], key.y[at]
            self.x[k, size:], self.y[k, size:] = key.x[0], key.y[0]
            self.X[k, :size], self.Y[k, :size] = key.X[at], key.Y[at]
            self.used[k, :size] = 1
            self.area[k, :size] = key.area[at]
        self.count = self.used.sum(axis=1)
        keys = [key for key, _ in parts]
        self.textures = [key.template.texture for key in keys]
        self.scale = np.array([key.scale for key in keys])
        samples = np.array([key.template.samples for key in keys])
        self.step = (self.scale * samples).astype(np.float32)[:, None]
        variances = [key.template.blur.variance_px2 for key in keys]
        self.spread = (np.array(variances) / self.scale).astype(np.float32)[:, None]
        offset = [(k.centre - k.template.origin_px) * k.template.samples for k in keys]
        self.offset = np.array(offset, np.float32)[:, :, None]

    def levels(self, grey: Grey, shifts: Shifts) -> Singles:
        """Grey levels (M, N) of the pixels moved by ``shifts`` (M, 2), which lie in the image."""
        flat = (self.y + shifts[:, 1:]) * grey.shape[1] + (self.x + shifts[:, :1])
        out: Singles = grey.ravel().take(flat).astype(np.float32)
        return out


@dataclass
class _State:
    """Unknowns: W (M, 3, 3), light (M, 6), further (M,)."""

    W: Floats
    light: Floats
    further: Floats


@dataclass(frozen=True)
class _Reads:
    """Texture channels (4, M, N) through W, numerators u, v and 1/w of W at the pixels."""

    texture: Singles
    u: Singles
    v: Singles
    back: Singles


def fit_keys(grey: Grey, batches: Sequence[KeyBatch], shifts: Shifts, W: Floats) -> KeyFits:
    """Fit every key of the batches, moved by whole pixels ``shifts`` (M, 2), from W (M, 3, 3)."""
    ends = np.cumsum([len(batch.keys) for batch in batches])[:-1]
    parts = zip(batches, np.split(shifts, ends), np.split(W, ends), strict=True)
    fits = [_fit_batch(grey, *part) for part in parts]
    names = [f.name for f in fields(KeyFits)]
    return KeyFits(**{name: np.concatenate([getattr(f, name) for f in fits]) for name in names})


def _fit_batch(grey: Grey, batch: KeyBatch, shifts: Shifts, W: Floats) -> KeyFits:
    m = len(batch.keys)
    state = _State(W.copy(), np.zeros((m, LIGHT)), np.zeros(m))
    level = batch.coarse.levels(grey, shifts)
    reads = _read(batch.coarse, state.W)
    state.light = _light(batch.coarse, level, reads.texture[0])
    for step in range(COARSE_PASSES):
        one = _Pass(batch.coarse, reads, level, state, robust=step > 0)
        _add(state, one.change)
        if step + 1 < COARSE_PASSES:
            reads = _read(batch.coarse, state.W)
    level = batch.full.levels(grey, shifts)
    for _ in range(FULL_PASSES):
        one = _Pass(batch.full, _read(batch.full, state.W), level, state, robust=True)
        _add(state, one.change)
        moved = np.abs(one.change[:, :GEOMETRY]).max(axis=1) * batch.full.scale
        settled: Bools = moved < MOVED_PX
        if settled.all():
            break
    return _result(batch, level, state, one, settled)


class _Pass:
    """One linearised system of each marker and the change (M, 15) that follows.

    J (M, 15, N): Jacobian; residual, weight (M, N).
    """

    def __init__(
        self, stack: _Stack, reads: _Reads, level: Singles, state: _State, robust: bool
    ) -> None:
        X, Y = stack.X, stack.Y
        light = state.light.astype(np.float32)[:, :, None]
        gain = light[:, 3] + light[:, 4] * X + light[:, 5] * Y
        further = state.further.astype(np.float32)[:, None]
        texture = reads.texture
        self.T = texture[0] + further * texture[3]
        ground = light[:, 0] + light[:, 1] * X + light[:, 2] * Y
        self.residual = level - ground - gain * self.T
        self.residual -= stack.spread * (light[:, 4] * texture[1] + light[:, 5] * texture[2])
        self.J = _jacobian(stack, reads, gain, self.T)
        self.weight = stack.used
        if robust:
            self.weight = stack.used * _tukey(self.residual, state.light[:, 3], stack)
        WJ = self.J * self.weight[:, None]
        A = (WJ @ self.J.transpose(0, 2, 1)).astype(np.float64)
        A[:, np.arange(UNKNOWNS), np.arange(UNKNOWNS)] *= 1 + 1e-7
        A[:, np.arange(UNKNOWNS), np.arange(UNKNOWNS)] += 1e-9
        self.A = A
        b = (WJ @ self.residual[:, :, None]).astype(np.float64)
        self.change: Floats = np.linalg.solve(A, b)[:, :, 0]


def _jacobian(stack: _Stack, reads: _Reads, gain: Singles, T: Singles) -> Singles:
    X, Y = stack.X, stack.Y
    bend = gain * reads.back
    bend *= stack.scale.astype(np.float32)[:, None]
    p, q = bend * reads.texture[1], bend * reads.texture[2]
    back = reads.u * p
    back += reads.v * q
    back *= -reads.back
    J = np.empty((len(X), UNKNOWNS, X.shape[1]), np.float32)
    for k, part in enumerate((p, q)):
        np.multiply(part, X, out=J[:, 3 * k])
        np.multiply(part, Y, out=J[:, 3 * k + 1])
        J[:, 3 * k + 2] = part
    np.multiply(back, X, out=J[:, 6])
    np.multiply(back, Y, out=J[:, 7])
    J[:, 8], J[:, 9], J[:, 10], J[:, 11] = 1, X, Y, T
    np.multiply(X, T, out=J[:, 12])
    np.multiply(Y, T, out=J[:, 13])
    J[:, 12] += stack.spread * reads.texture[1]  # light falls on the marker before the blur
    J[:, 13] += stack.spread * reads.texture[2]
    np.multiply(gain, reads.texture[3], out=J[:, 14])
    return J


def _read(stack: _Stack, W: Floats) -> _Reads:
    M = W.astype(np.float32)[:, :, :, None]
    X, Y = stack.X, stack.Y
    back: Singles = np.float32(1) / (M[:, 2, 0] * X + M[:, 2, 1] * Y + M[:, 2, 2])
    u = M[:, 0, 0] * X + M[:, 0, 1] * Y + M[:, 0, 2]
    v = M[:, 1, 0] * X + M[:, 1, 1] * Y + M[:, 1, 2]
    x = u * back * stack.step + stack.offset[:, 0]
    y = v * back * stack.step + stack.offset[:, 1]
    out = np.empty((4, *X.shape), np.float32)
    for k, texture in enumerate(stack.textures):
        read = cv2.remap(
            texture, x[k : k + 1], y[k : k + 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
        out[:, k] = read[0].T
    return _Reads(out, u, v, back)


def _light(stack: _Stack, level: Singles, T: Singles) -> Floats:
    """Planes of dark level and contrast (M, 6) by linear least squares."""
    used, X, Y = stack.used, stack.X, stack.Y
    J = np.stack([used, X, Y, T * used, X * T, Y * T], axis=1)
    A = (J @ J.transpose(0, 2, 1)).astype(np.float64) + 1e-3 * np.eye(LIGHT)
    return np.asarray(np.linalg.solve(A, (J @ level[:, :, None]).astype(np.float64))[:, :, 0])


def _tukey(residual: Singles, gain: Floats, stack: _Stack) -> Singles:
    """Weights (1 - (r / 3k)²)², k = max(.12 gain, 1.3 rms of the inner residuals)."""
    size = np.abs(residual)
    inner = np.array([middle(row[: int(n)]) for row, n in zip(size, stack.count, strict=True)])
    limit = 3 * np.maximum(0.12 * gain, 1.3 * 1.4826 * inner).astype(np.float32)
    u = np.minimum(size / np.maximum(limit, 1e-3)[:, None], np.float32(1))
    np.multiply(u, u, out=u)
    np.subtract(1, u, out=u)
    np.multiply(u, u, out=u)
    return u


def _add(state: _State, change: Floats) -> None:
    W = state.W.reshape(-1, 9).copy()
    W[:, :GEOMETRY] += change[:, :GEOMETRY]
    state.W = W.reshape(-1, 3, 3)
    state.light = state.light + change[:, GEOMETRY : GEOMETRY + LIGHT]
    state.further = state.further + change[:, -1]


def _result(batch: KeyBatch, level: Singles, state: _State, last: _Pass, settled: Bools) -> KeyFits:
    area = batch.full.area
    total = area.sum(axis=1)
    change = last.change.astype(np.float32)[:, None]
    clear = (last.weight > CLEAR) * area
    residual = last.residual - (change @ last.J)[:, 0]
    freedom = np.maximum(clear.sum(axis=1) - UNKNOWNS, 1)
    rms = np.sqrt((residual * residual * clear).sum(axis=1) / freedom).astype(np.float64)
    good = settled & np.isfinite(state.W).all(axis=(1, 2)) & (state.light[:, 3] > LEAST_GAIN)
    inverse = np.linalg.inv(np.where(good[:, None, None], last.A, np.eye(UNKNOWNS)))
    return KeyFits(
        W=np.stack([seen_through(*of) for of in zip(batch.keys, state.W, strict=True)]),
        covariance=np.stack(
            [
                _covariance(*of)
                for of in zip(batch.keys, inverse, state.light[:, 3], rms, strict=True)
            ]
        ),
        gain=state.light[:, 3],
        rms=rms,
        further=state.further,
        weight=((last.weight * area).sum(axis=1) / total).astype(np.float64),
        cell=(batch.cells @ last.weight[:, :, None])[:, :, 0].min(axis=1).astype(np.float64),
        ncc=_correlation(last.T, level, area, total),
        converged=good,
    )


def _covariance(key: Key, inverse: Floats, gain: float, rms: float) -> Floats:
    """Covariance (8, 8): A⁻¹ for white noise; A⁻¹ J R J' A⁻¹ where neighbours' noise agrees."""
    if key.spread is None:
        white: Floats = rms**2 * inverse[:GEOMETRY, :GEOMETRY]
        return white
    contrast = np.ones(UNKNOWNS)
    contrast[:GEOMETRY] = contrast[-1] = gain
    half = inverse[:GEOMETRY] * contrast
    C: Floats = rms**2 * half @ key.spread @ half.T
    return C


def _correlation(T: Singles, level: Singles, area: Singles, total: Singles) -> Floats:
    a = T - ((T * area).sum(axis=1) / total)[:, None]
    b = level - ((level * area).sum(axis=1) / total)[:, None]
    wa = a * area
    scale = np.sqrt((wa * a).sum(axis=1) * (b * b * area).sum(axis=1))
    out: Floats = ((wa * b).sum(axis=1) / np.maximum(scale, 1e-9)).astype(np.float64)
    return out
