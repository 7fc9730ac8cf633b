"""A trial: what the technician knows, what was measured, and what is done, stale or missing."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from olivevib.comparison import Comparison
from olivevib.errors import Caution, InputError, OlivevibError
from olivevib.files.rig_file import read_rig
from olivevib.files.store import StageFile, read_stage
from olivevib.geometry import StereoRig
from olivevib.reconstruction import Reconstruction, Trajectory
from olivevib.trial.document import change_settings, read_settings
from olivevib.trial.fingerprints import PRIVATE, RIG, fingerprint, resolve
from olivevib.trial.records.calibration import CalibrationRecord, calibration_from
from olivevib.trial.records.comparison import comparisons_from
from olivevib.trial.records.tracks import StoredTracks, tracks_from
from olivevib.trial.records.trajectory import reconstruction_from
from olivevib.trial.records.vibration import vibration_from
from olivevib.trial.settings import TrialSettings
from olivevib.trial.stages import BY_NAME, Fingerprint, Stage, StageState, stage_states
from olivevib.vibration import Spectrum, Vibration


@dataclass(frozen=True)
class Trial:
    """One trial folder, opened. Results are read when asked for; None where a stage has not run.

    A Trial is a snapshot of trial.toml; ``reopen()`` gives the folder as it is now.
    """

    folder: Path
    settings: TrialSettings
    damage: tuple[tuple[str, str], ...] = ()  # files left out by ``readable``, and why

    @classmethod
    def open(cls, folder: str | Path) -> Trial:
        """Open a trial folder; InputError with every fault of its trial.toml."""
        path = Path(folder)
        return cls(path, read_settings(path))

    def reopen(self) -> Trial:
        """The same folder as it is on disk now."""
        return Trial.open(self.folder)

    def changed(self, changes: Mapping[str, Any]) -> Trial:
        """The trial with dotted settings changed in its trial.toml, comments kept."""
        return Trial(self.folder, change_settings(self.folder, changes))

    def readable(self) -> Trial:
        """The trial without the files that cannot be read: each counts as not there.

        ``damage`` names them, and ``cautions`` begins with them. A sound trial comes back as it is.
        """
        parts: dict[str, Callable[[], object]] = {
            "rig.toml": lambda: self.rig,
            "calibration.h5": lambda: self.calibration,
            "tracks.h5": lambda: self.tracks,
            "trajectory.h5": lambda: self.reconstruction,
            "vibration.h5": lambda: self.vibration,
            "comparison.h5": lambda: self.comparison,
        }
        damage = []
        for name, read in parts.items():
            try:
                read()
            except OlivevibError as error:
                damage.append((name, f"{error.what} {error.why}".strip()))
        return replace(self, damage=tuple(damage)) if damage else self

    @property
    def name(self) -> str:
        """The folder's name."""
        return self.folder.resolve().name

    def path(self, name: str) -> Path:
        """A file named in trial.toml: absolute, or relative to the trial's folder."""
        return resolve(self.folder, name)

    @property
    def private(self) -> Path:
        """Where derived data stands that may be deleted at any time."""
        return self.folder / PRIVATE

    def fingerprint(self, stage: str | Stage) -> Fingerprint:
        """What a stage depends on now; InputError where an input is missing."""
        which = BY_NAME[stage] if isinstance(stage, str) else stage
        return fingerprint(self.folder, self.settings, which)

    def states(self) -> dict[str, StageState]:
        """The state of every stage, in order, computed from files."""
        return stage_states(self.folder, self.fingerprint, self._wanting())

    def _wanting(self) -> dict[str, str]:
        """Stages without an input to work on, and why."""
        c, out = self.settings.calibration, {}
        if not c.rig and not (c.left and c.right):
            out["calibrate"] = "no board recordings and no rig file are named in trial.toml"
        if not self.settings.accelerometers:
            out["compare"] = "no accelerometer file is named in trial.toml"
        elif all(a.marker is None for a in self.settings.accelerometers):
            out["compare"] = "no accelerometer is bound to a marker (accelerometers.marker)"
        return out

    @cached_property
    def rig(self) -> StereoRig | None:
        """The calibrated pair of rig.toml."""
        path = self.folder / RIG
        there = path.exists() and RIG not in dict(self.damage)
        return read_rig(path) if there else None

    @cached_property
    def tracks(self) -> StoredTracks | None:
        """Both cameras' tracks with stamps and clock fits."""
        file = self._stage_file("track")
        return tracks_from(file) if file else None

    @cached_property
    def reconstruction(self) -> Reconstruction | None:
        """The trajectory with its clock and sigma scale."""
        file = self._stage_file("reconstruct")
        return reconstruction_from(file) if file else None

    @property
    def trajectory(self) -> Trajectory | None:
        """The 3-D paths of the markers."""
        return self.reconstruction.trajectory if self.reconstruction else None

    @cached_property
    def calibration(self) -> CalibrationRecord | None:
        """What the calibration says of itself: residuals, hold-out numbers, verdict, offset."""
        file = self._stage_file("calibrate")
        return calibration_from(file) if file else None

    @cached_property
    def vibration(self) -> Vibration | None:
        """Phases, lines and figures of every marker."""
        file = self._stage_file("analyse")
        return vibration_from(file) if file else None

    @property
    def spectra(self) -> Mapping[str, Spectrum]:
        """Spectra by quantity: displacement, velocity, acceleration; empty before analyse."""
        return self.vibration.spectra if self.vibration else {}

    @cached_property
    def _compared(self) -> tuple[tuple[Comparison, ...], tuple[Caution, ...]]:
        file = self._stage_file("compare")
        return comparisons_from(file) if file else ((), ())

    @property
    def comparison(self) -> tuple[Comparison, ...]:
        """One comparison a bound accelerometer."""
        return self._compared[0]

    @property
    def cautions(self) -> tuple[Caution, ...]:
        """The warnings of every stage that has run, in order."""
        parts = (self.calibration, self.tracks, self.reconstruction, self.vibration)
        found = [c for part in parts if part is not None for c in part.cautions]
        return tuple(dict.fromkeys([*map(_damaged, self.damage), *found, *self._compared[1]]))

    def _stage_file(self, name: str) -> StageFile | None:
        stage = BY_NAME[name]
        path = self.folder / stage.file
        if not path.exists() or stage.file in dict(self.damage):
            return None
        file = read_stage(path, name)
        if file.schema != stage.schema:
            raise InputError(
                f"{path} was written by another version of olivevib.",
                f"It has schema {file.schema}, this version reads {stage.schema}.",
                f"Run: olivevib run {self.name}",
            )
        return file

    def need(self, stage: str) -> InputError:
        """The error for work that needs the result of a stage that has not run."""
        return InputError(
            f"trial {self.name} has no {BY_NAME[stage].file}.",
            f"The stage {stage} has not run.",
            f"Run: olivevib run {self.name}",
        )


def _damaged(file: tuple[str, str]) -> Caution:
    """What is said of a file that was left out."""
    name, why = file
    return Caution(
        "file-damaged",
        f"{name} is left out here: {why}",
        "Run the trial again (olivevib run): what can be made anew is made anew.",
    )
