"""Hostile and damaged files: a record or an error for people, never a traceback."""

from __future__ import annotations

import io
import wave
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from olivevib.errors import InputError, UsageError
from olivevib.files.accelerometer import AccelerometerRecord, read_accelerometer

FEW = settings(
    max_examples=150,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


def survives(path: Path, data: bytes) -> AccelerometerRecord | None:
    """The record, or None after an error for people; anything else fails the test."""
    path.write_bytes(data)
    try:
        return read_accelerometer(path)
    except (InputError, UsageError) as error:
        assert error.what
        assert str(path.name) in str(error)
        return None


def csv_bytes(rows: int = 60) -> bytes:
    t = np.arange(rows) / 200
    lines = [f"{s:.4f};{np.sin(9 * s):.5f};0,1;{9.8 + s:.4f}".replace(".", ",") for s in t]
    return ("Time [s];X [m/s²];Y [m/s²];Z [m/s²]\r\n" + "\r\n".join(lines)).encode("cp1252")


def lvm_bytes() -> bytes:
    head = (
        "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t.\nX_Columns\tOne\n"
        "***End_of_Header***\t\n\t\nChannels\t2\t\nSamples\t40\t40\t\nDate\t2026/11/20\t\n"
        "Time\t10:00:00.5\t\nY_Unit_Label\tg\tg\t\nX_Dimension\tTime\tTime\t\n"
        "X0\t0.0E+0\t0.0E+0\t\nDelta_X\t1.0E-3\t1.0E-3\t\n***End_of_Header***\t\t\t\n"
        "X_Value\tAcc x\tAcc y\tComment\n"
    )
    return (head + "".join(f"{k / 1000:.3f}\t{k % 7}\t1.0\n" for k in range(40))).encode()


def uff_bytes(binary: bool) -> bytes:
    values = np.sin(np.arange(64) / 5)
    first = "    58"
    if binary:
        first += f"b{1:6d}{2:6d}{11:12d}{values.nbytes:12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    head = [
        "    -1",
        first,
        *["NONE"] * 5,
        f"{1:5d}{0:10d}{0:5d}{0:10d} {'NONE':10s}{7:10d}{1:4d} {'NONE':10s}{0:10d}{0:4d}",
        f"{4:10d}{64:10d}{1:10d}{0.0:13.5e}{0.001:13.5e}{0.0:13.5e}",
        f"{17:10d}{0:5d}{0:5d}{0:5d} {'Time':20s} {'s':20s}",
        f"{12:10d}{0:5d}{0:5d}{0:5d} {'Acceleration':20s} {'m/s2':20s}",
        *[f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {'NONE':20s}"] * 2,
    ]
    text = "\n".join(head) + "\n"
    if binary:
        return text.encode() + values.astype("<f8").tobytes() + b"    -1\n"
    rows = ["".join(f"{v:20.11e}" for v in values[k : k + 4]) for k in range(0, 64, 4)]
    return (text + "\n".join(rows) + "\n    -1\n").encode()


def wav_bytes() -> bytes:
    stream = io.BytesIO()
    with wave.open(stream, "wb") as out:
        out.setnchannels(3)
        out.setsampwidth(2)
        out.setframerate(1000)
        rest = np.tile(np.array([100, -200, 16300], dtype="<i2"), (600, 1))
        out.writeframes(rest.tobytes())
    return stream.getvalue()


def mat_bytes() -> bytes:
    stream = io.BytesIO()
    t = np.arange(300) / 500.0
    savemat(stream, {"t": t, "acc": np.ones((300, 3)) * [0.0, 0.0, 9.8], "unit": "m/s2"})
    return stream.getvalue()


def npz_bytes() -> bytes:
    stream = io.BytesIO()
    t_s = np.arange(300) / 500.0
    np.savez_compressed(stream, t_s=t_s, acc_g=np.tile([0.0, 0.0, 1.0], (300, 1)))
    return stream.getvalue()


WHOLE = {
    "csv": csv_bytes(),
    "lvm": lvm_bytes(),
    "uff": uff_bytes(binary=False),
    "uff58b": uff_bytes(binary=True),
    "wav": wav_bytes(),
    "mat": mat_bytes(),
    "npz": npz_bytes(),
}


@pytest.mark.parametrize("kind", list(WHOLE))
def test_the_whole_files_are_read(tmp_path: Path, kind: str) -> None:
    record = survives(tmp_path / f"a.{kind}", WHOLE[kind])
    assert record is not None
    assert record.samples.values.shape[0] >= 40


@FEW
@given(data=st.binary(max_size=3000))
def test_any_bytes(tmp_path: Path, data: bytes) -> None:
    survives(tmp_path / "a.csv", data)


@FEW
@given(text=st.text(alphabet="0123456789.,;\t\n -+eE:/xyzgtms#%\"'()[]°²ü", max_size=400))
def test_any_text_of_the_alphabet_of_loggers(tmp_path: Path, text: str) -> None:
    survives(tmp_path / "a.csv", text.encode("utf-8"))


@FEW
@given(kind=st.sampled_from(list(WHOLE)), share=st.floats(0, 1))
def test_files_cut_anywhere(tmp_path: Path, kind: str, share: float) -> None:
    data = WHOLE[kind]
    survives(tmp_path / f"a.{kind}", data[: round(share * len(data))])


@FEW
@given(
    kind=st.sampled_from(list(WHOLE)),
    at=st.lists(st.tuples(st.floats(0, 0.999), st.integers(0, 255)), min_size=1, max_size=12),
)
def test_files_with_damaged_bytes(tmp_path: Path, kind: str, at: list[tuple[float, int]]) -> None:
    data = bytearray(WHOLE[kind])
    for share, byte in at:
        data[int(share * len(data))] = byte
    survives(tmp_path / f"a.{kind}", bytes(data))


@FEW
@given(
    lines=st.lists(
        st.lists(
            st.one_of(st.floats(width=32), st.integers(-40000, 40000)), min_size=1, max_size=6
        ),
        max_size=30,
    ),
    header=st.sampled_from(["", "t,x,y,z\n", "time_ms,ax_g,ay_g,az_g\n", "Time (s),X (m/s2)\n"]),
)
def test_any_numbers(tmp_path: Path, lines: list[list[float]], header: str) -> None:
    body = "\n".join(",".join(repr(v) for v in line) for line in lines)
    survives(tmp_path / "a.csv", (header + body).encode())


def test_missing_empty_and_folder(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is not there"):
        read_accelerometer(tmp_path / "none.csv")
    assert survives(tmp_path / "empty.csv", b"") is None
    (tmp_path / "folder").mkdir()
    with pytest.raises(InputError, match="no CSV file"):
        read_accelerometer(tmp_path / "folder")


def test_pickles_and_bombs_are_refused(tmp_path: Path) -> None:
    stream = io.BytesIO()
    np.savez(stream, t=np.arange(5), acc=np.array([{"a": 1}] * 5, dtype=object))
    assert survives(tmp_path / "pickle.npz", stream.getvalue()) is None
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("x.npy", bytes(30_000_000))
    with pytest.raises(InputError, match=r"(?s)too large.*packed"):
        (tmp_path / "bomb.npz").write_bytes(stream.getvalue())
        read_accelerometer(tmp_path / "bomb.npz")


@pytest.mark.filterwarnings("ignore::ResourceWarning")  # idelib leaves a damaged file open
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize(
    ("head", "word"),
    [
        (b"\x89HDF\r\n\x1a\n", "-v7"),
        (b"TDSm", "TDMS"),
        (b"\x1f\x8b\x08", "gzip"),
        (b"\x1a\x45\xdf\xa3" + b"\x00" * 20 + b"mide", "IDE"),
    ],
)
def test_known_formats_that_are_not_read_are_named(tmp_path: Path, head: bytes, word: str) -> None:
    (tmp_path / "a.bin").write_bytes(head + b"\0" * 50)
    with pytest.raises(InputError, match=word):
        read_accelerometer(tmp_path / "a.bin")
