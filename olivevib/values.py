"""What a person types, as values; counts, lists and values with sigma as a person reads them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from olivevib.errors import UsageError


def id_list(text: str | None) -> tuple[int, ...]:
    """Ids of "1,2,5-9"; empty for None. UsageError for anything else."""
    ids: list[int] = []
    for part in (text or "").split(","):
        first, _, last = part.strip().partition("-")
        if not part.strip():
            continue
        if not first.isdigit() or (last and not last.isdigit()):
            raise UsageError(f"{text!r} is no list of ids.", "", "Write it as 1,2,5-9.")
        ids.extend(range(int(first), int(last or first) + 1))
    return tuple(dict.fromkeys(ids))


def sizes(text: str | None) -> tuple[float | None, dict[int, float]]:
    """The size of all markers and the own sizes of some, mm, of "60" or "60,2:68.4".

    UsageError for anything else.
    """
    whole: float | None = None
    own: dict[int, float] = {}
    try:
        for part in (text or "").split(","):
            marker, colon, size = part.strip().rpartition(":")
            if colon:
                own[int(marker)] = float(size)
            elif part.strip():
                whole = float(size)
    except ValueError:
        raise UsageError(
            f"--size {text!r} is no size.",
            "",
            "Write millimetres as 60, or with odd ones 60,2:68.4.",
        ) from None
    return whole, own


def band(text: str | None) -> tuple[float, float] | None:
    """The limits (5.0, 45.0) Hz of "5-45"; None for None. UsageError for anything else."""
    if text is None:
        return None
    low, _, high = text.partition("-")
    try:
        limits = float(low), float(high)
    except ValueError:
        limits = (0.0, 0.0)
    if not 0 < limits[0] < limits[1]:
        raise UsageError(f"--band {text!r} is no band.", "", "Write it as 5-45, in Hz.")
    return limits


def picture_size(text: str | None) -> tuple[int, int] | None:
    """Width and height (1280, 720) of "1280x720"; None for None. UsageError for anything else."""
    if text is None:
        return None
    width, _, height = text.lower().partition("x")
    if not (width.isdigit() and height.isdigit() and int(width) > 0 and int(height) > 0):
        raise UsageError(f"--size {text!r} is no picture size.", "", "Write it as 1280x720.")
    return int(width), int(height)


def row_times(text: str | None) -> tuple[float | None, float | None]:
    """Row times of left and right, µs, of "27.8" or "27.8,-27.8"; UsageError otherwise."""
    if text is None:
        return None, None
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) not in (1, 2):
        raise UsageError(
            f"--row-time {text!r} is no row time.", "", "Write microseconds, one or two: 27.8,27.8"
        )
    return values[0], values[-1]


def settings(pairs: list[str]) -> dict[str, Any]:
    """KEY=VALUE words to dotted settings; values as TOML, else as text."""
    import tomlkit
    from tomlkit.exceptions import TOMLKitError

    out: dict[str, Any] = {}
    for pair in pairs:
        key, equals, text = pair.partition("=")
        if not equals or "." not in key:
            raise UsageError(f"--set {pair!r} is no setting.", "", "Write it as detection.fill=0.7")
        try:
            out[key.strip()] = tomlkit.parse(f"v = {text}")["v"]
        except TOMLKitError:
            out[key.strip()] = text.strip()
    return out


def listed(names: Sequence[str]) -> str:
    """``a``, ``a and b``, ``a, b and c``."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def counted(number: int, word: str) -> str:
    """A number of things in words: 1 frame, 3 frames, no frames."""
    return f"{number or 'no'} {word}{'s' * (number != 1)}"


def combined(sigma: float | None, other: float | None) -> float | None:
    """Sigma of two independent parts together; None where the first is not known."""
    return None if sigma is None else math.hypot(sigma, other or 0.0)


def with_sigma(value: float, sigma: float | None, digits: int) -> str:
    """Value ± sigma with two significant digits of sigma, at most seven decimals.

    Without a sigma ``digits`` decimals of the value alone.
    """
    if sigma is None or not math.isfinite(sigma) or sigma <= 0:
        return f"{value:.{digits}f}"
    places = min(7, max(0, 1 - math.floor(math.log10(sigma))))
    small = f"< {10.0**-places:.0e}" if sigma < 10.0**-places else f"{sigma:.{places}f}"
    return f"{value:.{places}f} ± {small}"
