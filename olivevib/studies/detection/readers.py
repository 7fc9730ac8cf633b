"""The detectors that are compared, each with the markers it reads, behind one call."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from pupil_apriltags import Detector as AprilTags  # type: ignore[import-untyped]

from olivevib.arrays import Floats, Grey
from olivevib.detection import DetectionSettings, Detector
from olivevib.geometry import diagonal_crossing
from olivevib.marker import MarkerLibrary, load_library
from olivevib.simulation.planar import dictionary_modules
from olivevib.studies.detection.canvas import Print

ARUCO, APRILTAG = "DICT_4X4_50", "DICT_APRILTAG_36h11"
MARKERS = 48  # of each family that are drawn


@dataclass(frozen=True)
class Seen:
    """One marker as a detector reports it; covariance (2, 2) px² where it states one."""

    id: int
    centre: Floats
    flags: tuple[str, ...] = ()
    covariance: Floats | None = None


@dataclass(frozen=True)
class Peer:
    """A detector by name, its prints by id, and how it reads a picture."""

    name: str
    prints: dict[int, Print]
    read: Callable[[Grey], list[Seen]]


def ours(mode: str = "default", library: MarkerLibrary | None = None) -> Peer:
    """The detector of olivevib as it ships."""
    codes = library or load_library()
    layout = codes.layout
    ids = [int(i) for i in codes.ids[:MARKERS]]
    prints = {i: Print(layout.pattern(codes.code(i)), layout.quiet) for i in ids}
    detector = Detector(codes, DetectionSettings(mode=mode))

    def read(grey: Grey) -> list[Seen]:
        return [Seen(d.id, d.centre_px, d.flags, d.centre_cov_px2) for d in detector.detect(grey)]

    return Peer("olivevib" if mode == "default" else f"olivevib {mode}", prints, read)


def aruco(refinement: str) -> Peer:
    """cv2.aruco on its 4 x 4 markers, "none", "subpix" or "contour"."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = getattr(cv2.aruco, f"CORNER_REFINE_{refinement.upper()}")
    table = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, ARUCO))
    detector: Any = cv2.aruco.ArucoDetector(table, parameters)

    def read(grey: Grey) -> list[Seen]:
        quads, ids, _ = detector.detectMarkers(grey)
        numbers = [] if ids is None else [int(i) for i in np.ravel(ids)]
        return [
            Seen(i, diagonal_crossing(np.asarray(quad, np.float64).reshape(4, 2)))
            for i, quad in zip(numbers, quads, strict=True)
        ]

    return Peer(f"aruco {refinement}", _foreign(ARUCO), read)


class _LastingTags(AprilTags):  # type: ignore[misc]
    """A detector that is never freed: its own way of doing so frees pointers it has cut short."""

    def __del__(self) -> None:
        """Leave the memory to the end of the process."""


def apriltag() -> Peer:
    """AprilTag 3 on 36h11, whole resolution, one thread; its centre less half a pixel."""
    detector = _LastingTags(families="tag36h11", nthreads=1, quad_decimate=1.0)

    def read(grey: Grey) -> list[Seen]:
        return [
            Seen(int(d.tag_id), np.asarray(d.center, np.float64) - 0.5)
            for d in detector.detect(grey)
        ]

    return Peer("AprilTag 3", _foreign(APRILTAG), read)


def everyone() -> list[Peer]:
    """Ours first, then the peers."""
    return [ours(), aruco("none"), aruco("subpix"), aruco("contour"), apriltag()]


def facts() -> tuple[tuple[str, str], ...]:
    """Versions of what was compared."""
    from importlib.metadata import version

    return (
        ("OpenCV", cv2.__version__),
        ("pupil-apriltags (AprilTag 3)", version("pupil-apriltags")),
        ("numpy", np.__version__),
    )


def _foreign(name: str) -> dict[int, Print]:
    return {i: Print(dictionary_modules(name, i), 1.0) for i in range(MARKERS)}
