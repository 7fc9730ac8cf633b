"""Headers and cells as people and loggers write them, each with the same known motion."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from olivevib.errors import InputError
from olivevib.files.accelerometer import read_accelerometer

G = 9.80665
N = 400
T = np.arange(N) / 500
A = np.random.default_rng(0).normal(0, 0.02, (N, 3)) + np.array([0.3, -0.4, 9.78])
A[200:] += 20 * np.sin(150 * T[200:, None] + np.arange(3))
MS2, IN_G = list(A.T), list(A.T / G)
MG = [1000 * c for c in IN_G]
MS = [str(round(1000 * t)) for t in T]
DAY = [f"2026-11-20 12:00:{t:06.3f}" for t in T]
CLOCK = [f"12:00:{t:06.3f}" for t in T]

Columns = Sequence[Sequence[str] | np.ndarray]


def cell(value: str | float, decimals: int, decimal: str) -> str:
    return value if isinstance(value, str) else f"{value:.{decimals}f}".replace(".", decimal)


def body(columns: Columns, separator: str = ",", decimal: str = ".", decimals: int = 6) -> str:
    rows = (
        separator.join(cell(value, decimals, decimal) for value in row)
        for row in zip(*columns, strict=True)
    )
    return "\n".join(rows) + "\n"


def quoted(text: str, separator: str) -> str:
    lines = (separator.join(f'"{c}"' for c in x.split(separator)) for x in text.splitlines())
    return "\n".join(lines) + "\n"


FILES = {
    "units in brackets below": "Time;X;Y;Z\n(s);(g);(g);(g)\n" + body([T, *IN_G], ";", ","),
    "units below": "Time,Ax,Ay,Az\ns,g,g,g\n" + body([T, *IN_G]),
    "all quoted": quoted("Time (s);X (m/s²);Y (m/s²);Z (m/s²)\n" + body([T, *MS2], ";", ","), ";"),
    "unit in the block": "Unit: m/s^2\nt;ax;ay;az\n" + body([T, *MS2], ";"),
    "unit in a comment": "# unit=g\n# t,ax,ay,az\n" + body([T, *IN_G]),
    "unit of acceleration": "Acceleration unit,g\nTime (s),ax,ay,az\n" + body([T, *IN_G]),
    "channels and a unit": "Unit,g\nTime (s),CH1,CH2,CH3\n" + body([T, *IN_G]),
    "German block": "Einheit;mg\nZeit [s];X;Y;Z\n" + body([T, *MG], ";", ","),
    "Italian dates": "Data;X [g];Y [g];Z [g]\n" + body([DAY, *IN_G], ";", ","),
    "date and clock": "Date,Time,X (g),Y (g),Z (g)\n" + body([["2026-11-20"] * N, CLOCK, *IN_G]),
    "rate in a cell": "Sampling frequency [Hz];500\nX [g];Y [g];Z [g]\n" + body(IN_G, ";", ","),
    "rate as fs": "# fs=500\nax_g,ay_g,az_g\n" + body(IN_G),
    "rate in kHz": "Rate: 0.5 kHz\nax_g,ay_g,az_g\n" + body(IN_G),
    "step in ms": "dt = 2 ms\nax_g,ay_g,az_g\n" + body(IN_G),
    "step in s": "Sample interval (s): 0.002\nax_g,ay_g,az_g\n" + body(IN_G),
    "whole mg": "time(ms),X(mg),Y(mg),Z(mg)\n" + body([MS, *MG], decimals=0),
    "blanks around": "Time (s) , X (g) , Y (g) , Z (g)\n" + body([T, *IN_G], " , "),
    "separator at the end": "Time (s);X (g);Y (g);Z (g)\n" + body([T, *IN_G, [""] * N], ";", ","),
    "index first": "Sample,Time (s),X (g),Y (g),Z (g)\n"
    + body([[str(k) for k in range(N)], T, *IN_G]),
    "time last": "X (g),Y (g),Z (g),Time (s)\n" + body([*IN_G, T]),
    "carriage returns": ("Time (s),X (g),Y (g),Z (g)\n" + body([T, *IN_G])).replace("\n", "\r"),
    "true minus": "Time (s);X (g);Y (g);Z (g)\n" + body([T, *IN_G], ";", ",").replace("-", "−"),
    "a word a row": "Time (s),X (g),Y (g),Z (g),Status\n" + body([T, *IN_G, ["OK"] * N]),
    "names over units": "Time,Accelerometer,Accelerometer,Accelerometer\ns,X (g),Y (g),Z (g)\n"
    + body([T, *IN_G]),
    "after a slash": "Time/s,X/g,Y/g,Z/g\n" + body([T, *IN_G]),
    "in words": "time in s,accel x in g,accel y in g,accel z in g\n" + body([T, *IN_G]),
    "possessive": "Time (s),A X [g's],A Y [g's],A Z [g's]\n" + body([T, *IN_G]),
    "Gal": "Time (s),X (Gal),Y (Gal),Z (Gal)\n" + body([T, *[100 * c for c in MS2]]),
    "blanks in columns": "Time_s   ax_g   ay_g   az_g\n" + body([T, *IN_G], "   "),
    "a comment within": "Time (s),X (g),Y (g),Z (g)\n"
    + body([T[:90], *[c[:90] for c in IN_G]])
    + "# battery low\n"
    + body([T[90:], *[c[90:] for c in IN_G]]),
}


@pytest.mark.parametrize("name", list(FILES))
def test_written_so(tmp_path: Path, name: str) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(FILES[name].encode())
    record = read_accelerometer(path)
    assert record.samples.axes == ("x", "y", "z")
    np.testing.assert_allclose(record.samples.values, A, rtol=0, atol=0.01)
    assert record.rate_hz == pytest.approx(500, rel=1e-3)
    assert record.unit_basis in ("column header", "metadata")


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ("Time (s),X (m/s?),Y (m/s?),Z (m/s?)", "the unit m/s? is not known"),
        ("Time (s),X (m/s\ufffd),Y (m/s\ufffd),Z (m/s\ufffd)", "is not known"),
        ("time (s),z,y,x", "gravity in m/s2"),
    ],
)
def test_lost_or_missing_units_are_refused(tmp_path: Path, header: str, words: str) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes((header + "\n" + body([T, *MS2])).encode())
    with pytest.raises(InputError) as caught:
        read_accelerometer(path)
    assert words in caught.value.why


def test_an_axis_of_words_is_not_left_out_silently(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    text = body([T, ["high"] * N, *IN_G[1:]])
    path.write_text("Time (s),X (g),Y (g),Z (g)\n" + text)
    with pytest.raises(InputError, match=r"X \(g\) cannot be read as numbers"):
        read_accelerometer(path)


def test_a_bad_cell_late_in_a_long_file_spoils_nothing_else(tmp_path: Path) -> None:
    count = 400_000  # several chunks of the reader
    t_s = np.arange(count) / 4000
    a = np.random.default_rng(3).normal(0, 4000, (count, 3)).round(1) + np.array([0, 0, 9806.0])
    rows = pd.DataFrame({"t": t_s, "x": a[:, 0], "y": a[:, 1], "z": a[:, 2]})
    path = tmp_path / "a.csv"
    rows.to_csv(path, sep=";", decimal=",", header=False, index=False, float_format="%.5f")
    lines = path.read_text().splitlines()
    lines[350_000] = lines[350_000].rsplit(";", 1)[0] + ";ERR"
    path.write_text("t (s);x (mm/s²);y (mm/s²);z (mm/s²)\n" + "\n".join(lines), encoding="utf-8")
    record = read_accelerometer(path)
    assert record.bad_cells == (("z (mm/s²)", 1),)
    values = np.delete(record.samples.values, 350_000, axis=0)
    np.testing.assert_allclose(values, np.delete(a, 350_000, axis=0) / 1000, rtol=0, atol=1e-6)
    assert np.isnan(record.samples.values[350_000, 2])
