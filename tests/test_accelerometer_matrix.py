"""Generated logger files: separator × decimal mark × unit × header × stamps, no unit ever wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from olivevib.errors import InputError
from olivevib.files.accelerometer import ImportOptions, read_accelerometer
from olivevib.studies.vibration.logger_files import (
    G,
    logger_truth,
    problem,
    variants,
    written,
)


def check(count: int, tmp_path: Path) -> None:
    path = tmp_path / "logger.csv"
    faults = [(v, fault) for v in variants(count) if (fault := problem(v, path))]
    assert not faults, "\n".join(f"{v}: {fault}" for v, fault in faults[:20]) + f"\n{len(faults)}"


def test_a_hundred_and_fifty_variants(tmp_path: Path) -> None:
    check(150, tmp_path)


@pytest.mark.slow
def test_the_whole_matrix_of_a_thousand_variants(tmp_path: Path) -> None:
    check(1000, tmp_path)


def test_most_variants_are_read_and_not_refused(tmp_path: Path) -> None:
    told = [v for v in variants(300) if v.unit_is_told and v.stamp != "nothing"]
    path = tmp_path / "logger.csv"
    for variant in told[:60]:
        path.write_bytes(written(variant))
        assert read_accelerometer(path).samples.values.shape == (400, 3)


def test_a_missing_unit_is_proposed_and_taken_only_when_accepted(tmp_path: Path) -> None:
    t_s, a = logger_truth()
    path = tmp_path / "logger.csv"
    rows = (f"{t:.4f},{x:.6f},{y:.6f},{z:.6f}" for t, (x, y, z) in zip(t_s, a / G, strict=True))
    path.write_text("t,x,y,z\n" + "\n".join(rows))
    with pytest.raises(InputError, match=r'(?s)gravity in g.*unit = "g"'):
        read_accelerometer(path)
    accepted = read_accelerometer(path, ImportOptions(unit="rest"))
    assert accepted.unit_basis == "proposed from rest magnitude"
    assert "sensor-unit-proposed" in {c.code for c in accepted.cautions}
    declared = read_accelerometer(path, ImportOptions(unit="g"))
    assert declared.unit_basis == "declared"
    np.testing.assert_allclose(declared.samples.values, a, atol=1e-4)


def test_a_header_that_gravity_contradicts_is_doubted(tmp_path: Path) -> None:
    t_s, a = logger_truth()
    path = tmp_path / "logger.csv"
    rows = (f"{t:.4f},{x:.6f},{y:.6f},{z:.6f}" for t, (x, y, z) in zip(t_s, a, strict=True))
    path.write_text("t (s),x (g),y (g),z (g)\n" + "\n".join(rows))
    record = read_accelerometer(path)
    caution = next(c for c in record.cautions if c.code == "sensor-unit-doubtful")
    assert "m/s2" in caution.text
