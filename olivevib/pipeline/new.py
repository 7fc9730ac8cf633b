"""A new trial from recordings: everything is checked before anything is written."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import tomlkit
from tomlkit.items import Table

from olivevib.errors import UsageError
from olivevib.files.atomic import as_input_error
from olivevib.files.capture import sidecar_of
from olivevib.files.stamps import pick_camera
from olivevib.files.stills import IMAGE_SUFFIXES
from olivevib.files.trial_folders import FILE
from olivevib.pipeline.new_checks import check_plan
from olivevib.pipeline.recordings import SIDES
from olivevib.pipeline.sensor_plan import SensorPlan
from olivevib.progress import Tick, silent
from olivevib.trial import Trial
from olivevib.trial.document import change_settings
from olivevib.trial.workspace import named


@dataclass(frozen=True)
class NewTrial:
    """What ``olivevib new`` was told; paths as the user gave them.

    places, sizes_mm: where single markers sit and their own size, where somebody knows it already.
    accelerometer, accelerometer_marker: one sensor; sensors: as many as there are, told in full.
    settings: dotted keys of trial.toml, such as {"detection.fill": 0.7}.
    """

    left: str
    right: str
    calibration_left: str | None = None
    calibration_right: str | None = None
    board: str | None = None
    rig: str | None = None
    markers: str = "olive49"
    size_mm: float | None = None
    ids: tuple[int, ...] = ()
    shutter: str | None = None
    row_time_us: tuple[float | None, float | None] = (None, None)
    band_hz: tuple[float, float] | None = None
    left_stamps: str | None = None
    right_stamps: str | None = None
    accelerometer: str | None = None
    accelerometer_marker: int | None = None
    preset: str | None = None
    link: bool = False
    simulated: bool = False
    exposure_ms: float | None = None
    places: Mapping[int, str] = field(default_factory=dict)
    sizes_mm: Mapping[int, float] = field(default_factory=dict)
    sensors: tuple[SensorPlan, ...] = ()
    settings: Mapping[str, object] = field(default_factory=dict)

    @property
    def every_sensor(self) -> tuple[SensorPlan, ...]:
        """All sensors, in order."""
        one = self.accelerometer
        first = (SensorPlan(one, self.accelerometer_marker),) if one else ()
        return first + self.sensors


def new_trial(folder: Path, plan: NewTrial, tick: Tick = silent) -> Trial:
    """Make the trial folder with its recordings (copied, or named where they are with ``link``).

    Raises InputError or UsageError before anything is written; the folder appears whole or not.
    """
    folder = named(folder)
    check_plan(plan)
    part = folder.with_name(f".{folder.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    try:
        part.mkdir(parents=True)
        _describe(part, plan, _Places(_wanted(plan)))  # a fault in it is told before the copying
        _describe(part, plan, _place(part, folder, plan, tick))
        if folder.exists():
            _merge_into(part, folder)
        else:
            part.rename(folder)
    except OSError as error:
        raise as_input_error(error, folder) from error
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return Trial.open(folder)


def _describe(part: Path, plan: NewTrial, places: _Places) -> None:
    """Write trial.toml; UsageError where a setting of the plan is none."""
    (part / FILE).write_text(tomlkit.dumps(_document(plan, places)), encoding="utf-8")
    if not plan.settings:
        return
    try:
        change_settings(part, plan.settings)
    except UsageError as error:
        what = f"cannot set {', '.join(plan.settings)}:"
        raise UsageError(what, error.why, "Nothing was made; correct it and try again.") from error


def _merge_into(part: Path, folder: Path) -> None:
    """Move into an existing folder without a trial, refusing to overwrite; trial.toml last."""
    names = sorted(part.iterdir(), key=lambda p: p.name == FILE)
    taken = [p.name for p in names if (folder / p.name).exists()]
    if taken:
        raise UsageError(
            f"{folder} exists and holds {', '.join(taken)}.",
            "A new trial never overwrites a file.",
            "Choose another name.",
        )
    for path in names:
        path.rename(folder / path.name)


@dataclass(frozen=True)
class _Places:
    """Where each recording is named in trial.toml."""

    names: dict[str, str]

    def get(self, path: str | None) -> str | None:
        return self.names[path] if path else None


def _place(part: Path, folder: Path, plan: NewTrial, tick: Tick) -> _Places:
    """Copy the recordings into the trial, or name them where they are.

    What lies in the trial's folder already (``olivevib capture`` puts it there) stays there.
    """
    wanted = _wanted(plan)
    home = folder.resolve()
    for done, (source, name) in enumerate(wanted.items()):
        tick(done, len(wanted), "copying recordings" if not plan.link else "checking recordings")
        file = Path(source.split("#")[0])
        if file.resolve().is_relative_to(home):
            wanted[source] = file.resolve().relative_to(home).as_posix()
        elif plan.link:
            wanted[source] = str(file.resolve())
        else:
            _copy(file, part / name.split("#")[0])
    return _Places(wanted)


def _wanted(plan: NewTrial) -> dict[str, str]:
    """Every file of the plan and the name it gets in the trial."""
    wanted: dict[str, str] = {}  # source -> name in the trial
    for side in SIDES:
        source = getattr(plan, side)
        wanted.setdefault(source, side + Path(source).suffix.lower())
    for side in SIDES:
        source = getattr(plan, f"calibration_{side}")
        if source:
            suffix = Path(source).suffix.lower() if Path(source).is_file() else ""
            wanted.setdefault(source, f"calibration/{side}{suffix}")
    if plan.calibration_left and plan.calibration_left == plan.calibration_right:
        wanted[plan.calibration_left] = "calibration/stills"
    for source in (plan.left_stamps, plan.right_stamps):
        if source:
            wanted.setdefault(source, Path(source).name)
    for number, sensor in enumerate(plan.every_sensor, start=1):
        name = "accelerometer" if number == 1 else f"accelerometer_{number}"
        wanted.setdefault(sensor.file, name + Path(sensor.file).suffix)
    if plan.preset:
        wanted.setdefault(plan.preset, "accelerometer.preset.toml")
    if plan.rig:
        wanted.setdefault(plan.rig, "shared_rig.toml")
    if plan.markers.endswith(".toml"):
        wanted.setdefault(plan.markers, Path(plan.markers).name)
    return wanted


def _copy(source: Path, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    if source.is_dir():
        target.mkdir(exist_ok=True)
        for still in sorted(source.iterdir()):
            if still.suffix.lower() in IMAGE_SUFFIXES:
                shutil.copyfile(still, target / still.name)
        return
    shutil.copyfile(source, target)
    if sidecar_of(source).is_file():  # the checksums of a recording go with it
        shutil.copyfile(sidecar_of(source), sidecar_of(target))


def _document(plan: NewTrial, places: _Places) -> tomlkit.TOMLDocument:
    """trial.toml with comments that teach, and empty places for what only a person knows."""
    doc = tomlkit.document()
    doc.add(tomlkit.comment("An olivevib trial. Edit with any text editor; comments stay."))
    doc["session"] = _table({"date": "", "place": "", "operator": "", "notes": ""})
    if plan.simulated:
        doc["session"]["simulated"] = True
    doc["tree"] = _table({"id": "", "cultivar": "", "training": ""})
    doc["tree"].add(tomlkit.comment("trunk_diameter_mm = 180   clamp_height_mm = 900"))
    doc["machine"] = _table({"make": "", "type": ""})
    doc["machine"].add(tomlkit.comment("set_frequency_hz = 25.0   shaking_time_s = 8.0"))
    doc["markers"] = _markers(plan, places)
    doc["cameras"] = _cameras(plan, places)
    calibration = _calibration(plan, places)
    if calibration:
        doc["calibration"] = calibration
    if plan.every_sensor:
        doc["accelerometers"] = tomlkit.aot()
    for sensor in plan.every_sensor:
        told = {
            "file": places.get(sensor.file),
            "marker": sensor.marker,
            "preset": places.get(plan.preset),
            "axes": list(sensor.axes) or None,
            "lever_mm": None if sensor.lever_mm is None else list(sensor.lever_mm),
        }
        doc["accelerometers"].append(_table(told))
    if plan.band_hz:
        doc["vibration"] = _table({"band_hz": list(plan.band_hz)})
    doc["outcome"] = _table({})
    doc["outcome"].add(tomlkit.comment("removed_kg = 12.4   left_kg = 2.1   damage = 'none'"))
    return doc


def _markers(plan: NewTrial, places: _Places) -> Table:
    library = places.get(plan.markers) if plan.markers.endswith(".toml") else plan.markers
    table = _table({"library": library, "size_mm": plan.size_mm, "ids": list(plan.ids) or None})
    table.add(
        tomlkit.comment("where each one sits, for the report (trunk, branch, twig or fixed):")
    )
    each = sorted({*plan.places, *plan.sizes_mm})
    if not each:
        for line in ("[[markers.marker]]", "id = 1", "place = 'trunk'"):
            table.add(tomlkit.comment(line))
        return table
    table["marker"] = tomlkit.aot()
    for marker in each:
        size = plan.sizes_mm.get(marker)
        row = {"id": marker, "place": plan.places.get(marker), "size_mm": size}
        table["marker"].append(_table(row))
    return table


def _cameras(plan: NewTrial, places: _Places) -> Table:
    table = _table({"shutter": plan.shutter})
    for side, row_time in zip(SIDES, plan.row_time_us, strict=True):
        video = getattr(plan, side)
        stamps = _stamps(plan, places, side)
        table[side] = _table(
            {
                "video": places.get(video),
                "stamps": stamps,
                "row_time_us": row_time,
                "exposure_ms": plan.exposure_ms,
            }
        )
    return table


def _stamps(plan: NewTrial, places: _Places, side: str) -> str | None:
    """The stamp file with the camera in it, since the copied video has lost its own name."""
    source = getattr(plan, f"{side}_stamps")
    if not source:
        return None
    camera = pick_camera(source, Path(getattr(plan, side)).name)
    name = str(places.get(source)).split("#")[0]
    return name if camera is None else f"{name}#{camera}"


def _calibration(plan: NewTrial, places: _Places) -> Table | None:
    if plan.rig:
        return _table({"rig": places.get(plan.rig)})
    if not plan.calibration_left:
        return None
    same = {side: getattr(plan, f"calibration_{side}") == getattr(plan, side) for side in SIDES}
    return _table(
        {
            "left": places.get(plan.calibration_left),
            "right": places.get(plan.calibration_right),
            "left_stamps": _stamps(plan, places, "left") if same["left"] else None,
            "right_stamps": _stamps(plan, places, "right") if same["right"] else None,
            "board": plan.board,
        }
    )


def _table(values: Mapping[str, object]) -> Table:
    table = tomlkit.table()
    for key, value in values.items():
        if value is not None:
            table[key] = value
    return table
