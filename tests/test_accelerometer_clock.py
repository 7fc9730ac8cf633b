"""The sensor's clock from stamps of known truth: rate, gaps, repeats, counters that turn over."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from olivevib.errors import InputError, UsageError
from olivevib.files.accelerometer import AccelerometerRecord, ImportOptions, read_accelerometer
from olivevib.files.accelerometer.clock import stamp_timing


def timing(stamps: np.ndarray, same: np.ndarray | None = None):  # type: ignore[no-untyped-def]
    repeats = np.zeros(stamps.size, bool) if same is None else same
    return stamp_timing(stamps, lambda: repeats, None, "a")


def read(
    tmp_path: Path, stamps: list[str], unit: str = "s", **options: object
) -> AccelerometerRecord:
    rng = np.random.default_rng(3)
    values = rng.normal(0, 1, (len(stamps), 3)) + np.array([0, 0, 9.8])
    rows = [
        f"{s}," + ",".join(f"{v:.6f}" for v in row) for s, row in zip(stamps, values, strict=True)
    ]
    name = f"Time ({unit})" if unit else "Time"
    path = tmp_path / "a.csv"
    path.write_text(f"{name},X (m/s2),Y (m/s2),Z (m/s2)\n" + "\n".join(rows) + "\n")
    return read_accelerometer(path, ImportOptions(**options))  # type: ignore[arg-type]


@settings(max_examples=30, deadline=None)
@given(
    rate_hz=st.floats(50, 5000),
    quantum_s=st.sampled_from([1e-6, 1e-5, 1e-4, 1e-3]),
    seed=st.integers(0, 2**31),
)
def test_quantised_stamps_give_the_rate_within_its_sigma(
    rate_hz: float, quantum_s: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    true = rng.uniform(0, 5) + np.arange(3000) / rate_hz
    found = timing(np.floor(true / quantum_s) * quantum_s)
    assert found.clock.rate_hz == pytest.approx(rate_hz, rel=4 * quantum_s * rate_hz / 3000 + 1e-9)
    assert found.keep.all()
    worst = np.abs(found.t_s - true).max()
    assert worst <= 2 * quantum_s + 1e-9
    assert not found.clock.gaps


def test_white_jitter_sigma_of_the_rate_is_honest() -> None:
    rng = np.random.default_rng(1)
    errors, sigmas = [], []
    for _ in range(200):
        clock = timing(np.arange(500) / 1000 + rng.normal(0, 1e-4, 500).clip(-4e-4, 4e-4)).clock
        errors.append(clock.rate_hz - 1000)
        sigmas.append(clock.rate_sigma_hz)
    assert np.std(errors) == pytest.approx(np.mean(sigmas), rel=0.15)
    assert clock.method == "line"
    assert clock.jitter_s == pytest.approx(1e-4, rel=0.2)


def test_lost_samples_are_gaps_and_do_not_move_the_rate() -> None:
    rng = np.random.default_rng(4)
    sequence = np.delete(np.arange(4000), [*range(700, 706), 1500, *range(3000, 3200)])
    true = sequence / 800.0
    found = timing(true + rng.normal(0, 5e-5, true.size))
    assert found.clock.rate_hz == pytest.approx(800, abs=0.01)
    durations = [round(gap.duration_s * 800) for gap in found.clock.gaps]
    assert durations == [7, 2, 201]
    assert np.abs(found.t_s - true).max() < 2e-5
    assert found.clock.method == "line"


def test_a_burst_of_a_tenth_missing_keeps_true_times() -> None:
    rng = np.random.default_rng(8)
    sequence = np.flatnonzero(rng.uniform(size=5000) > 0.1)
    true = sequence / 1000.0
    found = timing(true + rng.normal(0, 2e-5, true.size))
    assert found.clock.rate_hz == pytest.approx(1000, abs=0.01)
    assert np.abs(found.t_s - true).max() < 1e-5


def test_a_rate_that_really_sinks_keeps_the_stamps() -> None:
    n = np.arange(5000)
    true = n / 400 + 0.01 * (n / 5000) ** 2
    found = timing(true)
    assert found.clock.method == "stamps"
    np.testing.assert_array_equal(found.t_s, true)
    assert found.clock.rate_hz == pytest.approx(5000 / (5000 / 400 + 0.01), rel=1e-3)


def test_repeated_rows_go_and_repeated_stamps_spread() -> None:
    true = np.arange(2000) / 400
    stamps = np.floor(true * 100) / 100  # four rows a stamp
    found = timing(stamps)
    assert found.clock.duplicates == 1500
    assert found.clock.dropped_rows == 0
    assert found.clock.rate_hz == pytest.approx(400, rel=1e-4)
    stamps = np.insert(true, 1000, true[999])
    same = np.zeros(stamps.size, bool)
    same[1000] = True
    found = timing(stamps, same)
    assert (found.clock.duplicates, found.clock.dropped_rows) == (1, 1)
    assert found.t_s.size == 2000


def test_counters_that_turn_over_go_on() -> None:
    true = np.arange(3000) / 500 + (2**32 * 1e-6 - 2.0)
    found = timing(np.mod(true, 2**32 * 1e-6))
    assert found.t_s[-1] - found.t_s[0] == pytest.approx(2999 / 500, abs=1e-9)
    assert found.clock.backward == 0


def test_single_wrong_stamps_are_left_out() -> None:
    stamps = np.arange(1000) / 200
    stamps[300], stamps[600] = 0.0, 99.0
    found = timing(stamps)
    assert found.clock.backward == 2
    assert found.t_s.size == 998
    assert found.clock.rate_hz == pytest.approx(200, rel=1e-6)


def test_two_recordings_in_one_file_are_refused() -> None:
    stamps = np.tile(np.arange(500) / 200, 2)
    with pytest.raises(InputError, match="runs backward at row 501"):
        timing(stamps)


@pytest.mark.parametrize(
    ("unit", "scale"), [("s", 1.0), ("ms", 1e3), ("us", 1e6), ("µs", 1e6), ("ns", 1e9)]
)
def test_units_of_stamps(tmp_path: Path, unit: str, scale: float) -> None:
    stamps = [f"{(2 + k / 250) * scale:.6f}" for k in range(300)]
    record = read(tmp_path, stamps, unit)
    assert record.rate_hz == pytest.approx(250, rel=1e-5)
    assert record.samples.t_s[0] == pytest.approx(2.0, abs=1e-6)
    assert record.clock.start is None


@pytest.mark.parametrize("scale", [1.0, 1e3, 1e6, 1e9])
def test_epochs_start_at_zero_with_their_instant(tmp_path: Path, scale: float) -> None:
    start = datetime(2026, 11, 20, 10, 15, tzinfo=UTC)
    ticks = [round((start.timestamp() + k / 100) * scale * 100) / 100 for k in range(300)]
    record = read(tmp_path, [f"{t:.2f}" for t in ticks], "")
    assert record.samples.t_s[0] == pytest.approx(0.0, abs=2e-3)
    assert record.rate_hz == pytest.approx(100, rel=1e-3)
    assert record.clock.start is not None
    assert abs(record.clock.start - start) < timedelta(seconds=0.01)


@pytest.mark.parametrize(
    ("form", "start"),
    [
        ("%Y-%m-%dT%H:%M:%S.%f", datetime(2026, 11, 20, 23, 59, 59)),
        ("%Y-%m-%d %H:%M:%S.%f", datetime(2026, 11, 20, 23, 59, 59)),
        ("%d.%m.%Y %H:%M:%S.%f", datetime(2026, 11, 20, 23, 59, 59)),
        ("%m/%d/%Y %I:%M:%S.%f %p", datetime(2026, 11, 20, 23, 59, 59)),
        ("%Y-%m-%dT%H:%M:%S.%f+02:00", datetime(2026, 11, 20, 23, 59, 59)),
        ("%H:%M:%S.%f", None),
    ],
)
def test_written_stamps_pass_midnight(tmp_path: Path, form: str, start: datetime | None) -> None:
    first = datetime(2026, 11, 20, 23, 59, 59)
    stamps = [(first + timedelta(milliseconds=5 * k)).strftime(form) for k in range(400)]
    record = read(tmp_path, stamps, "")
    assert record.rate_hz == pytest.approx(200, rel=1e-6)
    assert record.samples.duration_s == pytest.approx(399 / 200, abs=1e-6)
    found = record.clock.start
    assert (found.replace(tzinfo=None) if found else None) == start


def test_a_date_that_may_be_either_gives_no_start(tmp_path: Path) -> None:
    stamps = [f"03/04/2026 10:00:{k / 100:06.3f}" for k in range(300)]
    record = read(tmp_path, stamps, "")
    assert record.clock.start is None
    assert "sensor-date-ambiguous" in {c.code for c in record.cautions}


def test_whole_numbers_without_a_unit_are_refused_until_told(tmp_path: Path) -> None:
    stamps = [str(20 * k) for k in range(300)]
    with pytest.raises(InputError, match=r"(?s)names no unit.*ms: 50 Hz, us: 50000 Hz.*time_unit"):
        read(tmp_path, stamps, "")
    assert read(tmp_path, stamps, "", time_unit="ms").rate_hz == pytest.approx(50)
    assert read(tmp_path, stamps, "", rate_hz=77.0).rate_hz == 77.0


def test_seconds_without_a_unit_are_said(tmp_path: Path) -> None:
    record = read(tmp_path, [f"{k / 250:.4f}" for k in range(300)], "")
    assert record.rate_hz == pytest.approx(250)
    assert "sensor-time-unit-assumed" in {c.code for c in record.cautions}


def test_a_declared_start_and_wrong_options(tmp_path: Path) -> None:
    stamps = [f"{k / 250:.4f}" for k in range(300)]
    record = read(tmp_path, stamps, start="2026-11-20T10:15:00")
    assert record.clock.start == datetime(2026, 11, 20, 10, 15)
    with pytest.raises(UsageError, match="start"):
        read(tmp_path, stamps, start="yesterday")
    with pytest.raises(UsageError, match="rate_hz"):
        ImportOptions(rate_hz=-1.0)
    with pytest.raises(UsageError, match="axes"):
        ImportOptions(axes=("x", "x", "z"))
    with pytest.raises(UsageError, match="there is no column t9"):
        read(tmp_path, stamps, time_column="t9")
