"""The studies by name: what each measures, and the function that does it (loaded when asked)."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module

from olivevib.errors import UsageError
from olivevib.studies.study import StudyFunction


@dataclass(frozen=True)
class Entry:
    """One study: its name on the command line, a line on what it measures, module:function."""

    name: str
    what: str
    function: str

    def load(self) -> StudyFunction:
        """The function; UsageError where a package that it compares with is not installed."""
        module, function = self.function.split(":")
        try:
            found: StudyFunction = getattr(import_module(f"olivevib.studies.{module}"), function)
        except ModuleNotFoundError as error:
            if (error.name or "").startswith("olivevib"):
                raise  # a file of ours is missing, nothing that could be installed
            raise UsageError(
                f"{self.name} needs the package {error.name}, which is not installed.",
                "It compares olivevib with other libraries.",
                "Install what the tests need: pip install 'olivevib[test]'",
            ) from error
        return found


PAPER: tuple[Entry, ...] = (
    Entry("6.1", "729 runs of the extraction, efficiency over the angle of view", "factorial:run"),
    Entry("6.2", "calibration: Tab. 2, Fig. 15, Fig. 16", "calibration.paper_table:run"),
    Entry("6.3", "two toy cars on closed tracks, in step and 2 ms apart", "toy_cars:run"),
)
BENCHMARKS: tuple[Entry, ...] = (
    Entry("app", "first picture, keys while a stage runs, cancelling", "app:run"),
    Entry("batch", "overhead, two workers, kill -9 and resume, memory", "seasons.batch:run"),
    Entry("blind", "frequency above the frame rate: verdict against truth, blind", "blind:run"),
    Entry("capture", "what the recorder loses, and what its checksums find", "capture.study:run"),
    Entry("calibration", "accuracy and time beside cv2", "calibration.peer:run"),
    Entry("calibration-boards", "boards of others, single markers", "calibration.foreign:run"),
    Entry("calibration-centres", "centres of coded markers", "calibration.centres:run"),
    Entry("calibration-faults", "twelve seeded faults, false alarms", "calibration.faults:run"),
    Entry("calibration-honesty", "sigmas against what is observed", "calibration.honesty:run"),
    Entry("calibration-webcams", "four webcams: unused frames, latency", "calibration.webcams:run"),
    Entry("detection", "all of the detection-… studies", "detection.everything:run"),
    Entry("detection-rates", "markers found by size and tilt, beside peers", "detection.rates:run"),
    Entry("detection-accuracy", "centres against bound and peers", "detection.accuracy:run"),
    Entry("detection-honesty", "what the stated ellipses hold", "detection.honesty:run"),
    Entry("detection-occlusion", "covered markers", "detection.hardship:occlusion"),
    Entry("detection-blur", "motion blur in a full scan", "detection.hardship:blur"),
    Entry("detection-light", "shadows, gradients, dappled sun", "detection.hardship:light"),
    Entry("detection-follow", "priors, motion blur and time in tracking", "detection.follow:run"),
    Entry("detection-clutter", "false markers in leaf clutter", "detection.clutter:run"),
    Entry("detection-speed", "CPU time of a full scan, beside peers", "detection.speed:run"),
    Entry("detection-track", "pairs a second through two videos", "detection.throughput:run"),
    Entry("exposure", "what the exposure takes from an amplitude", "exposure:run"),
    Entry("timing", "frequency, motion and clocks above the frame rate, rendered", "timing:run"),
    Entry("report", "time and size of reports and exports", "seasons.report:run"),
    Entry("vibration", "lines, conversion, damping, comparison, import, cost", "vibration:run"),
)


def find(kind: tuple[Entry, ...], name: str) -> Entry:
    """The study of this name, or of the only one that begins so; UsageError otherwise."""
    hits = [entry for entry in kind if entry.name == name] or [
        entry for entry in kind if entry.name.startswith(name)
    ]
    if len(hits) != 1:
        names = ", ".join(entry.name for entry in kind)
        raise UsageError(f"{name!r} is no study.", "", f"Name one of: {names}.")
    return hits[0]
