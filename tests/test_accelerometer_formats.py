"""Formats of loggers and programs: LVM, UFF58, WAV, MAT, NPZ, phyphox, GCDC, PicoQuake, Klipper."""

from __future__ import annotations

import io
import zipfile
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
import pyuff
from scipy.io import savemat, wavfile

from olivevib.errors import InputError
from olivevib.files.accelerometer import AccelerometerRecord, ImportOptions, read_accelerometer

G = 9.80665
N = 500


def motion(rest: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Times at 250 Hz and 3-axis values: rest, then shaking; gravity along z."""
    t_s = np.arange(N) / 250
    a = np.random.default_rng(2).normal(0, 0.002, (N, 3)) + [0.03, -0.05, 0.99]  # noqa: RUF005
    a[200:] += np.sin(2 * np.pi * 23 * t_s[200:, None] + np.arange(3))
    return t_s, a * rest


def read(path: Path, data: bytes | str, **options: object) -> AccelerometerRecord:
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    return read_accelerometer(path, ImportOptions(**options))  # type: ignore[arg-type]


def check(record: AccelerometerRecord, atol: float = 1e-3, scale: float = G) -> None:
    t_s, a = motion()
    assert record.samples.axes == ("x", "y", "z")
    np.testing.assert_allclose(record.samples.values, a * scale, atol=atol)
    assert record.rate_hz == pytest.approx(250, rel=1e-4)
    span = record.samples.t_s - record.samples.t_s[0]
    np.testing.assert_allclose(span, t_s, atol=1e-3)


def rows(columns: list[np.ndarray], separator: str, decimal: str = ".") -> str:
    lines = (separator.join(f"{v:.7f}" for v in row) for row in zip(*columns, strict=True))
    return "\n".join(lines).replace(".", decimal) + "\n"


def lvm(style: str, decimal: str, separator: str, segments: int = 1) -> str:
    t_s, a = motion()
    word = {"\t": "Tab", ",": "Comma"}[separator]
    head = ["LabVIEW Measurement", f"Separator{separator}{word}"]
    head += [f"Decimal_Separator{separator}{decimal}", f"X_Columns{separator}{style}"]
    text = "\n".join([*head, "***End_of_Header***", "", ""])
    size = N // segments
    for k in range(segments):
        part = slice(k * size, (k + 1) * size)
        second = f"{10 + k * size / 250:.6f}".replace(".", decimal)
        cells = [["Channels", "3"], ["Samples", *[str(size)] * 3]]
        cells += [["Date", *["2026/11/20"] * 3], ["Time", *[f"10:15:{second}"] * 3]]
        cells += [["Y_Unit_Label", "g", "g", "g"], ["X_Dimension", *["Time"] * 3]]
        cells += [["X0", *["0" + decimal + "0E+0"] * 3], ["Delta_X", *["4" + decimal + "0E-3"] * 3]]
        text += "\n".join(separator.join(row) for row in cells) + "\n***End_of_Header***\n"
        names = ["Acc x", "Acc y", "Acc z"]
        columns = [a[part, axis] for axis in range(3)]
        local = t_s[part] - t_s[part][0]
        if style == "Multi":
            names = [name for n in names for name in ("X_Value", n)]
            columns = [c for column in columns for c in (local, column)]
        else:
            names = ["X_Value", *names]
            columns = [local, *columns]
        body = rows(columns, separator, decimal)
        if style == "No":
            body = (
                "\n".join(separator + line.split(separator, 1)[1] for line in body.splitlines())
                + "\n"
            )
        text += separator.join([*names, "Comment"]) + "\n" + body + "\n"
    return text


@pytest.mark.parametrize("style", ["No", "One", "Multi"])
@pytest.mark.parametrize(("decimal", "separator"), [(".", "\t"), (",", "\t"), (".", ",")])
def test_lvm(tmp_path: Path, style: str, decimal: str, separator: str) -> None:
    record = read(tmp_path / "a.lvm", lvm(style, decimal, separator))
    check(record)
    assert record.format == "LVM"
    assert record.clock.start == datetime(2026, 11, 20, 10, 15, 10)


def test_lvm_segments_are_joined_on_their_own_times(tmp_path: Path) -> None:
    check(read(tmp_path / "a.lvm", lvm("No", ",", "\t", segments=4)))


def test_lvm_of_a_spectrum_is_refused(tmp_path: Path) -> None:
    text = lvm("No", ".", "\t").replace("X_Dimension\tTime\tTime\tTime", "X_Dimension\tFrequency")
    with pytest.raises(InputError, match="abscissa is frequency"):
        read(tmp_path / "a.lvm", text)


def uff_sets(even: bool, binary: bool, unit: str = "m/s2") -> list[dict[str, object]]:
    t_s, a = motion(G)
    x = t_s if even else t_s + 1e-5 * np.sin(t_s)
    return [
        {
            "type": 58,
            "binary": int(binary),
            "func_type": 1,
            "rsp_node": 7,
            "rsp_dir": axis + 1,
            "ref_node": 0,
            "ref_dir": 0,
            "data": a[:, axis].copy(),
            "x": x,
            "abscissa_spacing": int(even),
            "abscissa_spec_data_type": 17,
            "ordinate_spec_data_type": 12,
            "orddenom_spec_data_type": 0,
            "z_axis_spec_data_type": 0,
            "ordinate_axis_lab": "Acceleration",
            "ordinate_axis_units_lab": unit,
            "id3": "20-Nov-26 10:15:00",
            "n_bytes": 0,
        }
        for axis in range(3)
    ]


# pyuff leaves the file that it wrote open
leaves_open = pytest.mark.filterwarnings(
    "ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning"
)


@leaves_open
@pytest.mark.parametrize("even", [True, False])
@pytest.mark.parametrize("binary", [True, False])
def test_uff_as_pyuff_writes_it(tmp_path: Path, even: bool, binary: bool) -> None:
    path = tmp_path / "a.uff"
    pyuff.UFF(str(path)).write_sets(uff_sets(even, binary), mode="add")
    record = read_accelerometer(path)
    check(record)
    assert record.clock.start == datetime(2026, 11, 20, 10, 15)
    assert record.unit_basis == "column header"


def test_uff_without_a_unit_takes_that_of_its_unit_set(tmp_path: Path) -> None:
    path = tmp_path / "a.uff"
    units = {"type": 164, "units_code": 5, "units_description": "mm", "temp_mode": 1}
    units |= {"length": 1.0, "force": 1.0, "temp": 1.0, "temp_offset": 273.15}
    pyuff.UFF(str(path)).write_sets([units, *uff_sets(True, False, "NONE")], mode="add")
    record = read_accelerometer(path)
    assert record.source_unit == "mm/s2"


@leaves_open
def test_uff_uneven_binary_with_single_abscissa(tmp_path: Path) -> None:
    path = tmp_path / "a.uff"
    pyuff.UFF(str(path)).write_sets(uff_sets(False, True)[2:], mode="add")
    data = path.read_bytes()
    lines = data.split(b"\n", 13)
    pairs = np.frombuffer(lines[13][: 16 * N], dtype="<f8").reshape(-1, 2)
    packed = np.empty(N, dtype=[("x", "<f4"), ("y", "<f8")])
    packed["x"], packed["y"] = pairs.T
    rebuilt = b"\n".join(lines[:13]) + b"\n" + packed.tobytes() + b"    -1\n"
    record = read(path, rebuilt)
    np.testing.assert_allclose(record.samples.values[:, 0], motion(G)[1][:, 2], atol=1e-12)


def test_wav_needs_a_scale_unless_gravity_shows(tmp_path: Path) -> None:
    _, a = motion()
    path = tmp_path / "a.wav"
    wavfile.write(path, 250, (a / 8).astype(np.float32))
    with pytest.raises(InputError, match="per_g"):
        read_accelerometer(path)
    check(read_accelerometer(path, ImportOptions(per_g=0.125)), atol=1e-5)
    wavfile.write(path, 250, np.rint(a * 4096).astype(np.int16))
    assert read_accelerometer(path).unit_basis == "proposed from rest magnitude"


@pytest.mark.parametrize("kind", ["matrix", "columns", "struct", "rate", "four"])
def test_mat(tmp_path: Path, kind: str) -> None:
    t_s, a = motion()
    variables = {
        "matrix": {"t": t_s, "acc": a, "unit": "g"},
        "columns": {"time_s": t_s, "ax_g": a[:, 0], "ay_g": a[:, 1], "az_g": a[:, 2]},
        "struct": {"rec": {"t": t_s, "acc_g": a.T}},
        "rate": {"fs": 250.0, "acc_g": a},
        "four": {"data_g": np.column_stack([t_s, a])},
    }[kind]
    stream = io.BytesIO()
    savemat(stream, variables, do_compression=kind == "matrix")
    check(read(tmp_path / "a.mat", stream.getvalue()))


def test_npz_and_npy(tmp_path: Path) -> None:
    t_s, a = motion()
    stream = io.BytesIO()
    np.savez(stream, t_s=t_s, acceleration_m_s2=a * G)
    check(read(tmp_path / "a.npz", stream.getvalue()))
    stream = io.BytesIO()
    np.save(stream, np.column_stack([t_s, a]))
    with pytest.raises(InputError, match=r"(?s)no unit.*gravity in g"):
        read(tmp_path / "a.npy", stream.getvalue())
    check(read(tmp_path / "a.npy", stream.getvalue(), unit="g"))


PHYPHOX_TIME = (
    '"event","experiment time","system time","system time text"\n'
    '"START",0.000000000E0,1790000000.000,"2026-09-21 13:33:20.000 UTC"\n'
)


def phyphox(separator: str, decimal: str, word: str = "Acceleration") -> str:
    t_s, a = motion(G)
    names = ["Time (s)", *(f"{word} {axis} (m/s^2)" for axis in "xyz")]
    names.append("Absolute acceleration (m/s^2)")
    columns = [t_s, *a.T, np.linalg.norm(a, axis=1)]
    lines = [separator.join(f'"{n}"' for n in names)]
    for row in zip(*columns, strict=True):
        lines.append(separator.join(f"{v:.9E}".replace(".", decimal) for v in row))
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    ("separator", "decimal"), [(",", "."), (";", "."), ("\t", ","), (";", ",")]
)
def test_phyphox_folder_with_absolute_time(tmp_path: Path, separator: str, decimal: str) -> None:
    (tmp_path / "meta").mkdir()
    (tmp_path / "meta" / "time.csv").write_text(PHYPHOX_TIME)
    (tmp_path / "Accelerometer.csv").write_text(phyphox(separator, decimal))
    (tmp_path / "Gyroscope.csv").write_text(phyphox(separator, decimal, "Gyroscope"))
    (tmp_path / "Linear Acceleration.csv").write_text(
        phyphox(separator, decimal, "Linear Acceleration")
    )
    for record in (
        read_accelerometer(tmp_path),
        read_accelerometer(tmp_path / "Accelerometer.csv"),
    ):
        check(record)
        assert record.clock.start == datetime.fromtimestamp(1790000000, tz=UTC)
        assert "Absolute acceleration (m/s^2)" in dict(record.columns_refused)


def test_phyphox_archive_and_a_pause(tmp_path: Path) -> None:
    paused = (
        PHYPHOX_TIME
        + '"PAUSE",1.0E0,1790000001.000,"x"\n"START",1.0E0,1790000005.000,"x"\n'
        + '"PAUSE",2.0,1790000006,"x"\n'
    )
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("Raw Data.csv", phyphox(",", "."))
        archive.writestr("meta/time.csv", paused)
        archive.writestr("meta/device.csv", '"property","value"\n"version","1.2"\n')
    record = read(tmp_path / "a.zip", stream.getvalue())
    assert record.format == "phyphox"
    assert record.samples.duration_s == pytest.approx(499 / 250 + 4, abs=1e-3)
    assert len(record.clock.gaps) == 1
    assert record.clock.gaps[0].duration_s == pytest.approx(4.004, abs=1e-3)
    assert record.rate_hz == pytest.approx(250, rel=1e-3)


def test_archives_without_a_table_are_refused(tmp_path: Path) -> None:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("xl/workbook.xml", "<a/>")
    with pytest.raises(InputError, match="saved as CSV"):
        read(tmp_path / "a.xlsx", stream.getvalue())


def test_gcdc_counts(tmp_path: Path) -> None:
    t_s, a = motion(2048)
    head = (
        ";Title, http://www.gcdataconcepts.com, X16-1D, ADXL345\n"
        ";Version, 1113, Build date, Sep 22 2015,  SN:0\n"
        ";Start_time, 2018-02-09, 08:21:42.830\n;Temperature, -999.00, deg C,  Vbat, 1380, mv\n"
        ";SampleRate, 250,Hz\n;Deadband, 0, counts\n;DeadbandTimeout, 0,sec\n"
        ";Headers, time,Ax,Ay,Az\n"
    )
    body = "\n".join(
        f"{t:.3f},{x:.0f},{y:.0f},{z:.0f}" for t, (x, y, z) in zip(t_s, a, strict=True)
    )
    record = read(tmp_path / "DATA-001.CSV", head + body + "\n;shutdown: switched off\n")
    assert record.format == "GCDC"
    assert (record.source_unit, record.unit_basis) == ("counts", "proposed from rest magnitude")
    assert record.clock.start == datetime(2018, 2, 9, 8, 21, 42, 830000)
    assert record.rate_hz == pytest.approx(250, rel=1e-4)
    check(read(tmp_path / "b.csv", head + body, per_g=2048.0), atol=0.01)


def test_picoquake_has_its_rate_and_unit_from_its_header(tmp_path: Path) -> None:
    _, a = motion()
    head = (
        "# PLab PicoQuake Data\n# Time: 2024-04-21 15:54:46.333682, Device: A1B2 (00)\n"
        "# Num. samples: 500, Duration: 2.0 s\n"
        "# Config: data_rate = 250.0 Hz, filter = 488 Hz, acc_range = 4 g, gyro_range = 250.0 dps\n"
        "# Integrity: True, Skipped samples: 0\ncount,a_x,a_y,a_z,g_x,g_y,g_z\n"
    )
    columns = [np.arange(N), *a.T, *a.T]
    record = read(tmp_path / "a.csv", head + rows(columns, ","))
    check(record)
    assert (record.format, record.source_unit, record.unit_basis) == ("PicoQuake", "g", "metadata")
    assert record.clock.start == datetime(2024, 4, 21, 15, 54, 46, 333682)
    assert dict(record.columns_refused)["g_x"] == "gyroscope, no acceleration"


def test_klipper_is_in_mm_s2_where_gravity_agrees(tmp_path: Path) -> None:
    t_s, a = motion(G * 1000)
    head = "#time,accel_x,accel_y,accel_z\n"
    record = read(tmp_path / "a.csv", head + rows([t_s + 3000, *a.T], ","))
    check(record)
    assert (record.format, record.source_unit, record.unit_basis) == (
        "Klipper",
        "mm/s2",
        "metadata",
    )
    with pytest.raises(InputError, match='unit = "g"'):
        read(tmp_path / "b.csv", head + rows([t_s, *motion()[1].T], ","))


def test_physics_toolbox_repeats_its_stamps(tmp_path: Path) -> None:
    t_s, a = motion()
    stamps = np.floor(t_s * 100) / 100
    text = "time,gFx,gFy,gFz,TgF\n"
    record = read(tmp_path / "a.csv", text + rows([stamps, *a.T, np.linalg.norm(a, axis=1)], ","))
    assert (record.source_unit, record.unit_basis) == ("g", "column header")
    assert record.rate_hz == pytest.approx(250, rel=1e-3)
    assert record.clock.duplicates > 250
    assert record.samples.values.shape == (N, 3)


def test_thousands_marks_are_not_decimals(tmp_path: Path) -> None:
    t_s, a = motion(16384)
    lines = ["Zeit [ms];X [mm/s²];Y [mm/s²];Z [mm/s²]"]
    for t, row in zip(t_s, a, strict=True):
        cells = [f"{round(1000 * t):,}", *(f"{round(v):,}" for v in row)]
        lines.append(";".join(c.replace(",", ".") for c in cells))
    record = read(tmp_path / "a.csv", "\n".join(lines))
    np.testing.assert_allclose(record.samples.values, a / 1000, atol=1e-3)
    assert record.rate_hz == pytest.approx(250, rel=1e-3)


def test_quoted_decimal_commas_between_commas(tmp_path: Path) -> None:
    t_s, a = motion()
    lines = ['"Time (s)","X (g)","Y (g)","Z (g)"']
    for row in np.column_stack([t_s, a]):
        lines.append(",".join('"' + f"{v:.6f}".replace(".", ",") + '"' for v in row))
    check(read(tmp_path / "a.csv", "\n".join(lines)))


def test_unquoted_commas_for_both_are_refused(tmp_path: Path) -> None:
    t_s, a = motion()
    text = "Time (s),X (g),Y (g),Z (g)\n" + rows([t_s, *a.T], ",").replace(".", ",")
    with pytest.raises(InputError, match="comma both between columns and within numbers"):
        read(tmp_path / "a.csv", text)


def test_damaged_rows_are_counted_and_the_rest_is_read(tmp_path: Path) -> None:
    t_s, a = motion()
    lines = rows([t_s, *a.T], ",").splitlines()
    lines[100] = "sensor error"
    lines[200] = lines[200].replace(lines[200].split(",")[1], "ERR")
    lines[300] += ",0.5,0.7"
    lines[-1] = lines[-1][: len(lines[-1]) // 2]
    record = read(tmp_path / "a.csv", "Time (s),X (g),Y (g),Z (g)\n" + "\n".join(lines))
    codes = {c.code for c in record.cautions}
    assert {"sensor-bad-cells", "sensor-rows-skipped"} <= codes
    assert record.samples.t_s.size == N - 3
    assert np.isnan(record.samples.values).sum() == 1
    assert record.rate_hz == pytest.approx(250, rel=1e-3)
