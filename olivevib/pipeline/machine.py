"""What works on this machine: versions, codecs, cameras, disk, terminal."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import os
import platform
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from olivevib import __version__

if TYPE_CHECKING:
    from olivevib.pipeline.capture.devices import CameraReport

NEEDED = (
    *("numpy", "scipy", "opencv-python-headless", "pandas", "h5py", "matplotlib", "textual"),
    *("av", "jinja2", "pydantic", "tomlkit", "ezdxf", "pyuff"),
)
EXTRAS = {
    "ezc3d": "export --to c3d",
    "idelib": "import of .IDE accelerometer files",
    "distributed": "batch --scheduler",
    "textual_serve": "the app in a browser",
    "typst": "reports as PDF",
}
CODECS = {"mjpeg": "MJPEG webcams", "h264": "H.264 files", "hevc": "H.265 files"}
LEAST_FREE_GB = 5.0
WEBCAMS_BYTES_S = 6e6  # two at 1280 x 720 and 30 frames/s


@dataclass(frozen=True)
class Check:
    """One line of the doctor: group, what, "ok", "note" or "missing", and words with the remedy."""

    group: str
    what: str
    state: str
    words: str


def examine(folder: Path) -> list[Check]:
    """Look at the machine; ``folder`` is where trials would go.

    Every camera runs for a second; its manual settings are tried and put back.
    """
    from olivevib.pipeline.capture.devices import report_cameras

    reports = report_cameras()
    return [
        *_versions(),
        *_codecs(),
        *_cameras(reports),
        _disk(folder, sum(report.rate_bytes_s for report in reports)),
        _processor(),
        *_terminal(),
    ]


def _versions() -> list[Check]:
    out = [Check("versions", "olivevib", "ok", __version__)]
    python = platform.python_version()
    state = "ok" if sys.version_info >= (3, 11) else "missing"
    out.append(Check("versions", "python", state, f"{python} (3.11 or newer is needed)"))
    for name in NEEDED:
        try:
            out.append(Check("versions", name, "ok", importlib.metadata.version(name)))
        except importlib.metadata.PackageNotFoundError:
            remedy = "not installed; run make test, or pip install it"
            out.append(Check("versions", name, "missing", remedy))
    for name, use in EXTRAS.items():
        there = importlib.util.find_spec(name) is not None
        words = use if there else f"optional: needed only for {use}"
        out.append(Check("extras", name, "ok" if there else "note", words))
    return out


def _codecs() -> list[Check]:
    import av

    known = av.codecs_available
    return [
        Check("codecs", name, "ok" if name in known else "missing", f"reads {use}")
        for name, use in CODECS.items()
    ]


def _cameras(reports: Sequence[CameraReport]) -> list[Check]:
    """Every camera with its true rate, its modes, and whether manual settings hold."""
    if not reports:
        return [Check("cameras", "none", "note", "no camera is connected; recordings still work")]
    checks = []
    for number, report in enumerate(reports):
        sound = not report.fault and report.exposure_holds is not False
        name = f"{number}: {report.listed.address}"
        checks.append(Check("cameras", name, "ok" if sound else "note", report.words))
    return checks


def _disk(folder: Path, rate_bytes_s: float) -> Check:
    """Free space, and how long two cameras can record into it."""
    free = shutil.disk_usage(folder).free
    minutes = free / max(rate_bytes_s, WEBCAMS_BYTES_S) / 60
    words = f"{free / 1e9:.0f} GB free: about {minutes:.0f} minutes of two MJPEG webcams"
    state = "ok" if free > LEAST_FREE_GB * 1e9 else "note"
    return Check("disk", str(folder.resolve()), state, words)


def _processor() -> Check:
    cores = os.cpu_count() or 1
    words = f"{cores} cores" + ("" if cores > 1 else "; two read both cameras at once")
    return Check("machine", platform.machine(), "ok" if cores > 1 else "note", words)


def _terminal() -> list[Check]:
    size = shutil.get_terminal_size()
    fits = size.columns >= 80 and size.lines >= 24
    words = f"{size.columns} x {size.lines}" + ("" if fits else "; the app needs 80 x 24")
    stream = sys.__stdout__ or sys.stdout  # the app puts something of its own in the latter's place
    encoding = (stream.encoding or "").lower()
    unicode_words = encoding or "unknown"
    out = [Check("terminal", "size", "ok" if fits else "note", words)]
    plain = "utf" not in encoding
    remedy = "; set PYTHONUTF8=1 for plots" if plain else ""
    out.append(Check("terminal", "encoding", "note" if plain else "ok", unicode_words + remedy))
    if "NO_COLOR" in os.environ:
        out.append(Check("terminal", "colour", "note", "off, because NO_COLOR is set"))
    return out
