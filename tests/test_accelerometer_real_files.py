"""Every real accelerometer file: right, or refused for the right reason."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import pyuff

from olivevib.errors import InputError
from olivevib.files.accelerometer import AccelerometerRecord, read_accelerometer

pytestmark = pytest.mark.shared


def read(shared_data: Path, name: str) -> AccelerometerRecord:
    return read_accelerometer(shared_data / "accelerometer" / name)


def codes(record: AccelerometerRecord) -> set[str]:
    return {caution.code for caution in record.cautions}


PROPOSED = "proposed from rest magnitude"
# file, rows, axes, unit, basis, rate and how far it may be off, gravity m/s2 and how far
TABLE = [
    ("endaq_ide/SSX70065_derived_en.csv", 37361, "g", "column header", 3072.14, 0.05, 9.85, 0.35),
    (
        "endaq_ide/SSX70065_derived_it_ms2.csv",
        8000,
        "m/s2",
        "column header",
        3072.1,
        0.3,
        9.85,
        0.35,
    ),
    ("endaq_ide/S2-D8D16_16g_derived.csv", 7113, "g", "column header", 393.74, 0.01, 9.8, 0.05),
    ("endaq_ide/S2-D8D16_8g_derived.csv", 9070, "g", "column header", 501.99, 0.01, 9.8, 0.05),
    *(
        (f"tree_mpu6050/{name}.csv", 3996, "counts", PROPOSED, 333.0, 0.05, 9.80665, 0.01)
        for name in ("chainsaw_1", "machete_1", "ambient_1", "mac_far_new_sd_b28")
    ),
]


@pytest.mark.parametrize(
    ("name", "rows", "unit", "basis", "rate_hz", "rate_off", "gravity", "gravity_off"), TABLE
)
def test_unit_rate_and_gravity(  # noqa: PLR0917
    shared_data: Path,
    name: str,
    rows: int,
    unit: str,
    basis: str,
    rate_hz: float,
    rate_off: float,
    gravity: float,
    gravity_off: float,
) -> None:
    record = read(shared_data, name)
    assert record.samples.values.shape == (rows, 3)
    assert record.samples.axes == ("x", "y", "z")
    assert (record.source_unit, record.unit_basis) == (unit, basis)
    assert record.rate_hz == pytest.approx(rate_hz, abs=rate_off)
    assert record.rest_magnitude_m_s2 == pytest.approx(gravity, abs=gravity_off)
    assert not record.clock.duplicates


def test_the_shaker_sine_has_its_amplitude_and_frequency(shared_data: Path) -> None:
    samples = read(shared_data, "endaq_ide/SSX70065_derived_en.csv").samples
    steady = (samples.t_s > 4.5) & (samples.t_s < 8.5)
    t_s, y = samples.t_s[steady] - 6.5, samples.values[steady, 1]
    f_hz = 99.998
    for _ in range(10):  # four-parameter sine fit
        w = 2 * np.pi * f_hz * t_s
        columns = [np.cos(w), np.sin(w), np.ones_like(w)]
        a, b, _ = np.linalg.lstsq(np.column_stack(columns), y, rcond=None)[0]
        columns.append(2 * np.pi * t_s * (b * np.cos(w) - a * np.sin(w)))
        fit = np.linalg.lstsq(np.column_stack(columns), y, rcond=None)[0]
        f_hz += fit[3]
    assert f_hz == pytest.approx(99.998, abs=0.005)
    assert np.hypot(fit[0], fit[1]) / 9.80665 == pytest.approx(10.196, rel=5e-4)


def test_clipping_bad_cells_and_gaps_of_the_tree_logger(shared_data: Path) -> None:
    machete = read(shared_data, "tree_mpu6050/machete_1.csv")
    assert sum(machete.clipped) == 12
    assert machete.bad_cells == (("accel_mag", 2),)
    assert machete.clock.method == "line"
    assert not machete.clock.gaps
    assert {"sensor-clipped", "sensor-bad-cells", "sensor-unit-proposed"} <= codes(machete)
    far = read(shared_data, "tree_mpu6050/mac_far_new_sd_b28.csv")
    assert [round(gap.duration_s, 6) for gap in far.clock.gaps] == [0.015, 0.023]
    assert sum(far.clipped) == 5
    assert far.bad_cells == (("accel_mag", 1),)
    assert {"sensor-gaps", "sensor-clipped", "sensor-bad-cells"} <= codes(far)
    assert "accel_mag" in dict(far.columns_refused)


def test_a_logger_whose_rate_sinks_keeps_its_stamps(shared_data: Path) -> None:
    record = read(shared_data, "endaq_ide/S2-D8D16_16g_derived.csv")
    assert record.clock.method == "stamps"
    assert record.samples.t_s[0] == pytest.approx(0.952392, abs=1e-12)


def test_a_gyroscope_is_refused_by_name(shared_data: Path) -> None:
    with pytest.raises(InputError, match=r"(?s)no acceleration.*Gyroscope x \(rad/s\)") as caught:
        read(shared_data, "phyphox/gyroscope_raw_data.csv")
    assert "gyroscope in rad/s" in caught.value.why


def test_the_hammer_record_of_labview(shared_data: Path) -> None:
    record = read(shared_data, "beam_optical_vs_accel/acceleration.lvm")
    g = record.samples.values[:, 0] / 9.80665
    assert record.samples.values.shape == (50030, 1)
    assert record.rate_hz == pytest.approx(50000, rel=1e-9)
    assert np.nanmax(np.abs(g)) == pytest.approx(35.458, abs=0.001)
    assert record.columns_refused == (("Force (Trigger)", "force in Newtons, no acceleration"),)
    assert (record.source_unit, record.unit_basis) == ("g", "column header")
    assert record.clock.start is not None
    assert record.clock.start.isoformat() == "2018-12-17T10:18:21.109129"


def test_universal_files_with_accelerations(shared_data: Path) -> None:
    binary = read(shared_data, "uff58/binary8byte.uff")
    assert (binary.samples.values.shape, binary.source_unit) == ((250, 1), "g")
    assert binary.rate_hz == pytest.approx(100)
    path = shared_data / "accelerometer" / "uff58" / "binary8byte.uff"
    theirs = pyuff.UFF(str(path)).read_sets(0)
    np.testing.assert_allclose(
        binary.samples.values[:, 0] / 9.80665, theirs["data"], rtol=0, atol=1e-15
    )
    np.testing.assert_allclose(binary.samples.t_s, theirs["x"], rtol=0, atol=1e-12)
    text = read(shared_data, "uff58/time-history-not-all-columns-filled.uff")
    assert (text.samples.values.shape, text.source_unit) == ((13, 1), "m/s2")
    assert text.rate_hz == pytest.approx(20000)
    assert text.samples.values[-1, 0] == pytest.approx(-5.84096)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("uff58/sample_dataset58_psd.uff", "power spectral density"),
        ("uff58/non_ascii_header.uff", "frequency response function"),
        ("uff58/dataset_milestone_in_header.uff", "sound pressure in Pa"),
        ("beam_optical_vs_accel/camera.cih", ""),
        ("beam_optical_vs_accel/displacements_lk.npy", "(15, 3750, 2)"),
    ],
)
def test_what_is_rightly_refused(shared_data: Path, name: str, words: str) -> None:
    with pytest.raises(InputError) as caught:
        read(shared_data, name)
    assert words in caught.value.why
    assert caught.value.remedy


def test_endaq_recordings_need_their_library_and_then_are_right(shared_data: Path) -> None:
    name = "endaq_ide/SSX70065.IDE"
    try:
        import idelib  # noqa: F401
    except ImportError:
        with pytest.raises(InputError, match=r"(?s)idelib.*pip install idelib"):
            read(shared_data, name)
        return
    record = read(shared_data, name)
    assert record.samples.values.shape == (37361, 3)
    assert record.rate_hz == pytest.approx(3072.14, abs=0.05)
    with pytest.raises(InputError, match="several accelerometers"):
        read(shared_data, "endaq_ide/S2-D8D16_two_accelerometers.ide")
