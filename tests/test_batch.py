"""What a batch is made of: finding trials, time left, addresses, the result hash."""

import shutil
import subprocess
import sys
from pathlib import Path

import batch_trials
import h5py
import pytest

from olivevib import pipeline
from olivevib.batch import TrialResult, find_trials, measure_on_cluster
from olivevib.batch.cluster import check_address
from olivevib.batch.contents import read_contents
from olivevib.batch.outlook import Outlook
from olivevib.batch.unit import measure
from olivevib.errors import Caution, UsageError
from olivevib.files.store import read_stage, write_stage
from olivevib.trial import Trial
from olivevib.trial.records.cautions import cautions_text


@pytest.fixture(scope="module")
def done(tmp_path_factory) -> Path:
    folder = batch_trials.one(tmp_path_factory.mktemp("ws") / "done")
    list(pipeline.run(Trial.open(folder)))
    return folder


# --- finding trials -----------------------------------------------------------------------


def trial_at(folder: Path) -> Path:
    folder.mkdir(parents=True)
    (folder / "trial.toml").write_text("")
    return folder


def test_a_folder_counts_as_all_trials_below_it(tmp_path):
    far = trial_at(tmp_path / "2026" / "november" / "T2")
    near = trial_at(tmp_path / "2026" / "T1")
    trial_at(near / "exports" / "no_trial_of_its_own")
    trial_at(tmp_path / "2026" / ".hidden" / "T9")
    assert find_trials([str(tmp_path / "2026")], tmp_path) == [near, far]


def test_names_stand_for_trials_of_the_workspace_and_each_trial_counts_once(tmp_path):
    a, b = (trial_at(tmp_path / "trials" / name) for name in "ab")
    assert find_trials(["b", "a", str(b)], tmp_path) == [b, a]


def test_a_linked_trial_is_found_and_a_ring_of_links_ends(tmp_path):
    real = trial_at(tmp_path / "elsewhere" / "T1")
    season = tmp_path / "season"
    season.mkdir()
    (season / "T1").symlink_to(real)
    (season / "round").symlink_to(season)
    assert find_trials([str(season)], tmp_path) == [real]


def test_a_name_that_leads_to_no_trial_is_wrong_use(tmp_path):
    (tmp_path / "empty").mkdir()
    for name in ("empty", "never"):
        with pytest.raises(UsageError, match="is no trial and holds none"):
            find_trials([str(tmp_path / name)], tmp_path)


def test_the_batch_itself_stays_light_its_workers_do_the_work():
    code = "import sys, olivevib.batch, olivevib.cli.batch; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


# --- time left ----------------------------------------------------------------------------


def test_time_left_rests_on_trials_that_had_something_to_do():
    clock = [0.0]
    outlook = Outlook(6, 2, lambda: clock[0])
    outlook.started("/s/T0")
    outlook.finished(TrialResult("/s/T0", "00"))  # was up to date: says nothing of the others
    assert outlook.seconds_left() is None
    outlook.started("/s/T1")
    outlook.started("/s/T2")
    clock[0] = 60.0
    outlook.finished(TrialResult("/s/T1", "00", ("track",), seconds=60.0))
    outlook.started("/s/T3")
    # T2 is due, T3 takes 60 s, T4 and T5 wait: 180 s of work for two workers
    assert outlook.seconds_left() == pytest.approx(90.0)
    assert outlook.progress() == (2, 6, "trials: 2 min left; T3")


def test_time_left_of_the_last_trial_is_that_of_one_worker():
    clock = [0.0]
    outlook = Outlook(2, 2, lambda: clock[0])
    outlook.started("/s/T0")
    outlook.started("/s/T1")
    clock[0] = 40.0
    outlook.finished(TrialResult("/s/T0", "00", ("track",), seconds=40.0))
    outlook.interrupted("/s/T1")
    assert outlook.seconds_left() == pytest.approx(40.0)


# --- where it may run ---------------------------------------------------------------------


@pytest.mark.parametrize(
    "address",
    ["tcp://127.0.0.1:8786", "127.0.0.1:8786", "localhost:8786", "tcp://[::1]:8786", "tls://far:1"],
)
def test_loopback_and_tls_are_allowed(address):
    check_address(address)


@pytest.mark.parametrize(
    "address",
    ["tcp://192.168.1.7:8786", "far:8786", "tcp://0.0.0.0:8786", "tcp://127.0.0.1.evil:1"],
)
def test_an_open_scheduler_elsewhere_is_refused_with_the_remedy(address):
    with pytest.raises(UsageError, match="not encrypted") as caught:
        check_address(address)
    assert "any code" in caught.value.why
    assert "tls://" in caught.value.remedy


@pytest.mark.parametrize(
    "address", ["http://127.0.0.1:8786", "ucx://127.0.0.1:1", "tcp://[::1", "localhost"]
)
def test_what_is_no_address_is_told(address):
    with pytest.raises(UsageError, match="no address"):
        check_address(address)


def test_without_distributed_the_remedy_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UsageError, match="distributed") as caught:
        next(measure_on_cluster([tmp_path], "127.0.0.1:8786"))
    assert "olivevib[cluster]" in caught.value.remedy


# --- results ------------------------------------------------------------------------------


def test_a_result_travels_as_json():
    result = TrialResult(
        "/s/Tüü\udcff", "ab", ("track",), (Caution("c-d", "t", "r"),), "what", "why", "remedy"
    )
    assert TrialResult.from_json(result.to_json()) == result


def test_the_hash_tells_results_not_places(done, tmp_path):
    copy = tmp_path / "Ölbaum" / "copy"
    shutil.copytree(done, copy)
    (copy / "tracks.h5").unlink()  # made anew there
    list(pipeline.run(Trial.open(copy)))
    assert read_contents(Trial.open(copy))[0] == read_contents(Trial.open(done))[0]


def test_the_hash_does_not_see_where_a_caution_names_the_trial(done, tmp_path):
    found = set()
    for name in ("a", "Ö"):
        copy = tmp_path / name
        shutil.copytree(done, copy)
        text = cautions_text((Caution("video-truncated", f"{copy}/left.nut ends early", ""),))
        rewrite(copy, cautions=text)
        found.add(read_contents(Trial.open(copy))[0])
    assert len(found) == 1
    assert found != {read_contents(Trial.open(done))[0]}


def test_the_hash_sees_one_changed_bit(done, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(done, copy)
    before = read_contents(Trial.open(copy))[0]
    rewrite(copy, nudge=True)
    assert read_contents(Trial.open(copy))[0] != before


def rewrite(trial: Path, cautions: str = "", nudge: bool = False) -> None:
    """Write vibration.h5 with another caution, or one amplitude off by the last bit."""
    path = trial / "vibration.h5"
    file = read_stage(path, "analyse")
    values = file.variables["displacement/amplitude"].values
    if nudge:
        values.flags.writeable = True
        values[3, 0, 0] *= 1 + 3e-16
    attributes = dict(file.attributes) | ({"cautions": cautions} if cautions else {})
    write_stage(
        path,
        type(file)(file.stage, file.schema, file.settings, file.inputs, file.variables, attributes),
    )
    assert h5py.is_hdf5(path)


# --- one trial ----------------------------------------------------------------------------


def test_a_report_is_made_once_for_the_same_results(done, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(done, copy)
    first = measure(copy)
    assert (first.ran, first.failed) == (("report",), False)
    assert [c.code for c in first.cautions] == ["offset-unknown"]
    assert list(first.cautions) == list(Trial.open(copy).cautions)
    assert measure(copy) == TrialResult(first.folder, first.hash, (), first.cautions)
    (copy / ".olivevib" / "batch.json").write_text("{}")
    assert measure(copy) == first
    (copy / "report.html").write_text("changed by hand")
    assert measure(copy).ran == ("report",)
    Trial.open(copy).changed({"tree.cultivar": "Frantoio"})
    assert measure(copy).ran == ("report",)
    assert "Frantoio" in (copy / "report.html").read_text()
    Trial.open(copy).changed({"vibration.band_hz": [2.0, 11.0]})
    assert measure(copy).ran == ("analyse", "report")


def test_an_unforeseen_error_is_a_result_too(done, monkeypatch):
    def broken(trial, tick):
        raise ZeroDivisionError("oh")

    monkeypatch.setattr(pipeline, "run", broken)
    result = measure(done)
    assert "ZeroDivisionError: oh" in result.what
    assert "--debug" in result.remedy
