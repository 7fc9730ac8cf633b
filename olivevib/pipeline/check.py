"""Integrity of a trial: what is whole, what is lost, what can be remade."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from olivevib.errors import OlivevibError
from olivevib.files.capture import verify
from olivevib.files.packets import frame_stamps
from olivevib.files.rig_file import read_rig
from olivevib.files.stamps import read_stamp_file
from olivevib.files.stills import open_source
from olivevib.files.store import read_stage
from olivevib.files.trial_folders import FILE
from olivevib.pipeline.recordings import SIDES
from olivevib.progress import Tick, silent
from olivevib.trial import STAGES, Trial
from olivevib.trial.fingerprints import PRIVATE, RIG


@dataclass(frozen=True)
class Finding:
    """One thing in a trial, and how it is.

    state: "whole", "damaged" (usable in part), "remake" (a stage), "faulty" (there, but it cannot
    be read as it is) or "lost" (not there).
    """

    state: str
    what: str
    words: str


def check(folder: Path, tick: Tick = silent) -> list[Finding]:
    """Read everything in a trial from end to end; nothing is changed."""
    try:
        trial = Trial.open(folder)
    except OlivevibError as error:
        return [_unread(folder / FILE, FILE, error)]
    return [
        _settings(trial),
        *_recordings(trial, tick),
        *_stamps(trial),
        *_sensors(trial),
        *_stages(trial),
        *_outputs(trial),
    ]


def _unread(path: Path, name: str, error: OlivevibError) -> Finding:
    """Faulty or lost: a file that is there may be corrected, one that is gone may not."""
    return Finding("faulty" if path.exists() else "lost", name, f"{error}")


def _settings(trial: Trial) -> Finding:
    cameras = trial.settings.cameras
    gone = [side for side in SIDES if not getattr(cameras, side).video]
    words = f"names no {' and no '.join(gone)} video; perhaps it was cut off" if gone else ""
    return Finding("damaged" if gone else "whole", "trial.toml", words)


def _recordings(trial: Trial, tick: Tick) -> Iterator[Finding]:
    cameras, calibration = trial.settings.cameras, trial.settings.calibration
    named = [(side, getattr(cameras, side).video) for side in SIDES]
    named += [(side, getattr(calibration, side)) for side in SIDES]
    seen: set[tuple[str, str]] = set()
    for side, name in named:
        if name and (side, name) not in seen:
            seen.add((side, name))
            yield _recording(trial.path(name), name, side, tick)
            yield from _checksums(trial.path(name), name, tick)


def _recording(path: Path, name: str, side: str, tick: Tick) -> Finding:
    frames = 0
    try:
        with open_source(path, side) as source:
            for _ in source.frames():
                frames += 1
                tick(frames, None, f"reading {name}")
            cautions = source.cautions
    except OlivevibError as error:
        return _unread(path, name, error)
    told = "; ".join(_without(path, c.text) for c in cautions)
    return Finding("damaged" if told else "whole", name, told or f"{frames} frames")


def _without(path: Path, text: str) -> str:
    """A sentence about a file whose name stands before it already."""
    for name in (str(path), str(path.resolve())):
        text = text.removeprefix(name)
    return text.lstrip(": ").removesuffix(".")


def _checksums(path: Path, name: str, tick: Tick) -> Iterator[Finding]:
    """Every frame against the side-car that olivevib's recorder wrote beside it, if it did."""
    if path.is_dir():
        return
    try:
        verified = verify(path, tick)
    except OlivevibError as error:
        yield _unread(path, f"{name}, checksums", error)
        return
    if verified is not None:
        state = "whole" if verified.whole else "damaged"
        yield Finding(state, f"{name}, checksums", verified.words)


def _stamps(trial: Trial) -> Iterator[Finding]:
    """The files of time stamps that trial.toml names, read."""
    for side in SIDES:
        camera = getattr(trial.settings.cameras, side)
        name = camera.stamps
        if not name:
            continue
        try:
            frames = len(frame_stamps(trial.path(camera.video)))
            stamps = read_stamp_file(trial.path(name), camera.video, frames)
        except OlivevibError as error:
            yield _unread(trial.path(name), name, error)
        else:
            yield Finding("whole", name, f"{len(stamps)} stamps")


def _outputs(trial: Trial) -> Iterator[Finding]:
    """Reports and exports: whether each reached its end; they can always be made anew."""
    pages = [trial.folder / name for name in ("report.html", "report.pdf")]
    exports = trial.folder / "exports"
    files = sorted(p for p in exports.iterdir() if p.is_file()) if exports.is_dir() else []
    for path in [p for p in pages if p.exists()] + files:
        name = path.relative_to(trial.folder).as_posix()
        to = "report" if path in pages else f"export {trial.name} --to {path.suffix[1:]}"
        again = f"Make it anew: olivevib {to}" + (f" {trial.name}" if path in pages else "")
        if _ended(path):
            yield Finding("whole", name, f"{path.stat().st_size} bytes")
        else:
            yield Finding("remake", name, f"It ends before its time. {again}")


_ENDS = {".html": b"</html>", ".pdf": b"%%EOF", ".step": b"END-ISO-10303-21;", ".dxf": b"EOF",
         ".parquet": b"PAR1"}  # fmt: skip


def _ended(path: Path) -> bool:
    """Whether a file has the last words of its format (those without any: at least a byte)."""
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            file.seek(max(0, size - 64))
            tail = file.read().rstrip()
    except OSError:
        return False
    return size > 0 and tail.endswith(_ENDS.get(path.suffix.lower(), b""))


def _sensors(trial: Trial) -> Iterator[Finding]:
    from olivevib.pipeline.compare import sensor_record

    for sensor in trial.settings.accelerometers:
        try:
            record = sensor_record(trial, sensor)
        except OlivevibError as error:
            yield _unread(trial.path(sensor.file), sensor.file, error)
        else:
            words = f"{record.samples.t_s.size} samples at {record.rate_hz:.2f} Hz"
            yield Finding("whole", sensor.file, words)


def _stages(trial: Trial) -> Iterator[Finding]:
    states = trial.states()
    for stage in STAGES:
        path = trial.folder / stage.file
        if not path.exists():
            continue
        try:
            read_stage(path, stage.name)
        except OlivevibError as error:
            yield Finding("remake", stage.file, f"{error} Run: olivevib run {trial.name}")
        else:
            yield Finding("whole", stage.file, str(states[stage.name].state))
    if (trial.folder / RIG).exists():
        try:
            read_rig(trial.folder / RIG)
        except OlivevibError as error:
            yield Finding("remake", RIG, f"{error} Run: olivevib calibrate {trial.name}")
        else:
            yield Finding("whole", RIG, "")
    if (trial.folder / PRIVATE / "track.journal").exists():
        yield Finding("whole", "track.journal", "unfinished tracking; run goes on from there")
