"""DXF: 3-D polylines in mm, one layer a marker, for AutoCAD, LibreCAD, Rhino and FreeCAD."""

from __future__ import annotations

import importlib
import io
from typing import Any, BinaryIO

from olivevib.files.exports.facts import ExportFacts, marker_paths
from olivevib.reconstruction.trajectory import Trajectory

_MM = 4  # $INSUNITS


def write_dxf(trajectory: Trajectory, facts: ExportFacts, out: BinaryIO) -> None:
    """Write one POLYLINE a gapless stretch (a POINT for a lone sample) on layer MARKER_id.

    DXF R2010 (it carries units), mm, 16 digits. The dates that ezdxf would write are held fixed.
    """
    del facts
    ezdxf: Any = importlib.import_module("ezdxf")  # slow to load; it types no public names
    before = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        document = ezdxf.new("R2010", units=_MM)
        space = document.modelspace()
        for path in marker_paths(trajectory):
            layer = f"MARKER_{path.id}"
            document.layers.add(layer, color=1 + path.id % 255)
            for first, beyond in path.runs():
                _stretch(space, path.xyz_mm[first:beyond].tolist(), layer)
        text = io.StringIO()
        document.write(text)
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before
    out.write(text.getvalue().encode(document.output_encoding, errors="dxfreplace"))


def _stretch(space: Any, points_mm: list[list[float]], layer: str) -> None:
    if len(points_mm) == 1:
        space.add_point(points_mm[0], dxfattribs={"layer": layer})
    else:
        space.add_polyline3d(points_mm, dxfattribs={"layer": layer})
