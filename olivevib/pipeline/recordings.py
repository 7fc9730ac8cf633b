"""The two recordings of a trial: their stamps, sizes, and whether they belong together."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from olivevib.arrays import Floats
from olivevib.errors import Caution, InputError
from olivevib.files.stamps import read_stamp_file
from olivevib.signals import StampFit, fit_stamps

SIDES = ("left", "right")


def check_sizes(sizes: dict[str, tuple[int, int]]) -> None:
    """InputError where the two cameras' pictures have different sizes."""
    if sizes["left"] != sizes["right"]:
        left, right = ("{} x {}".format(*sizes[side]) for side in SIDES)
        turned = sizes["left"] == sizes["right"][::-1]
        why = "One of them was turned by 90 degrees." if turned else "They ran in different modes."
        raise InputError(
            f"the left recording is {left} px, the right one {right} px.",
            why,
            "Record both cameras in the same mode and do not turn or scale the files.",
        )


def check_counts(counts: dict[str, int], fits: dict[str, StampFit]) -> tuple[Caution, ...]:
    """A caution where one camera delivered other frames than the other."""
    left, right = counts["left"], counts["right"]
    out = []
    if left != right:
        out.append(
            Caution(
                "frame-counts-differ",
                f"The left camera delivered {left} frames, the right one {right}.",
                "Frames are paired by their time stamps; where one camera is silent there is no "
                "3-D position. Check the cable and the disk if this was not meant.",
            )
        )
    for side in SIDES:
        lost = fits[side].dropped.size
        if lost:
            out.append(
                Caution(
                    "dropped-frames",
                    f"The {side} camera skipped {lost} of {counts[side] + lost} frames.",
                    "Use another USB port for each camera and close other programs.",
                )
            )
    return tuple(out)


def stamps_of(
    stamp_file: Path | None, video: Path, container: list[float]
) -> tuple[Floats, str, StampFit]:
    """Stamps of all delivered frames, where they come from, and their clock fit.

    From the stamp file where one is given, else those of the container; never frame / fps.
    InputError where frames carry no stamps or the stamps do not increase.
    """
    if stamp_file is not None:
        stamps, kind = read_stamp_file(stamp_file, video.name, len(container)), "file"
    else:
        stamps, kind = np.array(container), "container"
    if stamps.size < 2:
        raise InputError(
            f"{video} holds {stamps.size} frame(s).",
            "A motion needs at least two.",
            "Record again, or check that this is the right file.",
        )
    if not np.isfinite(stamps).all() or (np.diff(stamps) <= 0).any():
        raise InputError(
            f"the time stamps of {stamp_file or video} cannot be used.",
            "Some are missing or not later than the one before.",
            "Give the true stamps with --left-stamps and --right-stamps, one a frame.",
        )
    return stamps, kind, fit_stamps(stamps)
