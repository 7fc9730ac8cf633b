"""One marker as dark modules and as a picture, of our libraries and of foreign families."""

from __future__ import annotations

import numpy as np

from olivevib.arrays import Bools, Grey
from olivevib.errors import UsageError
from olivevib.marker import MarkerLibrary


def marker_modules(library: MarkerLibrary, wanted: int) -> Bools:
    """All modules of one marker without quiet zone, True where dark; UsageError if unknown."""
    if wanted not in library.ids:
        first, last = int(library.ids.min()), int(library.ids.max())
        raise UsageError(
            f"The library {library.name} has no marker {wanted}",
            f"It has {len(library.ids)} markers, from {first} to {last}.",
            "Choose an id of the library.",
        )
    if library.family == "olive":
        return library.layout.pattern(library.code(wanted))
    import cv2

    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, library.dictionary))
    side = library.layout.modules
    image = cv2.aruco.generateImageMarker(dictionary, wanted, side, borderBits=1)
    dark: Bools = np.asarray(image) < 128
    return dark


def marker_text(library: MarkerLibrary, wanted: int) -> str:
    """One marker as two columns a module, dark modules as blocks."""
    rows = marker_modules(library, wanted)
    return "\n".join("  " + "".join("██" if dark else "  " for dark in row) for row in rows)


def marker_picture(library: MarkerLibrary, wanted: int, module_px: int = 20) -> Grey:
    """One marker with its quiet zone, ``module_px`` pixels a module, levels 0 and 255."""
    if not 1 <= module_px <= 400:
        raise UsageError(
            f"{module_px} pixels a module cannot be drawn",
            "1 to 400 are possible.",
            "Choose another --module-px.",
        )
    dark = np.pad(marker_modules(library, wanted), library.layout.quiet)
    levels = np.where(dark, 0, 255).astype(np.uint8)
    return np.kron(levels, np.ones((module_px, module_px), dtype=np.uint8))
