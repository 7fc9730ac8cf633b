"""Exports for CAD, modal and motion programs, read back by other projects' readers."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pandas as pd
import pytest
import pyuff
from exports_scene import exported, make_rig, make_trajectory
from scipy.io import loadmat

from olivevib.errors import UsageError
from olivevib.files.exports import FORMATS, ExportFacts, export
from olivevib.reconstruction.trajectory import Trajectory

FACTS = ExportFacts("2026-11-20_T04 Täler 'a'", make_rig())
ALWAYS = tuple(to for to in FORMATS if to not in ("c3d", "parquet"))


def runs(trajectory: Trajectory, column: int) -> list[np.ndarray]:
    """The gapless stretches of a marker, found another way than the exports do."""
    xyz = trajectory.xyz_mm[:, column]
    parts = np.ma.clump_unmasked(np.ma.masked_invalid(xyz[:, 0]))
    return [xyz[part] for part in parts]


def with_a_lone_sample(trajectory: Trajectory) -> Trajectory:
    """Marker 7 seen once within a long gap."""
    xyz = trajectory.xyz_mm.copy()
    xyz[30:33, 0] = np.nan
    xyz[34:37, 0] = np.nan
    return Trajectory(**{**trajectory.__dict__, "xyz_mm": xyz})


@pytest.fixture
def trajectory() -> Trajectory:
    return with_a_lone_sample(make_trajectory())


def test_dxf_has_a_layer_a_marker_and_keeps_gaps(tmp_path: Path, trajectory: Trajectory) -> None:
    path = tmp_path / "a.dxf"
    export(trajectory, "dxf", path, FACTS)
    document = ezdxf.readfile(path)  # type: ignore[attr-defined]
    assert not document.audit().errors
    assert document.header["$INSUNITS"] == 4
    space = document.modelspace()
    for column, marker in enumerate(trajectory.ids):
        layer = f"MARKER_{marker}"
        lines = [
            np.array([v.dxf.location for v in e.vertices])
            for e in space.query(f'POLYLINE[layer=="{layer}"]')
        ]
        points = [np.array([e.dxf.location]) for e in space.query(f'POINT[layer=="{layer}"]')]
        expected = runs(trajectory, column)
        assert len(lines) == sum(len(r) > 1 for r in expected)
        assert len(points) == sum(len(r) == 1 for r in expected)
        for line, truth in zip(lines, [r for r in expected if len(r) > 1], strict=True):
            np.testing.assert_allclose(line, truth, rtol=0, atol=1e-9)
    assert len(space.query("POINT")) == 1


@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_uff_is_read_by_pyuff_with_exact_times_and_positions(
    tmp_path: Path, trajectory: Trajectory
) -> None:
    path = tmp_path / "a.uff"
    export(trajectory, "uff", path, FACTS)
    file = pyuff.UFF(str(path))
    assert file.get_set_types().tolist() == [151, 164, 2411, *[58] * 9]
    sets = file.read_sets()
    assert sets[0]["model_name"].strip().startswith("2026-11-20_T04")
    assert (sets[1]["units_code"], sets[1]["length"], sets[1]["force"]) == (1, 1.0, 1.0)
    nodes = {
        int(n): np.array(xyz)
        for n, *xyz in zip(*(sets[2][k] for k in ("node_nums", "x", "y", "z")), strict=True)
    }
    for found in sets[3:]:
        node, axis = int(found["rsp_node"]), int(found["rsp_dir"]) - 1
        column = trajectory.ids.tolist().index(node)
        seen = np.isfinite(trajectory.xyz_mm[:, column, axis])
        t_s = trajectory.sample_t_s[seen, column]
        np.testing.assert_array_equal(found["x"], t_s)
        mm = 1000 * (found["data"] + nodes[node][axis])
        np.testing.assert_allclose(mm, trajectory.xyz_mm[seen, column, axis], rtol=0, atol=1e-9)
        assert (found["func_type"], found["ordinate_spec_data_type"]) == (1, 8)
        assert found["ordinate_axis_units_lab"].strip() == "m"
    head = path.read_bytes().split(b"    58b")[0]
    assert max(len(line) for line in head.split(b"\n")) <= 80


def test_mat_has_a_struct_a_marker(tmp_path: Path, trajectory: Trajectory) -> None:
    path = tmp_path / "a.mat"
    export(trajectory, "mat", path, FACTS)
    data = loadmat(path, squeeze_me=True)
    for column, marker in enumerate(trajectory.ids):
        struct = data[f"marker_{marker}"]
        np.testing.assert_array_equal(struct["xyz_mm"].item(), trajectory.xyz_mm[:, column])
        np.testing.assert_array_equal(struct["state"].item(), trajectory.state[:, column])
    info = data["info"]
    assert info["frame"].item() == "left camera"
    assert info["state_words"].item()[2] == "hidden"
    assert data["rig"]["P_right"].item()[0, 3] == pytest.approx(-420 * 900)


def ply_tables(data: bytes) -> tuple[list[str], np.ndarray, np.ndarray]:
    head, _, body = data.decode("ascii").partition("end_header\n")
    count = {w[1]: int(w[2]) for w in (x.split() for x in head.splitlines()) if w[0] == "element"}
    lines = body.splitlines()
    assert len(lines) == count["vertex"] + count["edge"]
    vertices = np.loadtxt(lines[: count["vertex"]], ndmin=2)
    edges = np.loadtxt(lines[count["vertex"] :], dtype=int, ndmin=2)
    return head.splitlines(), vertices, edges


def test_ply_points_and_edges(trajectory: Trajectory) -> None:
    head, vertices, edges = ply_tables(exported(trajectory, "ply", facts=FACTS))
    assert head[0] == "ply"
    order = np.argsort(trajectory.ids)
    expected = np.concatenate([r for k in order for r in runs(trajectory, int(k))])
    np.testing.assert_allclose(vertices[:, :3], expected, rtol=0, atol=1e-6)
    assert (np.diff(edges, axis=1) == 1).all()
    assert len(edges) == sum(len(r) - 1 for k in range(3) for r in runs(trajectory, k))
    assert (vertices[edges[:, 0], 4] == vertices[edges[:, 1], 4]).all()


def test_ply_is_read_by_trimesh(tmp_path: Path, trajectory: Trajectory) -> None:
    trimesh = pytest.importorskip("trimesh")
    cloud = trimesh.load(io.BytesIO(exported(trajectory, "ply")), file_type="ply")
    order = np.argsort(trajectory.ids)
    expected = np.concatenate([r for k in order for r in runs(trajectory, int(k))])
    np.testing.assert_allclose(np.asarray(cloud.vertices), expected, rtol=0, atol=1e-6)


def test_trc_rows_and_blanks(trajectory: Trajectory) -> None:
    text = exported(trajectory, "trc").decode("ascii")
    lines = text.splitlines()
    values = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=True))
    assert (values["NumFrames"], values["NumMarkers"], values["Units"]) == ("50", "3", "mm")
    assert float(values["DataRate"]) == pytest.approx(30000 / 1001, abs=1e-5)
    assert lines[3].split("\t")[2::3] == ["M2", "M7", "M31"]
    frame = pd.read_csv(io.StringIO(text), sep="\t", skiprows=5, header=None)
    np.testing.assert_allclose(frame[1], trajectory.t_s, rtol=0, atol=1e-9)
    seven = frame[[5, 6, 7]].to_numpy()
    np.testing.assert_allclose(seven, trajectory.xyz_mm[:, 0], rtol=0, atol=6e-7)


def occ_points(shape: Any) -> list[np.ndarray]:
    """The corner points of each edge or free vertex of an Open CASCADE shape, in order."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.GeomAbs import GeomAbs_BSplineCurve
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_VERTEX
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    as_edge = getattr(TopoDS, "Edge_s", None) or TopoDS.Edge  # name depends on the binding
    as_vertex = getattr(TopoDS, "Vertex_s", None) or TopoDS.Vertex
    out = []
    explorer = TopExp_Explorer(shape, TopAbs_EDGE)
    while explorer.More():
        curve = BRepAdaptor_Curve(as_edge(explorer.Current()))
        if curve.GetType() == GeomAbs_BSplineCurve:  # a whole polyline, degree 1
            spline = curve.BSpline()
            assert spline.Degree() == 1
            ends = [spline.Pole(k) for k in range(1, spline.NbPoles() + 1)]
        else:
            ends = [curve.Value(curve.FirstParameter()), curve.Value(curve.LastParameter())]
        out.append(np.array([[p.X(), p.Y(), p.Z()] for p in ends]))
        explorer.Next()
    explorer = TopExp_Explorer(shape, TopAbs_VERTEX, TopAbs_EDGE)
    while explorer.More():
        p = BRep_Tool.Pnt_s(as_vertex(explorer.Current()))
        out.append(np.array([[p.X(), p.Y(), p.Z()]]))
        explorer.Next()
    return out


@pytest.mark.parametrize("to", ["step", "iges"])
def test_step_and_iges_are_read_by_open_cascade(
    tmp_path: Path, trajectory: Trajectory, to: str
) -> None:
    pytest.importorskip("OCP")
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.IGESControl import IGESControl_Reader
    from OCP.STEPControl import STEPControl_Reader

    path = tmp_path / f"a.{to}"
    export(trajectory, to, path, FACTS)
    reader = STEPControl_Reader() if to == "step" else IGESControl_Reader()
    assert reader.ReadFile(str(path)) == IFSelect_RetDone
    assert reader.TransferRoots() > 0
    shape = reader.OneShape()
    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    low, high = box.CornerMin(), box.CornerMax()
    found = np.array([[c.X(), c.Y(), c.Z()] for c in (low, high)])
    xyz = trajectory.xyz_mm.reshape(-1, 3)
    truth = np.array([np.nanmin(xyz, axis=0), np.nanmax(xyz, axis=0)])
    np.testing.assert_allclose(found, truth, rtol=0, atol=1e-5)
    pieces = occ_points(shape)
    expected = [r for k in range(3) for r in runs(trajectory, k)]
    assert sum(len(p) == 1 for p in pieces) == sum(len(r) == 1 for r in expected)
    corners = np.unique(np.round(np.concatenate(pieces), 4), axis=0)
    wanted = np.unique(np.round(np.concatenate(expected), 4), axis=0)
    assert len(corners) == len(wanted)
    np.testing.assert_allclose(corners, wanted, rtol=0, atol=2e-4)


def test_step_and_iges_have_their_frame(trajectory: Trajectory) -> None:
    step = exported(trajectory, "step", facts=FACTS).decode("ascii")
    assert step.startswith("ISO-10303-21;")
    assert step.count("=POLYLINE(") == 5
    assert step.count("=GEOMETRIC_CURVE_SET(") == 3
    numbers = [int(line[1 : line.index("=")]) for line in step.splitlines() if line[:1] == "#"]
    assert len(numbers) == len(set(numbers))
    iges = exported(trajectory, "iges", facts=FACTS).decode("ascii").splitlines()
    assert {len(line) for line in iges} == {80}
    tally = {letter: sum(line[72] == letter for line in iges) for letter in "SGDPT"}
    last = iges[-1]
    assert {last[8 * k]: int(last[8 * k + 1 : 8 * k + 8]) for k in range(4)} == {
        k: v for k, v in tally.items() if k != "T"
    }


@pytest.mark.filterwarnings("ignore:No analog data found")
def test_c3d_needs_its_library_and_is_then_right(tmp_path: Path, trajectory: Trajectory) -> None:
    try:
        import ezc3d
    except ImportError:
        with pytest.raises(UsageError, match="ezc3d"):
            exported(trajectory, "c3d")
        return
    path = tmp_path / "a.c3d"
    export(trajectory, "c3d", path, FACTS)
    read = ezc3d.c3d(str(path))
    labels = read["parameters"]["POINT"]["LABELS"]["value"]
    assert list(labels) == ["M2", "M7", "M31"]
    points = read["data"]["points"][:3]
    for column, marker in enumerate(trajectory.ids):
        mine = points[:, labels.index(f"M{marker}")].T
        np.testing.assert_allclose(mine, trajectory.xyz_mm[:, column], rtol=0, atol=1e-3)
    assert read["parameters"]["POINT"]["UNITS"]["value"] == ["mm"]
    c3d = pytest.importorskip("c3d")
    with path.open("rb") as handle:
        frames = [p for _, p, _ in c3d.Reader(handle).read_frames()]
    np.testing.assert_allclose(frames[0][1, :3], trajectory.xyz_mm[0, 0], rtol=0, atol=1e-3)
    assert frames[11][1, 3] == -1


@pytest.mark.parametrize("to", ALWAYS)
def test_a_trajectory_that_saw_nothing_is_written(to: str) -> None:
    blank = make_trajectory()
    empty = Trajectory(**{**blank.__dict__, "xyz_mm": np.full((50, 3, 3), np.nan)})
    assert exported(empty, to)
    data = exported(empty, to)
    if to == "dxf":
        document = ezdxf.read(io.StringIO(data.decode()))  # type: ignore[attr-defined]
        assert not list(document.modelspace())
