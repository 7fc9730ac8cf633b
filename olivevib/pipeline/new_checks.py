"""What is wrong with the plan of a new trial, field by field, and what it leaves unsaid."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from olivevib.calibration.boards import parse_board
from olivevib.errors import InputError, OlivevibError, UsageError
from olivevib.files.accelerometer import NoAccelerationError, read_accelerometer, read_preset
from olivevib.files.rig_file import read_rig
from olivevib.files.stamps import pick_camera
from olivevib.files.stills import open_source
from olivevib.files.video import Video
from olivevib.marker import MarkerLibrary, load_library
from olivevib.pipeline.libraries import only_known
from olivevib.pipeline.recordings import SIDES, check_sizes

if TYPE_CHECKING:
    from olivevib.pipeline.new import NewTrial

Size = tuple[int, int]
MANY_IDS = 100  # of a foreign dictionary: so many that chance finds some of them in leaves


class Fault(NamedTuple):
    """What is wrong, and the field of the plan (``NewTrial``) that it is about.

    sensor: which of the plan's sensors, from 1; 1 where it is about none.
    """

    field: str
    error: OlivevibError
    sensor: int = 1


def check_plan(plan: NewTrial) -> None:
    """Raise the first fault: InputError for a file, UsageError for what was said."""
    for side in SIDES:
        if not getattr(plan, side):
            raise UsageError(
                f"the {side} recording is not named.",
                "Positions in space need the pictures of two cameras.",
                f"Name it with --{side} FILE.",
            )
    for fault in faults(plan):
        raise fault.error


def faults(plan: NewTrial) -> Iterator[Fault]:
    """Every fault that can be told before the work starts; what is not named is passed over.

    Files are opened, their first pictures decoded and their sizes compared.
    """
    yield from _together(plan)
    yield from _said(plan)
    missing = list(_missing(plan))
    yield from missing
    gone = {fault.field for fault in missing}
    yield from _files(plan, gone)


def unsaid(plan: NewTrial) -> tuple[str, ...]:
    """What a person should still say for the results to be worth most, most important first."""
    out = []
    if plan.size_mm is None and not plan.sizes_mm:
        out.append("marker size (--size MM): reconstruct needs it")
    if not (plan.rig or plan.calibration_left):
        out.append(
            "board (--calibration-left, -right and --board, or --rig): without it there is no 3-D"
        )
    if not plan.ids and not _small(plan.markers):
        out.append("marker ids (--ids 1-8): every id of this large library counts as a marker")
    if any(sensor.marker is None for sensor in plan.every_sensor):
        out.append(
            "the accelerometer's marker (--accelerometer-marker ID): it is compared with nothing"
        )
    if plan.exposure_ms is None:
        out.append("exposure (--exposure MS): amplitudes keep what blur takes away")
    if plan.band_hz is None:
        out.append("band (--band 5-45): a frequency may stay undecided")
    if plan.shutter != "global" and None in plan.row_time_us:
        out.append("row time (--row-time US): taken as 0 unless the board is waved")
    return tuple(out)


def _small(library: str) -> bool:
    try:
        return load_library(library).ids.size <= MANY_IDS
    except OlivevibError:
        return True  # told as a fault


def _together(plan: NewTrial) -> Iterator[Fault]:
    """What does not go together."""
    pair = {side: getattr(plan, f"calibration_{side}") for side in SIDES}
    if any(pair.values()) and not all(pair.values()):
        side = "right" if pair["left"] else "left"
        remedy = "Give both --calibration-left and --calibration-right, or --rig FILE."
        error = UsageError("only one side of the calibration was given.", "", remedy)
        yield Fault(f"calibration_{side}", error)
    if all(pair.values()) and plan.rig:
        what = "both board recordings and a rig were given."
        yield Fault("rig", UsageError(what, "", "Give one of them, not both."))
    if all(pair.values()) and not plan.rig and not plan.board:
        remedy = "Name it with --board SPEC; olivevib new --help lists them."
        yield Fault("board", UsageError("the calibration board is not known.", "", remedy))
    if plan.left and plan.right and Path(plan.left).resolve() == Path(plan.right).resolve():
        error = UsageError(
            f"left and right are the same file, {plan.left}.",
            "Positions in space need the pictures of two cameras.",
            "Give the recording of each camera.",
        )
        yield Fault("right", error)


def _said(plan: NewTrial) -> Iterator[Fault]:
    """Numbers and names that cannot be."""
    if plan.board:
        yield from _tried("board", lambda: parse_board(str(plan.board)))
    for size in (plan.size_mm, *plan.sizes_mm.values()):
        if size is not None and not size > 0:
            error = UsageError(f"--size {size} is no size.", "", "Give millimetres above 0.")
            yield Fault("size_mm", error)
    if plan.exposure_ms is not None and not 0 < plan.exposure_ms < 1000:
        what = f"--exposure {plan.exposure_ms:g} is no exposure."
        yield Fault("exposure_ms", UsageError(what, "", "Give milliseconds, such as 2."))
    try:
        library = load_library(plan.markers)
    except OlivevibError as error:
        yield Fault("markers", error)
        return
    yield from _tried("ids", lambda: only_known(library, plan.ids))
    yield from _tried("size_mm", lambda: only_known(library, tuple(plan.sizes_mm)))
    yield from _sensor_marker(plan, library)


def _sensor_marker(plan: NewTrial, library: MarkerLibrary) -> Iterator[Fault]:
    ids = plan.ids or tuple(int(i) for i in library.ids)
    for number, sensor in enumerate(plan.every_sensor, start=1):
        if sensor.marker is None or sensor.marker in ids:
            continue
        error = UsageError(
            f"the accelerometer's marker {sensor.marker} is none of the trial's markers.",
            "The two can only be compared where the camera sees the sensor's marker.",
            "Correct --accelerometer-marker ID, or add it to --ids.",
        )
        yield Fault("accelerometer_marker", error, number)


def _missing(plan: NewTrial) -> Iterator[Fault]:
    fields = ("left", "right", "calibration_left", "calibration_right", "rig", "preset")
    named = [(field, getattr(plan, field), 1) for field in fields]
    sensors = enumerate(plan.every_sensor, start=1)
    for field, name, sensor in [*named, *(("accelerometer", s.file, k) for k, s in sensors)]:
        if name and not Path(name).exists():
            error = InputError(f"{name} is missing.", "", "Check the name and folder.")
            yield Fault(field, error, sensor)


def _files(plan: NewTrial, gone: set[str]) -> Iterator[Fault]:
    """Files that are there, but cannot be used, or not together."""
    sizes: dict[str, Size] = {}
    for side in SIDES:
        if getattr(plan, side) and side not in gone:
            try:
                sizes[side] = _size(Path(getattr(plan, side)))
            except OlivevibError as error:
                yield Fault(side, error)
    if len(sizes) == len(SIDES):
        yield from _tried("right", lambda: check_sizes(sizes))
    for side in SIDES:
        field = f"calibration_{side}"
        if getattr(plan, field) and field not in gone:
            yield from _tried(field, partial(_same_size, plan, side, sizes.get(side)))
        stamps, video = getattr(plan, f"{side}_stamps"), getattr(plan, side)
        if stamps and video:
            named = Path(video).name
            yield from _tried(f"{side}_stamps", partial(pick_camera, stamps, named))
    if plan.rig and "rig" not in gone:
        yield from _tried("rig", lambda: _rig_size(str(plan.rig), sizes))
    if not gone & {"accelerometer", "preset"}:
        for number, sensor in enumerate(plan.every_sensor, start=1):
            look = partial(_sensor, sensor.file, plan.preset)
            yield from (f._replace(sensor=number) for f in _tried("accelerometer", look))


def _tried(field: str, look: Callable[[], object]) -> Iterator[Fault]:
    try:
        look()
    except OlivevibError as error:
        yield Fault(field, error)


def _size(video: Path) -> Size:
    with Video.open(video) as opened:
        return opened.info.size_px


def _same_size(plan: NewTrial, side: str, size: Size | None) -> None:
    """InputError where calibration pictures cannot be read or are not as large as the trial's."""
    with open_source(getattr(plan, f"calibration_{side}"), side) as source:
        other = source.size_px
    if size is not None and other != size:
        raise InputError(
            f"the {side} board pictures are {other[0]} x {other[1]} px, the {side} recording "
            f"{size[0]} x {size[1]} px.",
            "A calibration holds for one mode of the camera only.",
            "Record the board in the same mode as the trial, neither cropped, turned nor scaled.",
        )


def _rig_size(file: str, sizes: dict[str, Size]) -> None:
    rig = read_rig(file)
    for side, size in sizes.items():
        known = getattr(rig, side).size_px
        if tuple(known) != tuple(size):
            raise InputError(
                f"{file} was calibrated at {known[0]} x {known[1]} px, the {side} recording is "
                f"{size[0]} x {size[1]} px.",
                "A calibration holds for one mode of the camera only.",
                "Name the rig of this pair in this mode, or recordings of the board.",
            )


def _sensor(file: str, preset: str | None) -> None:
    """InputError where the file holds no acceleration; what options may mend waits for compare."""
    options = read_preset(Path(preset)) if preset else None
    try:
        read_accelerometer(Path(file), options)
    except NoAccelerationError:
        raise
    except OlivevibError:
        return
