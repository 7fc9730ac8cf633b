"""Column names and units in the words of loggers; which columns are axes, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from olivevib.errors import InputError, UsageError
from olivevib.files.accelerometer import AccelerometerRecord, ImportOptions, read_accelerometer
from olivevib.files.accelerometer.names import meaning
from olivevib.files.accelerometer.units import parse_unit

G = 9.80665


@pytest.mark.parametrize(
    ("factor", "spellings"),
    [
        (1.0, "m/s² m/s^2 m/s2 m/s/s m·s⁻² m.s-2 ms^-2 m*s^-2 (m/s²) m/sec² M/S2 m_s2 mps2"),
        (1e-3, "mm/s² mm/s^2 mm/s/s"),
        (1e-2, "cm/s² cm/s^2 gal Gal"),
        (0.3048, "ft/s² ft/s^2 ft/sec2"),
        (G, "g G g's gn g0"),
        (G / 1000, "mg milli-g"),
        (G * 1e-6, "µg μg ug"),
    ],
)
def test_spellings_of_acceleration(factor: float, spellings: str) -> None:
    for text in [*spellings.split()]:
        unit = parse_unit(text)
        assert unit is not None, text
        assert unit.quantity == "acceleration", text
        assert unit.factor == pytest.approx(factor), text
    assert parse_unit("meters per second squared") == parse_unit("m/s2")


@pytest.mark.parametrize(
    ("text", "quantity"),
    [
        ("rad/s", "angular velocity"),
        ("°/s", "angular velocity"),
        ("N", "force"),
        ("Newtons", "force"),
        ("Pa", "pressure"),
        ("g²/Hz", "spectrum"),
        ("(m/s²)²/Hz", "spectrum"),
        ("g/√Hz", "spectrum"),
        ("mm/s", "velocity"),
        ("mm", "displacement"),
        ("µT", "magnetic field"),
        ("LSB", "raw"),
        ("mV", "raw"),
    ],
)
def test_other_quantities(text: str, quantity: str) -> None:
    unit = parse_unit(text)
    assert unit is not None
    assert unit.quantity == quantity


def test_unknown_units_are_unknown() -> None:
    for text in ("(1/N)*(m/s²)", "furlong", "m/s\ufffd", ""):
        assert parse_unit(text) is None


@pytest.mark.parametrize(
    ("name", "quantity", "axis", "unit"),
    [
        ("X (g)", "acceleration", "x", "g"),
        ("Asse Y [m/s²]", "acceleration", "y", "m/s2"),
        ("acc_x_m_s2", "acceleration", "x", "m/s2"),
        ("Beschleunigung Z in mg", "acceleration", "z", "mg"),
        ("Linear Acceleration x (m/s^2)", "linear acceleration", "x", "m/s2"),
        ("Acceleration x (m/s^2)", "acceleration", "x", "m/s2"),
        ("Absolute acceleration (m/s^2)", "magnitude", "", "m/s2"),
        ("accel_mag", "magnitude", "", None),
        ("gFx", "acceleration", "x", "g"),
        ("gFTotal", "magnitude", "", "g"),
        ("ax", "acceleration", "x", None),
        ("GRAVITY X (m/s²)", "gravity", "x", "m/s2"),
        ("Gyroscope x (rad/s)", "gyroscope", "x", "rad/s"),
        ("X (rad/s)", "angular velocity", "x", "rad/s"),
        ("mag_x", "magnetometer", "x", None),
        ("magnetic field x (µT)", "magnetometer", "x", "T"),
        ("Force (Trigger)", "force", "", None),
        ("PSD X (g²/Hz)", "spectrum", "x", "g²/Hz"),
        ("vib_x (mm/s)", "velocity", "x", "m/s"),
        ("Peak X (g)", "magnitude", "x", "g"),
        ("Time (s)", "time", "", "s"),
        ("timestamp_ms", "time", "", "ms"),
        ("Tempo [s]", "time", "", "s"),
        ("loop_us", "index", "", "us"),
        ("temp_c", "temperature", "", None),
        ("X (LSB)", "acceleration", "x", "counts"),
        ("X_Value", "time", "", None),
    ],
)
def test_meanings(name: str, quantity: str, axis: str, unit: str | None) -> None:
    found = meaning(name)
    assert (found.quantity, found.axis) == (quantity, axis)
    assert (found.unit.name if found.unit else None) == unit


def table(header: list[str], values: np.ndarray, tmp_path: Path) -> Path:
    path = tmp_path / "a.csv"
    np.savetxt(path, values, delimiter=",", fmt="%.7f", header=",".join(header), comments="")
    return path


def columns(count: int, rest: float = 1.0, n: int = 300) -> np.ndarray:
    rng = np.random.default_rng(9)
    values = rng.normal(0, 0.01 * rest, (n, count + 1))
    values[:, 0] = np.arange(n) / 100
    values[:, 1:] += np.arange(1, count + 1) * 0.01 * rest
    values[:, 3] += rest
    return values


def read(
    tmp_path: Path, header: list[str], values: np.ndarray, **options: object
) -> AccelerometerRecord:
    return read_accelerometer(
        table(header, values, tmp_path),
        ImportOptions(**options),  # type: ignore[arg-type]
    )


def test_axes_in_any_order_beside_everything_else(tmp_path: Path) -> None:
    header = ["t (s)", "az (g)", "gx (dps)", "ax (g)", "amag (g)", "ay (g)", "temp"]
    values = columns(6)
    record = read(tmp_path, header, values)
    np.testing.assert_allclose(record.samples.values, values[:, [3, 5, 1]] * G, atol=1e-5)
    refused = dict(record.columns_refused)
    assert refused["gx (dps)"] == "angular velocity in dps, no acceleration"
    assert refused["amag (g)"] == "a magnitude in g, no axis"
    assert record.columns_used == ("ax (g)", "ay (g)", "az (g)")


def test_raw_is_preferred_to_linear_acceleration(tmp_path: Path) -> None:
    raw = [f"Accelerometer {a} (m/s²)" for a in "xyz"]
    linear = [f"Linear Acceleration {a} (m/s²)" for a in "xyz"]
    record = read(tmp_path, ["Time (s)", *linear, *raw], columns(6, 9.8))
    assert record.columns_used == tuple(raw)
    only = read(tmp_path, ["Time (s)", *linear], columns(3, 9.8))
    assert "sensor-gravity-removed" in {c.code for c in only.cautions}


def test_two_sensors_must_be_chosen_between(tmp_path: Path) -> None:
    header = ["t (s)", *(f"acc1_{a} (g)" for a in "xyz"), *(f"acc2_{a} (g)" for a in "xyz")]
    values = columns(6)
    with pytest.raises(InputError, match=r"(?s)several accelerometers.*acc2_x.*columns"):
        read(tmp_path, header, values)
    chosen = ("acc2_x (g)", "acc2_y (g)", "acc2_z (g)")
    record = read(tmp_path, header, values, columns=chosen)
    np.testing.assert_allclose(record.samples.values, values[:, 4:7] * G, atol=1e-5)
    by_number = read(tmp_path, header, values, columns=("5", "6", "7"))
    assert by_number.columns_used == chosen
    with pytest.raises(UsageError, match="there is no column acc3_x"):
        read(tmp_path, header, values, columns=("acc3_x",))


def test_the_same_names_twice_are_two_sensors(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="several accelerometers"):
        read(tmp_path, ["t (s)", *(f"{a} (g)" for a in "xyzxyz")], columns(6))


def test_axes_are_turned_and_signed(tmp_path: Path) -> None:
    header = ["t (s)", "x (g)", "y (g)", "z (g)"]
    values = columns(3)
    record = read(tmp_path, header, values, axes=("y", "-x", "z"))
    expected = np.column_stack([values[:, 2], -values[:, 1], values[:, 3]]) * G
    np.testing.assert_allclose(record.samples.values, expected, atol=1e-5)
    assert record.gravity_m_s2[2] == pytest.approx(1.03 * G, rel=0.01)


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (["Gyro X (rad/s)", "Gyro Y (rad/s)", "Gyro Z (rad/s)"], "gyroscope in rad/s"),
        (["Force 1 (N)", "Force 2 (N)", "Force 3 (N)"], "force in N"),
        (["p1 (Pa)", "p2 (Pa)", "p3 (Pa)"], "pressure in Pa"),
        (["X (g²/Hz)", "Y (g²/Hz)", "Z (g²/Hz)"], "spectrum in g²/Hz"),
        (["x (mm)", "y (mm)", "z (mm)"], "displacement in mm"),
        (["Acc X (m/s³)", "Acc Y (m/s³)", "Acc Z (m/s³)"], "jerk"),
        (["Acc X [foo/s²]", "Acc Y [foo/s²]", "Acc Z [foo/s²]"], "the unit foo/s² is not known"),
    ],
)
def test_what_is_no_acceleration_is_refused_by_name(
    tmp_path: Path, names: list[str], words: str
) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path, ["Time (s)", *names], columns(3))
    assert words in caught.value.why
    assert names[0] in caught.value.why


def test_volts_need_a_sensitivity(tmp_path: Path) -> None:
    header = ["Time (s)", "X (mV)", "Y (mV)", "Z (mV)"]
    values = columns(3, 102.0)
    with pytest.raises(InputError, match="per_g"):
        read(tmp_path, header, values)
    record = read(tmp_path, header, values, per_g=102.0)
    np.testing.assert_allclose(record.samples.values, values[:, 1:] / 102 * G, atol=1e-4)
    assert (record.source_unit, record.unit_basis) == ("mV", "declared")


def test_counts_are_scaled_by_rest_and_say_so(tmp_path: Path) -> None:
    header = ["Time (s)", "X (counts)", "Y (counts)", "Z (counts)"]
    values = np.rint(columns(3, 2048.0))
    values[:, 0] = np.arange(300) / 100
    record = read(tmp_path, header, values)
    assert record.unit_basis == "proposed from rest magnitude"
    assert record.rest_magnitude_m_s2 == pytest.approx(G, rel=1e-9)
    declared = read(tmp_path, header, values, per_g=2048.0)
    assert declared.m_s2_per_unit == pytest.approx(G / 2048)
    assert "sensor-unit-proposed" not in {c.code for c in declared.cautions}


def test_whole_numbers_that_may_be_mm_s2_are_not_taken_for_counts(tmp_path: Path) -> None:
    values = np.rint(columns(3, 9807.0))
    values[:, 0] = np.arange(300) / 100
    with pytest.raises(InputError, match=r"mm/s2"):
        read(tmp_path, ["t (s)", "x", "y", "z"], values)


def test_a_unit_that_is_none_is_a_usage_error(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="unit = parsec"):
        read(tmp_path, ["t (s)", "x", "y", "z"], columns(3), unit="parsec")


def test_no_header_at_all(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    np.savetxt(path, columns(3), delimiter="\t", fmt="%.6f")
    record = read_accelerometer(path, ImportOptions(unit="g"))
    assert record.samples.axes == ("x", "y", "z")
    assert record.rate_hz == pytest.approx(100)
    assert "sensor-axes-by-order" in {c.code for c in record.cautions}


def test_clipped_stuck_and_absent_gravity(tmp_path: Path) -> None:
    t = np.arange(2000) / 500
    values = np.column_stack([t, np.clip(20 * np.sin(70 * t), -16, 16), 0 * t + 0.5, np.cos(9 * t)])
    record = read(tmp_path, ["t (s)", "x (g)", "y (g)", "z (g)"], values)
    codes = {c.code for c in record.cautions}
    assert {"sensor-clipped", "sensor-axis-stuck", "sensor-gravity-absent"} <= codes
    assert record.clipped[0] == int((np.abs(values[:, 1]) == 16).sum())
    assert record.clipped[1:] == (0, 0)


def test_clean_sines_are_not_clipped(tmp_path: Path) -> None:
    t = np.arange(4000) / 500
    for amplitude, decimals in ((10.196, 2), (1.0, 7), (3.0, 1)):
        x = np.round(amplitude * np.sin(2 * np.pi * 25 * t), decimals)
        y = np.round(amplitude * np.sin(2 * np.pi * 24.7 * t), decimals)
        values = np.column_stack([t, x, y, 0 * t + 1])
        assert read(tmp_path, ["t (s)", "x (g)", "y (g)", "z (g)"], values).clipped == (0, 0, 0)
