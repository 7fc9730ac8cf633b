"""What each stage depends on: the content of its input files and the settings it reads."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from olivevib.errors import InputError
from olivevib.files.hashing import HashCache
from olivevib.trial.settings import TrialSettings
from olivevib.trial.stages import Fingerprint, Stage

RIG = "rig.toml"
PRIVATE = ".olivevib"  # derived data only: hash cache, journals, reasons of failures


def resolve(folder: Path, name: str) -> Path:
    """A file named in trial.toml: absolute, or relative to the trial's folder."""
    path = Path(name).expanduser()
    return path if path.is_absolute() else folder / path


def library_file(folder: Path, library: str) -> Path | None:
    """The TOML file of a marker library, or None for a shipped or a foreign one."""
    if not library.endswith(".toml"):
        return None
    own = resolve(folder, library)
    return own if own.exists() else folder.parent.parent / "markers" / Path(library).name


def fingerprint(folder: Path, settings: TrialSettings, stage: Stage) -> Fingerprint:
    """What ``stage`` would depend on if it ran now; InputError where an input is not there."""
    hashes = HashCache(folder / PRIVATE / "hashes.json")
    files = {
        "calibrate": _calibrate,
        "track": _track,
        "reconstruct": _reconstruct,
        "analyse": _trajectory,
        "compare": _compare,
    }[stage.name](folder, settings)
    inputs = {}
    for name, path in files.items():
        if not path.exists():
            raise InputError(
                f"{path} is missing.",
                f"The stage {stage.name} needs it as its {name}.",
                "Put the file back, or correct its name in trial.toml.",
            )
        inputs[name] = hashes.of(path)
    return Fingerprint(inputs, _settings(settings, stage))


def _calibrate(folder: Path, settings: TrialSettings) -> dict[str, Path]:
    c = settings.calibration
    if c.rig:
        return {"rig": resolve(folder, c.rig)}
    names = {"calibration left": c.left, "calibration right": c.right}
    names |= {"left stamps": c.left_stamps, "right stamps": c.right_stamps}
    return {name: _stampless(resolve(folder, value)) for name, value in names.items() if value}


def _track(folder: Path, settings: TrialSettings) -> dict[str, Path]:
    left, right = settings.cameras.left, settings.cameras.right
    for side, video in (("left", left.video), ("right", right.video)):
        if not video:
            raise InputError(
                f"trial.toml names no {side} video.",
                "Without it there is nothing to track; perhaps the file was cut off.",
                f'Write video = "FILE" under [cameras.{side}] in trial.toml.',
            )
    names = {"left video": left.video, "right video": right.video}
    names |= {"left stamps": left.stamps or "", "right stamps": right.stamps or ""}
    files = {name: _stampless(resolve(folder, value)) for name, value in names.items() if value}
    library = library_file(folder, settings.markers.library)
    return files | ({"marker library": library} if library else {})


def _reconstruct(folder: Path, settings: TrialSettings) -> dict[str, Path]:
    names = ("tracks.h5", RIG, "calibration.h5")
    files = {name: folder / name for name in names}
    chosen = settings.reconstruction
    if chosen.frame == "gravity" and chosen.plumb is None:
        files |= {a.file: resolve(folder, a.file) for a in settings.accelerometers}
    return files


def _trajectory(folder: Path, settings: TrialSettings) -> dict[str, Path]:
    return {"trajectory.h5": folder / "trajectory.h5", "tracks.h5": folder / "tracks.h5"}


def _compare(folder: Path, settings: TrialSettings) -> dict[str, Path]:
    names = [n for a in settings.accelerometers for n in (a.file, a.preset) if n]
    files = {name: resolve(folder, name) for name in names}
    return _trajectory(folder, settings) | files


def _stampless(path: Path) -> Path:
    """The file of ``FILE#camera`` (a stamp file that holds several cameras)."""
    return path if path.exists() else path.with_name(path.name.split("#")[0])


def _settings(settings: TrialSettings, stage: Stage) -> dict[str, Any]:
    """The settings that a stage reads, as JSON values."""
    whole = settings.model_dump(mode="json")
    cameras = {
        f"cameras.{side}.{key}": whole["cameras"][side][key]
        for side in ("left", "right")
        for key in ("row_time_us", "row_time_sigma_us", "row_time_source", "exposure_ms")
    } | {"cameras.shutter": whole["cameras"]["shutter"]}
    markers = whole["markers"]
    sizes = {m["id"]: m["size_mm"] for m in markers["marker"] if m["size_mm"]}
    fixed = settings.markers.at("fixed")
    wrapped = [m for m in markers["marker"] if m["wrapped"]]
    table = {
        "calibrate": cameras | _keyed("calibration", whole["calibration"], _FILE_KEYS),
        "track": cameras
        | {"markers.library": markers["library"], "markers.ids": markers["ids"]}
        | {"wrapped markers": wrapped or None}
        | _keyed("detection", whole["detection"], ()),
        "reconstruct": {"markers.size_mm": markers["size_mm"], "markers.marker.size_mm": sizes}
        | _keyed("reconstruction", whole["reconstruction"], ()),
        "analyse": _keyed("vibration", whole["vibration"], ())
        | {"markers on the trunk": settings.markers.at("trunk"), "fixed markers": fixed},
        "compare": {"accelerometers": whole["accelerometers"], "fixed markers": fixed},
    }
    return {key: value for key, value in table[stage.name].items() if value is not None}


_FILE_KEYS = ("left", "right", "left_stamps", "right_stamps", "rig")


def _keyed(table: str, values: dict[str, Any], leave: tuple[str, ...]) -> dict[str, Any]:
    return {f"{table}.{key}": value for key, value in values.items() if key not in leave}
