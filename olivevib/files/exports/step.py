"""STEP AP214: the paths as wireframe polylines in mm, one named curve set and layer a marker."""

from __future__ import annotations

from typing import BinaryIO

from olivevib.files.exports.facts import ExportFacts, MarkerPath, marker_paths
from olivevib.files.exports.text import ascii_line
from olivevib.reconstruction.trajectory import Trajectory

_SCHEMA = "AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }"
_CONTEXT = """\
#1=APPLICATION_CONTEXT('core data for automotive mechanical design processes');
#2=APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,#1);
#3=PRODUCT_CONTEXT('',#1,'mechanical');
#4=PRODUCT('{name}','{name}','',(#3));
#5=PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,(#4));
#6=PRODUCT_DEFINITION_FORMATION('','',#4);
#7=PRODUCT_DEFINITION_CONTEXT('part definition',#1,'design');
#8=PRODUCT_DEFINITION('design','',#6,#7);
#9=PRODUCT_DEFINITION_SHAPE('','',#8);
#10=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
#11=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));
#12=(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT());
#13=UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-6),#10,'distance_accuracy_value','');
#14=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#13))\
GLOBAL_UNIT_ASSIGNED_CONTEXT((#10,#11,#12))REPRESENTATION_CONTEXT('','3D'));
#15=CARTESIAN_POINT('',(0.,0.,0.));
#16=DIRECTION('',(0.,0.,1.));
#17=DIRECTION('',(1.,0.,0.));
#18=AXIS2_PLACEMENT3D('',#15,#16,#17);
"""
_FIRST_FREE = 21  # 19: shape representation, 20: its definition


def write_step(trajectory: Trajectory, facts: ExportFacts, out: BinaryIO) -> None:
    """Write POLYLINEs in GEOMETRIC_CURVE_SETs (a lone sample is a CARTESIAN_POINT), in mm.

    Gaps end a polyline. ISO 10303-21 text; the time stamp that its header wants is held fixed.
    """
    name = ascii_line(facts.trial or "olivevib", 200).replace("'", "''").replace("\\", "/")
    frame = ascii_line(trajectory.frame, 200).replace("'", "''")
    head = (
        "ISO-10303-21;\nHEADER;\n"
        f"FILE_DESCRIPTION(('olivevib marker paths, frame {frame}'),'2;1');\n"
        f"FILE_NAME('{name}','1970-01-01T00:00:00',(''),(''),'olivevib','olivevib','');\n"
        f"FILE_SCHEMA(('{_SCHEMA}'));\nENDSEC;\nDATA;\n"
    )
    out.write((head + _CONTEXT.replace("{name}", name)).encode("ascii"))
    sets: list[int] = []
    layers: list[str] = []
    at = _FIRST_FREE
    for path in marker_paths(trajectory):
        text, elements, at = _elements(path, at)
        if not elements:
            continue
        listed = ",".join(f"#{k}" for k in elements)
        text.append(f"#{at}=GEOMETRIC_CURVE_SET('marker {path.id}',({listed}));")
        layers.append(f"PRESENTATION_LAYER_ASSIGNMENT('MARKER_{path.id}','',({listed}))")
        sets.append(at)
        at += 1
        out.write(("\n".join(text) + "\n").encode("ascii"))
    items = ",".join(f"#{k}" for k in [18, *sets])
    kind = (
        "GEOMETRICALLY_BOUNDED_WIREFRAME_SHAPE_REPRESENTATION" if sets else "SHAPE_REPRESENTATION"
    )
    tail = [f"#19={kind}('{name}',({items}),#14);", "#20=SHAPE_DEFINITION_REPRESENTATION(#9,#19);"]
    tail += [f"#{at + k}={layer};" for k, layer in enumerate(layers)]
    out.write(("\n".join(tail) + "\nENDSEC;\nEND-ISO-10303-21;\n").encode("ascii"))


def _elements(path: MarkerPath, at: int) -> tuple[list[str], list[int], int]:
    """Lines of one marker's points and polylines, the numbers of its elements, the next number."""
    text: list[str] = []
    elements: list[int] = []
    for number, (first, beyond) in enumerate(path.runs(), start=1):
        points = path.xyz_mm[first:beyond].tolist()
        for k, (x, y, z) in enumerate(points):
            text.append(f"#{at + k}=CARTESIAN_POINT('',({x:.7f},{y:.7f},{z:.7f}));")
        if len(points) == 1:
            elements.append(at)
            at += 1
            continue
        listed = ",".join(f"#{at + k}" for k in range(len(points)))
        at += len(points)
        text.append(f"#{at}=POLYLINE('marker {path.id} stretch {number}',({listed}));")
        elements.append(at)
        at += 1
    return text, elements, at
