"""The form of a new trial: its fields, what can be guessed from one another, and the plan."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from olivevib.errors import UsageError

if TYPE_CHECKING:
    from olivevib.pipeline import NewTrial
    from olivevib.trial import TrialSettings


@dataclass(frozen=True)
class Field:
    """One line of the form; ``path``: it names a file or folder that can be picked."""

    name: str
    label: str
    hint: str
    path: bool = False


FIELDS = (
    Field("trial", "trial", "its name, e.g. 2026-11-20_T04"),
    Field("left", "left recording", "video of the left camera", True),
    Field("right", "right recording", "video of the right camera", True),
    Field("calibration_left", "left board", "video or folder of stills", True),
    Field("calibration_right", "right board", "video or folder of stills", True),
    Field("board", "board", "coded:5x5,pitch=60,size=44 · charuco:4x5,square=54,marker=40.5,…"),
    Field("rig", "or a rig", "rig.toml of an earlier calibration, instead of a board", True),
    Field("size", "marker size, mm", "outer side of the dark square"),
    Field("ids", "marker ids", "1,2,5-9; empty: every id of the library"),
    Field("markers", "marker library", "olive49, aruco:DICT_4X4_50, apriltag:36h11, a TOML file"),
    Field("shutter", "shutter", "rolling or global; empty: unknown"),
    Field("row_time", "row time, µs", "27.8 or 27.8,-27.8; empty: unknown"),
    Field("band", "band, Hz", "where the shaker's frequency may lie: 5-45"),
    Field("accelerometer", "accelerometer", "what the logger wrote", True),
    Field("accelerometer_marker", "its marker", "the id it was fixed to"),
    Field("left_stamps", "left stamps", "time stamps, where they are in a file", True),
    Field("right_stamps", "right stamps", "time stamps, where they are in a file", True),
    Field("link", "link", "yes: leave the recordings where they are; empty: copy them"),
)
PATHS = tuple(field.name for field in FIELDS if field.path)


def plan_of(values: Mapping[str, str]) -> NewTrial:
    """The plan that the form describes; UsageError names the field that cannot be read."""
    from olivevib import values as typed
    from olivevib.pipeline import NewTrial

    said = {name: text.strip() for name, text in values.items() if text.strip()}
    for name in ("left", "right"):
        if name not in said:
            raise UsageError(f"the {name} recording is not named.", "", "Pick it with Ctrl+O.")
    left_row, right_row = typed.row_times(said.get("row_time"))
    return NewTrial(
        left=said["left"],
        right=said["right"],
        calibration_left=said.get("calibration_left"),
        calibration_right=said.get("calibration_right"),
        board=said.get("board"),
        rig=said.get("rig"),
        markers=said.get("markers", "olive49"),
        size_mm=_number(said, "size"),
        ids=typed.id_list(said.get("ids")),
        shutter=_shutter(said),
        row_time_us=(left_row, right_row),
        band_hz=typed.band(said.get("band")),
        left_stamps=said.get("left_stamps"),
        right_stamps=said.get("right_stamps"),
        accelerometer=said.get("accelerometer"),
        accelerometer_marker=_whole(said, "accelerometer_marker"),
        link=said.get("link", "no").lower() in ("yes", "y", "true", "1"),
    )


def values_of(settings: TrialSettings, place: Callable[[str], Path]) -> dict[str, str]:
    """The fields that a trial like this one shares with it; ``place`` resolves a file's name.

    Recordings, stamps and sensor files are the new trial's own and stay empty.
    """
    markers, cameras, calibration = settings.markers, settings.cameras, settings.calibration
    rows = [r for r in (cameras.left.row_time_us, cameras.right.row_time_us) if r is not None]
    band, library = settings.vibration.band_hz, markers.library
    shared = {
        "board": calibration.board,
        "rig": str(place("rig.toml")) if place("rig.toml").exists() else None,
        "size": markers.size_mm,
        "ids": ",".join(map(str, markers.ids)),
        "markers": str(place(library)) if library.endswith(".toml") else library,
        "shutter": None if cameras.shutter == "unknown" else cameras.shutter,
        "row_time": ",".join(f"{row:g}" for row in rows) if len(rows) == 2 else None,
        "band": f"{band[0]:g}-{band[1]:g}" if band else None,
    }
    if shared["rig"]:
        shared["board"] = None  # the same cameras, not moved: their calibration is taken over
    return {name: f"{value}" for name, value in shared.items() if value}


def trial_name(values: Mapping[str, str]) -> str:
    """The name of the new trial; UsageError where there is none or it is no name."""
    name = values.get("trial", "").strip()
    if not name or name in (".", "..") or any(c in name for c in '/\\:*?"<>|'):
        raise UsageError(
            f"{name!r} is no name of a trial.", "It becomes a folder.", "Write e.g. 2026-11-20_T04."
        )
    return name


def _number(said: Mapping[str, str], name: str) -> float | None:
    if name not in said:
        return None
    try:
        return float(said[name].replace(",", "."))
    except ValueError:
        raise UsageError(f"{name} {said[name]!r} is no number.", "", "Write e.g. 60.") from None


def _whole(said: Mapping[str, str], name: str) -> int | None:
    number = _number(said, name)
    if number is not None and number != int(number):
        raise UsageError(f"{said[name]!r} is no id.", "", "Write the marker's number, e.g. 3.")
    return None if number is None else int(number)


def _shutter(said: Mapping[str, str]) -> str | None:
    word = said.get("shutter")
    if word not in (None, "rolling", "global"):
        raise UsageError(f"shutter {word!r} is not known.", "", "Write rolling or global.")
    return word


def guesses(name: str, path: Path, values: Mapping[str, str]) -> dict[str, str]:
    """What naming one side says of the other, and of files beside it; only for empty fields."""
    found: dict[str, str] = {}
    other = name.replace("left", "right")
    twin = _twin(path)
    if other != name and twin is not None:
        found[other] = str(twin)
    if name == "left":
        found |= _beside(path)
    return {key: text for key, text in found.items() if not values.get(key, "").strip()}


def _twin(path: Path) -> Path | None:
    """The same path with right for left, in its name or else in its folder's name."""
    for candidate in (
        path.with_name(path.name.replace("left", "right").replace("Left", "Right")),
        path.parent.with_name(path.parent.name.replace("left", "right")) / path.name,
    ):
        if candidate != path and candidate.exists():
            return candidate
    return None


def _beside(left: Path) -> dict[str, str]:
    """Board recordings and an accelerometer file that stand beside the left recording."""
    found = {}
    for side in ("left", "right"):
        places = (left.parent / "calibration" / side, left.parent / f"board_{side}{left.suffix}")
        there = next((p for p in places if p.exists()), None)
        if there is not None:
            found[f"calibration_{side}"] = str(there)
    logger = left.parent / "accelerometer.csv"
    return found | ({"accelerometer": str(logger)} if logger.exists() else {})
