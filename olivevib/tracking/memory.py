"""What a tracker remembers, as bytes that bring back every digit."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Floats
from olivevib.detection import Blur, Known


def pack_known(known: dict[int, Known]) -> dict[str, Any]:
    """Followed markers as JSON values, numbers as hexadecimal floats."""
    return {
        str(i): {
            "H": hexed(one.H),
            "blur": hexed([one.blur.variance_px2, *one.blur.motion_px]),
            "noise": None if one.noise is None else hexed(one.noise),
            "drawn_at": None if one.drawn_at is None else hexed(one.drawn_at),
            "drawn_blur": hexed([one.drawn_blur.variance_px2, *one.drawn_blur.motion_px]),
            "shift": list(one.shift),
            "W": None if one.W is None else hexed(one.W),
            "misses": one.misses,
            "excess": hexed([one.excess]),
        }
        for i, one in known.items()
    }


def unpack_known(stored: dict[str, Any]) -> dict[int, Known]:
    """The same from JSON values."""
    return {int(i): _known(one) for i, one in stored.items()}


def _known(one: dict[str, Any]) -> Known:
    side = 0 if one["noise"] is None else round(len(one["noise"]) ** 0.5)
    x, y = one["shift"]
    return Known(
        H=unhexed(one["H"], (3, 3)),
        blur=_blur(one["blur"]),
        noise=None if not side else unhexed(one["noise"], (side, side)).astype(np.float32),
        drawn_at=None if one["drawn_at"] is None else unhexed(one["drawn_at"], (3, 3)),
        drawn_blur=_blur(one["drawn_blur"]),
        shift=(int(x), int(y)),
        W=None if one["W"] is None else unhexed(one["W"], (3, 3)),
        misses=int(one["misses"]),
        excess=float.fromhex(one["excess"][0]),
    )


def _blur(words: list[str]) -> Blur:
    variance, x, y = (float.fromhex(word) for word in words)
    return Blur(variance, (x, y))


def hexed(values: Iterable[float] | NDArray[Any]) -> list[str]:
    """Numbers of any shape as hexadecimal words."""
    return [float(v).hex() for v in np.ravel(np.asarray(values))]


def unhexed(words: list[str], shape: tuple[int, ...]) -> Floats:
    """An array (float64) of hexadecimal words."""
    return np.array([float.fromhex(word) for word in words]).reshape(shape)


def as_bytes(stored: dict[str, Any]) -> bytes:
    """JSON, the same bytes for the same memory."""
    return json.dumps(stored, sort_keys=True, separators=(",", ":")).encode()
