"""What one trial report is made from: frozen values of the trial, nothing of the disk."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from olivevib.comparison import Comparison
from olivevib.errors import Caution
from olivevib.geometry import StereoRig
from olivevib.reconstruction.trajectory import Trajectory
from olivevib.report.clean import clean
from olivevib.report.decay import FreeDecay, free_decays
from olivevib.report.lines import folded_hz
from olivevib.report.transfer import Transmissibility, surveyed
from olivevib.signals import fit_stamps
from olivevib.tracking import Track
from olivevib.trial.records.calibration import CalibrationRecord
from olivevib.vibration import Line, Phase, Spectrum, Survey, Vibration
from olivevib.vibration.verdict import SWAY_HZ

BAND = 4.0  # times the highest line: what of a spectrum is worth drawing


@dataclass(frozen=True)
class ReportContent:
    """Everything that one report shows.

    record: sections of trial.toml (session, tree, machine, markers, …) as plain values. summary:
    the content of ``show --json``. places: words for each marker id. sway_hz: slower motion counts
    as sway. next_time: what would make the frequency surer in another trial. provenance: versions,
    settings and hashes as plain text, ``command`` among them. recordings: for left and right what
    the stored recording says of itself (rate, jitter, drops).
    """

    name: str
    record: Mapping[str, Any] = field(default_factory=dict)
    summary: Mapping[str, Any] = field(default_factory=dict)
    places: Mapping[int, str] = field(default_factory=dict)
    simulated: bool = False
    rig: StereoRig | None = None
    calibration: CalibrationRecord | None = None
    tracks: tuple[Track, ...] = ()
    recordings: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    trajectory: Trajectory | None = None
    vibration: Vibration | None = None
    comparisons: tuple[Comparison, ...] = ()
    cautions: tuple[Caution, ...] = ()
    sway_hz: float = SWAY_HZ
    next_time: tuple[str, ...] = ()
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def marker_name(self, marker_id: int, longest: int = 28) -> str:
        """``3 · trunk``, or the id alone where no place was entered."""
        place = clean(self.places.get(marker_id, ""), longest)
        return f"{marker_id} · {place}" if place else f"{marker_id}"

    def names(self) -> dict[int, str]:
        """The name of every marker that any result mentions."""
        ids: set[int] = set(self.places) | {t.id for t in self.tracks}
        if self.trajectory is not None:
            ids |= {int(i) for i in self.trajectory.ids}
        if self.displacement is not None:
            ids |= {int(i) for i in self.displacement.ids}
        return {i: self.marker_name(i) for i in sorted(ids)}

    @property
    def displacement(self) -> Spectrum | None:
        """The displacement spectrum, whose lines every table quotes."""
        return None if self.vibration is None else self.vibration.spectra.get("displacement")

    @property
    def phases(self) -> tuple[Phase, ...]:
        """The phases of the trial, in order."""
        return () if self.vibration is None else self.vibration.phases

    def lines(self) -> dict[int, Line]:
        """The dominant displacement line of each marker."""
        spectrum = self.displacement
        if spectrum is None:
            return {}
        return {int(i): line for i, line in zip(spectrum.ids, spectrum.lines, strict=True)}

    @property
    def continuous(self) -> bool:
        """Whether the paths are those of a fitted motion, finer than the frames."""
        return self.trajectory is not None and self.trajectory.method == "continuous"

    @cached_property
    def shown_path(self) -> Trajectory | None:
        """The paths as they are drawn: of a fitted motion only where the fit holds.

        Before and after, frames of cameras out of step show false depth.
        """
        path, steady = self.trajectory, [p for p in self.phases if p.name == "steady"]
        if path is None or not self.continuous or not steady:
            return path
        kept = (path.t_s >= steady[0].start_s) & (path.t_s <= steady[-1].end_s)
        return path.rows(kept) if kept.sum() > 1 else path

    @property
    def frames(self) -> int:
        """How many pictures the left camera delivered; instants of the paths where unknown."""
        told = self.recordings.get("left", {}).get("frames")
        if isinstance(told, int) and self.continuous:
            return told
        return 0 if self.trajectory is None else int(self.trajectory.t_s.size)

    @property
    def half_rate_hz(self) -> float:
        """Where spectra fold: half the frame rate, or the end of a fitted motion's axis."""
        path, spectrum = self.trajectory, self.displacement
        if self.continuous and spectrum is not None and spectrum.f_hz.size:
            return float(spectrum.f_hz[-1])
        if path is not None and path.t_s.size > 1:
            return fit_stamps(path.t_s).rate_hz / 2
        return float(spectrum.f_hz[-1]) if spectrum is not None else float("nan")

    @property
    def fold_hz(self) -> float:
        """Half the frame rate, above which frequencies fold, Hz."""
        rate = self.recordings.get("left", {}).get("rate_hz")
        return float(rate) / 2 if isinstance(rate, float) and self.continuous else self.half_rate_hz

    @property
    def shown_hz(self) -> float:
        """How far spectra are drawn: four times the highest line, at most to their end."""
        seen = [folded_hz(line.f_hz, self.half_rate_hz) for line in self.lines().values()]
        highest = max((f for f in seen if np.isfinite(f)), default=np.inf)
        return float(min(self.half_rate_hz, BAND * highest))

    @property
    def survey(self) -> Survey | None:
        """Orbits, decays, transmissibility, deflection shape; None before analyse."""
        return None if self.vibration is None else self.vibration.survey

    @cached_property
    def transmissibility(self) -> Transmissibility | None:
        """Every marker's dominant line against that of the reference; None where none shares it."""
        return surveyed(self.survey)

    @cached_property
    def decays(self) -> tuple[FreeDecay, ...]:
        """The free decays that the analysis found."""
        return free_decays(self.survey, self.trajectory, self.phases)
