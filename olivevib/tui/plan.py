"""The form of a new trial: its fields, what can be guessed from one another, and the plan."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from olivevib.tui.fields import Field, FieldError, number_in, read_field
from olivevib.tui.sensors import how_many, sensor_fields, sensors_in

if TYPE_CHECKING:
    from olivevib.pipeline import NewTrial
    from olivevib.trial import TrialSettings
    from olivevib.trial.settings import Markers

BOARDS = (
    "coded:5x5,pitch=60,size=44",
    "charuco:7x5,square=50,marker=35,dict=DICT_5X5_50",
    "charuco:4x5,square=54,marker=40.5,dict=DICT_4X4_1000",
    "arucogrid:5x7,size=40,gap=10,dict=DICT_6X6_250",
    "chessboard:9x6,square=25",
)
LIBRARIES = ("olive49", "aruco:DICT_4X4_50", "apriltag:36h11")
SIZES = ("40", "50", "60", "80", "100")
IDS = ("1-6", "1-8", "1-12", "1-24")
EXPOSURES = ("1", "2", "5", "10")
BANDS = ("5-14", "5-25", "5-45", "15-40")

BEFORE_SENSORS = (
    Field("trial", "trial", "its name, e.g. 2026-11-20_T04"),
    Field("left", "left recording", "video of the left camera", True),
    Field("right", "right recording", "video of the right camera", True),
    Field("calibration_left", "left board", "video or folder of stills", True),
    Field("calibration_right", "right board", "video or folder of stills", True),
    Field("board", "board", "coded:5x5,pitch=60,size=44; others: Ctrl+O", choices=BOARDS),
    Field("rig", "or a rig", "rig.toml of a calibration, in place of a board", True),
    Field("size", "marker size, mm", "outer side of dark square; odd ones 60,2:68", choices=SIZES),
    Field("ids", "marker ids", "1,2,5-9; empty: every id of the library", choices=IDS),
    Field("markers", "marker library", "olive49, aruco:…, a TOML file", choices=LIBRARIES),
    Field("shutter", "shutter", "rolling or global; empty: unknown", choices=("rolling", "global")),
    Field("row_time", "row time, µs", "27.8 or 27.8,-27.8; empty: unknown"),
    Field("exposure", "exposure, ms", "2; empty: unknown, blur stays", choices=EXPOSURES),
    Field("band", "band, Hz", "where the shaker's frequency may lie: 5-45", choices=BANDS),
)
AFTER_SENSORS = (
    Field("preset", "sensor preset", "how the file is read: kept from another trial", True),
    Field("left_stamps", "left stamps", "time stamps, where they are in a file", True),
    Field("right_stamps", "right stamps", "time stamps, where they are in a file", True),
    Field("link", "link", "yes: leave the recordings in place; empty: copy", choices=("yes",)),
    Field("date", "date", "when it was recorded, 2026-11-20"),
    Field("place", "place", "grove, plot, row"),
    Field("operator", "operator", "who recorded it"),
    Field("tree", "tree", "its number or name"),
    Field("cultivar", "cultivar", "Coratina, Leccino, …"),
    Field("machine", "machine", "make and type of the shaker"),
    Field("notes", "notes", "anything worth knowing later"),
)
RECORD = {
    "date": "session.date",
    "place": "session.place",
    "operator": "session.operator",
    "tree": "tree.id",
    "cultivar": "tree.cultivar",
    "machine": "machine.make",
    "notes": "session.notes",
}
SHARED = ("place", "operator", "cultivar", "machine")  # of the record: as on the trial before
FORM_NAMES = {"size_mm": "size", "row_time_us": "row_time", "band_hz": "band"} | {
    "exposure_ms": "exposure"
}  # what the plan calls a line of the form


def form_fields(sensors: int) -> tuple[Field, ...]:
    """Every line of the form with room for so many accelerometers."""
    lines = (line for number in range(1, sensors + 1) for line in sensor_fields(number))
    return (*BEFORE_SENSORS, *lines, *AFTER_SENSORS)


def fields_of(values: Mapping[str, str]) -> tuple[Field, ...]:
    """The lines of the form that these values are of."""
    return form_fields(how_many(values))


def plan_of(values: Mapping[str, str]) -> NewTrial:
    """The plan that the form describes, as far as it is filled in.

    FieldError names the first line that cannot be read.
    """
    from olivevib import values as typed
    from olivevib.pipeline import NewTrial
    from olivevib.trial.workspace import find_preset

    said = {name: text.strip() for name, text in values.items() if text.strip()}
    size, own_sizes = read_field(said, "size", typed.sizes) or (None, {})
    left_row, right_row = read_field(said, "row_time", typed.row_times) or (None, None)
    return NewTrial(
        left=said.get("left", ""),
        right=said.get("right", ""),
        calibration_left=said.get("calibration_left"),
        calibration_right=said.get("calibration_right"),
        board=said.get("board"),
        rig=said.get("rig"),
        markers=said.get("markers", "olive49"),
        size_mm=size,
        sizes_mm=own_sizes,
        ids=read_field(said, "ids", typed.id_list) or (),
        shutter=_shutter(said),
        row_time_us=(left_row, right_row),
        band_hz=read_field(said, "band", typed.band),
        exposure_ms=number_in(said, "exposure"),
        left_stamps=said.get("left_stamps"),
        right_stamps=said.get("right_stamps"),
        sensors=sensors_in(said),
        preset=find_preset(said["preset"], Path()) if "preset" in said else None,
        link=said.get("link", "no").lower() in ("yes", "y", "true", "1"),
    )


def record_of(values: Mapping[str, str]) -> dict[str, object]:
    """The session record as dotted settings; only what was said."""
    said = {name: values.get(name, "").strip() for name in RECORD}
    return {RECORD[name]: text for name, text in said.items() if text}


def free_name(taken: Iterable[str]) -> str:
    """A name that no trial has yet, such as T01."""
    known = set(taken)
    return next(name for k in range(1, 10_000) if (name := f"T{k:02d}") not in known)


def values_of(
    settings: TrialSettings, place: Callable[[str], Path], same_rig: bool = True
) -> dict[str, str]:
    """The fields that a trial like this one shares with it; ``place`` resolves a file's name.

    Recordings, stamps and sensor files are the new trial's own and stay empty. same_rig: the
    cameras have not been moved, so that its calibration is taken over.
    """
    markers, cameras, calibration = settings.markers, settings.cameras, settings.calibration
    rows = [r for r in (cameras.left.row_time_us, cameras.right.row_time_us) if r is not None]
    band, library, exposure = settings.vibration.band_hz, markers.library, cameras.left.exposure_ms
    rig = same_rig and place("rig.toml").exists()
    shared = {
        "board": None if rig else calibration.board,
        "rig": str(place("rig.toml")) if rig else None,
        "size": _sizes_text(markers),
        "ids": ",".join(map(str, markers.ids)),
        "markers": str(place(library)) if library.endswith(".toml") else library,
        "shutter": None if cameras.shutter == "unknown" else cameras.shutter,
        "row_time": ",".join(f"{row:g}" for row in rows) if len(rows) == 2 else None,
        "exposure": None if exposure is None else f"{exposure:g}",
        "band": f"{band[0]:g}-{band[1]:g}" if band else None,
        "place": settings.session.place,
        "operator": settings.session.operator,
        "cultivar": settings.tree.cultivar,
        "machine": settings.machine.make,
    }
    return {name: f"{value}" for name, value in shared.items() if value}


def _sizes_text(markers: Markers) -> str:
    """The size of all markers and the own ones, as they are typed."""
    whole = [] if markers.size_mm is None else [f"{markers.size_mm:g}"]
    return ",".join([*whole, *(f"{m.id}:{m.size_mm:g}" for m in markers.marker if m.size_mm)])


def trial_name(values: Mapping[str, str]) -> str:
    """The name of the new trial; FieldError where there is none or it is no name."""
    name = values.get("trial", "").strip()
    if not name or name in (".", "..") or any(c in name for c in '/\\:*?"<>|'):
        what = f"{name!r} is no name of a trial: it becomes a folder."
        raise FieldError("trial", what, "Write e.g. 2026-11-20_T04.")
    return name


def _shutter(said: Mapping[str, str]) -> str | None:
    word = said.get("shutter")
    if word not in (None, "rolling", "global"):
        raise FieldError("shutter", f"{word!r} is not known.", "Write rolling or global.")
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
