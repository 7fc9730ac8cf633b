"""tracks.h5: both cameras' tracks with the raw stamps and the clock fit of every frame."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from olivevib.arrays import Floats, floats
from olivevib.errors import Caution
from olivevib.files.store import StageFile, Variable
from olivevib.signals import State
from olivevib.tracking import Track
from olivevib.trial.records.cautions import cautions_from, cautions_text
from olivevib.trial.stages import BY_NAME, Fingerprint

STAGE = BY_NAME["track"]
SIDES = ("left", "right")
WORDS = tuple(s.word for s in State)


@dataclass(frozen=True)
class CameraRecord:
    """One camera's recording: how it was stamped and read out.

    stamp_kind: "container", "file" or "slots" (AVI: made up from the rate); method: how the clock
    fit took the stamps ("line" or "stamps"); row_time_s signed per raw sensor row, row_time_source
    "unknown" when taken as zero; turn_deg: how far a player would turn the picture
    counter-clockwise: points and rows are those of the stored picture, never turned, flipped,
    cropped or scaled.
    """

    video: str
    codec: str
    size_px: tuple[int, int]
    frames: int
    dropped: int
    damaged: int
    stamp_kind: str
    method: str
    rate_hz: float
    rate_sigma_hz: float
    jitter_s: float
    worst_s: float
    row_time_s: float
    row_time_sigma_s: float
    row_time_source: str
    turn_deg: int = 0


@dataclass(frozen=True)
class StoredTracks:
    """What tracks.h5 holds. stamp_s: raw stamp of each frame count, NaN where dropped.

    fitted_s: the same by the clock fit, on the stamps' own clock, dropped counts included.
    """

    left: tuple[Track, ...]
    right: tuple[Track, ...]
    cameras: Mapping[str, CameraRecord]
    stamp_s: Mapping[str, Floats]
    stray_ids: tuple[int, ...]
    localiser: str
    cautions: tuple[Caution, ...]
    fitted_s: Mapping[str, Floats] = field(default_factory=dict)

    def of(self, side: str) -> tuple[Track, ...]:
        """The tracks of "left" or "right"."""
        return self.left if side == "left" else self.right


def tracks_file(stored: StoredTracks, now: Fingerprint) -> StageFile:
    """The stage file of the tracks."""
    variables: dict[str, Variable] = {}
    for side in SIDES:
        variables |= _side(side, stored.of(side), stored.stamp_s[side])
        if side in stored.fitted_s:
            variables[f"{side}/stamp_fit"] = Variable(
                ("frame",), stored.fitted_s[side], "s", "stamp by the clock fit; own clock"
            )
    return StageFile(
        stage=STAGE.name,
        schema=STAGE.schema,
        settings=dict(now.settings),
        inputs=dict(now.inputs),
        variables=variables,
        attributes={
            "cameras": json.dumps({side: asdict(stored.cameras[side]) for side in SIDES}),
            "stray_ids": json.dumps(stored.stray_ids),
            "localiser": stored.localiser,
            "cautions": cautions_text(stored.cautions),
        },
    )


def _side(side: str, tracks: tuple[Track, ...], stamp_s: Floats) -> dict[str, Variable]:
    n = stamp_s.size

    def stack(name: str, *rest: int) -> Floats:
        values = [getattr(t, name) for t in tracks]
        out = np.stack(values, axis=1) if values else np.empty((n, 0, *rest))
        out.flags.writeable = False  # handed over, not copied
        return out

    fm = ("frame", "marker")
    out = {
        "frame": Variable(("frame",), np.arange(n), "1", "frame count, drops restored"),
        "marker": Variable(("marker",), np.array([t.id for t in tracks], np.int64), "1", "id"),
        "stamp": Variable(("frame",), stamp_s, "s", "raw time stamp; NaN: no frame"),
        "time": Variable(fm, stack("t_s"), "s", "instant of the observation, own clock"),
        "raw_row": Variable(fm, stack("raw_row"), "px", "raw sensor row of the centre"),
        "exposure": Variable(fm, stack("exposure_s"), "s", "exposure; NaN: unknown"),
        "centre": Variable((*fm, "xy"), stack("centre_px", 2), "px", "image of the centre"),
        "centre_cov": Variable(
            (*fm, "xy", "xy2"), stack("centre_cov_px2", 2, 2), "px2", "its covariance"
        ),
        "corners": Variable(
            (*fm, "corner", "xy"), stack("corners_px", 4, 2), "px", "images of P1…P4"
        ),
        "corners_cov": Variable(
            (*fm, "c", "c2"), stack("corners_cov_px2", 8, 8), "px2", "covariance of x1 y1 … x4 y4"
        ),
        "state": Variable(
            fm, stack("state").astype(np.int64), "1", "why a sample is there or not", WORDS
        ),
    }
    return {f"{side}/{name}": variable for name, variable in out.items()}


def tracks_from(file: StageFile) -> StoredTracks:
    """The tracks of a stage file."""
    cameras = json.loads(str(file.attributes["cameras"]))
    localiser = str(file.attributes["localiser"])
    both = {side: _tracks(file, side, localiser) for side in SIDES}
    return StoredTracks(
        left=both["left"],
        right=both["right"],
        cameras={s: CameraRecord(**_sized(cameras[s])) for s in SIDES},
        stamp_s={
            s: floats("stamp_s", file.variables[f"{s}/stamp"].values, (None,), nan=True)
            for s in SIDES
        },
        fitted_s={
            s: floats("stamp_fit", file.variables[f"{s}/stamp_fit"].values, (None,))
            for s in SIDES
            if f"{s}/stamp_fit" in file.variables
        },
        stray_ids=tuple(json.loads(str(file.attributes["stray_ids"]))),
        localiser=localiser,
        cautions=cautions_from(file.attributes["cautions"]),
    )


def _sized(record: dict[str, Any]) -> dict[str, Any]:
    """JSON has no tuples."""
    return record | {"size_px": tuple(record["size_px"])}


def _tracks(file: StageFile, side: str, localiser: str) -> tuple[Track, ...]:
    def get(name: str) -> Floats:
        return np.asarray(file.variables[f"{side}/{name}"].values)

    ids, frame, state = get("marker"), get("frame"), get("state")
    stacks = {
        field: get(name)
        for field, name in (
            ("t_s", "time"),
            ("raw_row", "raw_row"),
            ("exposure_s", "exposure"),
            ("centre_px", "centre"),
            ("centre_cov_px2", "centre_cov"),
            ("corners_px", "corners"),
            ("corners_cov_px2", "corners_cov"),
        )
    }
    return tuple(
        Track(
            camera=side,
            id=int(i),
            frame=frame.astype(np.int64),
            state=state[:, k].astype(np.int64),
            localiser=localiser,
            **{field: values[:, k] for field, values in stacks.items()},
        )
        for k, i in enumerate(ids)
    )
