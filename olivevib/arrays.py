"""Shape, dtype and finiteness checks for the constructors of the types that pass between rooms."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Grey = NDArray[np.uint8]  # (H, W)

Shape = tuple[int | None, ...]  # None: any length


def _frozen(name: str, array: NDArray[Any], shape: Shape) -> NDArray[Any]:
    fits = len(array.shape) == len(shape) and all(
        want is None or want == got for want, got in zip(shape, array.shape, strict=True)
    )
    if not fits:
        wanted = "(" + ", ".join("any" if n is None else str(n) for n in shape) + ")"
        raise ValueError(f"{name} must have shape {wanted}, got {array.shape}")
    array = array.copy() if array.flags.writeable else array
    array.flags.writeable = False
    return array


def floats(name: str, value: ArrayLike, shape: Shape, *, nan: bool = False) -> Floats:
    """Return ``value`` as a read-only float64 array of ``shape``; NaN only where ``nan`` allows it.

    Raises ValueError naming ``name``, what was wanted and what came.
    """
    array = _frozen(name, np.asarray(value, dtype=np.float64), shape)
    bad = np.isinf(array) if nan else ~np.isfinite(array)
    if bad.any():
        kind = "infinite" if nan else "non-finite"
        raise ValueError(f"{name} holds {int(bad.sum())} {kind} of {array.size} values")
    return array


def ints(name: str, value: ArrayLike, shape: Shape) -> Ints:
    """Return ``value`` as a read-only int64 array of ``shape``; raises ValueError for fractions."""
    raw = np.asarray(value)
    if raw.size and not np.issubdtype(raw.dtype, np.integer):
        raise ValueError(f"{name} must hold whole numbers, got {raw.dtype}")
    return _frozen(name, raw.astype(np.int64), shape)


def bools(name: str, value: ArrayLike, shape: Shape) -> Bools:
    """Return ``value`` as a read-only bool array of ``shape``."""
    return _frozen(name, np.asarray(value, dtype=np.bool_), shape)
