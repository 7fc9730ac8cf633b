"""The marker library that a trial names, and the corners of its markers in mm."""

from __future__ import annotations

import numpy as np

from olivevib.arrays import Floats
from olivevib.detection import Wrapped
from olivevib.detection.foreign import dictionary
from olivevib.errors import UsageError
from olivevib.marker import MarkerLibrary, load_library
from olivevib.reconstruction.motion import Pattern
from olivevib.trial import Trial, TrialSettings
from olivevib.trial.fingerprints import library_file


def trial_library(trial: Trial) -> MarkerLibrary:
    """The library of a trial, its declared ids alone where some are declared."""
    markers = trial.settings.markers
    file = library_file(trial.folder, markers.library)
    library = load_library(str(file) if file else markers.library)
    return only_known(library, markers.ids)


def wrapped_markers(trial: Trial) -> tuple[Wrapped, ...]:
    """The markers that trial.toml says are wrapped round a branch, radius in their own modules."""
    markers = trial.settings.markers
    modules = trial_library(trial).layout.modules
    out = []
    for one in markers.marker:
        size, diameter = markers.size_of(one.id), one.branch_diameter_mm
        radius = modules * diameter / (2 * size) if size and diameter else None
        if one.wrapped:
            out.append(Wrapped(one.id, radius, one.axis_deg))
    return tuple(out)


def only_known(library: MarkerLibrary, ids: tuple[int, ...]) -> MarkerLibrary:
    """The declared ids of a library; UsageError naming those it does not have."""
    unknown = sorted(set(ids) - {int(i) for i in library.ids})
    if unknown:
        low, high = int(library.ids.min()), int(library.ids.max())
        raise UsageError(
            f"library {library.name} has no marker {', '.join(map(str, unknown))}.",
            f"It holds {library.ids.size} ids between {low} and {high}.",
            "Correct --ids (markers.ids in trial.toml), or name the library that was printed.",
        )
    return library.only(ids) if ids else library


def corners_mm(library: MarkerLibrary, settings: TrialSettings, marker: int) -> Floats:
    """The corners (4, 3) of one marker in its own frame, mm; UsageError without a size."""
    size = settings.markers.size_of(marker)
    if size is None:
        raise UsageError(
            f"the size of marker {marker} is not known.",
            "Its outer side in mm gives the turn of its plane and a check of the scale.",
            "State it with --size MM (markers.size_mm in trial.toml).",
        )
    flat = library.layout.cornerstones * (size / library.layout.modules)
    return np.column_stack([flat, np.zeros(4)])


def pattern_of(library: MarkerLibrary, settings: TrialSettings, marker: int) -> Pattern | None:
    """The dark modules of one marker with their size; None where it is not flat, or has no size."""
    size = settings.markers.size_of(marker)
    bent = any(one.id == marker and one.wrapped for one in settings.markers.marker)
    if size is None or bent:
        return None
    modules = library.layout.modules
    if library.family == "olive":
        row = int(np.flatnonzero(library.ids == marker)[0])
        dark = library.layout.pattern(library.codes[row])
    else:
        dark = dictionary(library.dictionary).generateImageMarker(marker, modules) == 0
    return Pattern(dark, size / modules)
