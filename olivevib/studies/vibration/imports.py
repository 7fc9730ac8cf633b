"""The importer: a matrix of generated files, the real ones, and its time beside pandas' reader."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from io import StringIO
from pathlib import Path
from time import process_time

import numpy as np
import pandas as pd

from olivevib.errors import InputError
from olivevib.files.accelerometer import read_accelerometer
from olivevib.progress import Tick
from olivevib.studies.study import Effort, Goal, Table
from olivevib.studies.vibration.logger_files import problem, variants
from olivevib.studies.vibration.measures import Part

VARIANTS = 500
SHARED = Path("../shared/data/accelerometer")
# file, what it is: rows and rate, or words of the refusal
REAL: tuple[tuple[str, int, float, str], ...] = (
    ("beam_optical_vs_accel/acceleration.lvm", 50_030, 50_000.0, ""),
    ("endaq_ide/SSX70065_derived_en.csv", 37_361, 3072.14, ""),
    ("endaq_ide/SSX70065_derived_it_ms2.csv", 8_000, 3072.1, ""),
    ("endaq_ide/S2-D8D16_16g_derived.csv", 7_113, 393.74, ""),
    ("endaq_ide/S2-D8D16_8g_derived.csv", 9_070, 501.99, ""),
    ("endaq_ide/SSX70065.IDE", 37_361, 3072.14, "idelib"),
    ("tree_mpu6050/chainsaw_1.csv", 3_996, 333.0, ""),
    ("tree_mpu6050/machete_1.csv", 3_996, 333.0, ""),
    ("tree_mpu6050/ambient_1.csv", 3_996, 333.0, ""),
    ("tree_mpu6050/mac_far_new_sd_b28.csv", 3_996, 333.0, ""),
    ("uff58/binary8byte.uff", 250, 100.0, ""),
    ("uff58/time-history-not-all-columns-filled.uff", 13, 20_000.0, ""),
    ("endaq_ide/S2-D8D16_two_accelerometers.ide", 0, 0.0, "several accelerometers|idelib"),
    ("uff58/sample_dataset58_psd.uff", 0, 0.0, "no acceleration"),
    ("uff58/non_ascii_header.uff", 0, 0.0, "no acceleration"),
    ("uff58/dataset_milestone_in_header.uff", 0, 0.0, "no acceleration"),
    ("phyphox/gyroscope_raw_data.csv", 0, 0.0, "no acceleration"),
)


def matrix(effort: Effort, tick: Tick) -> Part:
    """Generated files: separator, decimal mark, unit, header, stamps; none with a wrong unit."""
    count = effort.count(VARIANTS, 5)
    faults: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        for n, variant in enumerate(variants(count)):
            tick(n, count, "generated logger files")
            fault = problem(variant, Path(folder) / "logger.csv")
            faults += [f"{variant}: {fault}"] if fault else []
    rows = tuple((fault,) for fault in faults[:20]) or (("none",),)
    words = f"{len(faults)} of {count}"
    goal = Goal("generated files read wrongly", "0 of 500", words, not faults)
    return Part(Table("Generated logger files, faults", ("fault",), rows), (goal,))


def real(effort: Effort, tick: Tick) -> Part:
    """The shared real recordings: right, or rightly refused."""
    asked = "all right, or rightly refused"
    if not SHARED.is_dir():
        goal = Goal("real recordings", asked, "they are not beside this project", None)
        return Part(Table("Real recordings", ("file", "found"), ()), (goal,))
    rows = []
    for n, (name, count, rate_hz, refusal) in enumerate(REAL):
        tick(n, len(REAL), name)
        rows.append((name, *_found(SHARED / name, count, rate_hz, refusal)))
    wrong = [row[0] for row in rows if not row[2]]
    words = f"{len(rows) - len(wrong)} of {len(rows)}" + (f"; wrong: {wrong}" if wrong else "")
    goal = Goal("real recordings", asked, words, not wrong)
    return Part(Table("Real recordings", ("file", "found", "right"), tuple(rows)), (goal,))


def _found(path: Path, rows: int, rate_hz: float, refusal: str) -> tuple[str, bool]:
    try:
        record = read_accelerometer(path)
    except InputError as error:
        words = str(error).splitlines()
        told = any(part in str(error) for part in refusal.split("|")) if refusal else False
        return f"refused: {words[0]}", told
    size = record.samples.t_s.size
    right = bool(rows) and size == rows and abs(record.rate_hz / rate_hz - 1) < 2e-4
    return f"{size} rows at {record.rate_hz:.2f} Hz, {record.source_unit}", right


def speed(effort: Effort, tick: Tick) -> Part:
    """Time of an import over that of pandas' C reader told everything, 60 s at 2 kHz."""
    rng = np.random.default_rng(1)
    n = max(4000, round(120_000 * min(1.0, effort.share)))
    t = np.arange(n) / 2000
    a = 99 * np.sin(157 * t[:, None] + np.arange(3)) + rng.normal(size=(n, 3)) + [0, 0, 9.8]
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for k, (name, separator, decimal) in enumerate(
            (("comma", ",", "."), ("semicolon, decimal comma", ";", ","), ("tab", "\t", "."))
        ):
            tick(k, 3, name)
            path = Path(folder) / "logger.csv"
            text = StringIO()
            frame = pd.DataFrame(np.column_stack([t, a]))
            frame.columns = pd.Index(["Time (s)", "X (m/s2)", "Y (m/s2)", "Z (m/s2)"])
            frame.to_csv(text, sep=separator, decimal=decimal, index=False, float_format="%.5f")
            path.write_text(text.getvalue(), encoding="utf-8")
            rows.append((name, *_times(path, separator, decimal)))
    worst = max(row[3] for row in rows)
    reached = bool(worst <= 1.3) if n >= 120_000 else None
    goal = Goal("import over pandas' C reader", "<= 1.3", f"{worst:.2f}", reached)
    columns = ("layout", "olivevib ms", "pandas ms", "ratio")
    return Part(Table("Time of an import", columns, tuple(rows)), (goal,))


def _times(path: Path, separator: str, decimal: str) -> tuple[float, float, float]:
    """Both readers in turn, least of nine; processor time: others at work do not count."""

    def pandas() -> object:
        return pd.read_csv(path, sep=separator, decimal=decimal, engine="c")

    ours, theirs = [], []
    for _ in range(9):
        theirs.append(_clock(pandas))
        ours.append(_clock(lambda: read_accelerometer(path)))
    return 1e3 * min(ours), 1e3 * min(theirs), min(ours) / min(theirs)


def _clock(work: Callable[[], object]) -> float:
    start = process_time()
    work()
    return process_time() - start
