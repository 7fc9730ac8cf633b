"""Worker processes: same results however many, and what a kill, a failure or Ctrl-C costs."""

import json
import os
import random
import shutil
import signal
import time
from pathlib import Path

import batch_trials
import pytest

from olivevib import pipeline
from olivevib.batch import measure_here
from olivevib.batch.contents import read_contents
from olivevib.batch.remote import _measured
from olivevib.batch.unit import NOTE
from olivevib.cli import main
from olivevib.errors import InputError, UsageError
from olivevib.files.lock import alone_in
from olivevib.progress import Cancelled, silent
from olivevib.threads import uses_one_thread
from olivevib.trial import Trial
from olivevib.trial.fingerprints import PRIVATE

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")


@pytest.fixture(scope="module")
def fresh(tmp_path_factory) -> Path:
    """A trial in which nothing was measured yet."""
    return batch_trials.one(tmp_path_factory.mktemp("ws") / "fresh")


@pytest.fixture(scope="module")
def done(fresh, tmp_path_factory) -> Path:
    """The same trial with every stage done in this process, with its threads, and no report."""
    (folder,) = batch_trials.season(tmp_path_factory.mktemp("done"), fresh, 1)
    list(pipeline.run(Trial.open(folder)))
    return folder


@pytest.fixture(scope="module")
def truth(done) -> str:
    return read_contents(Trial.open(done))[0]


def test_one_worker_two_workers_and_no_worker_measure_the_same(fresh, truth, tmp_path):
    trials = batch_trials.season(tmp_path, fresh, 4)
    ticks = []
    results = list(measure_here(trials[:3], 2, lambda *tick: ticks.append(tick)))
    results += measure_here(trials[3:], 1)
    assert sorted(r.folder for r in results) == [str(t) for t in trials]
    assert {r.hash for r in results} == {truth}
    assert {r.ran for r in results} == {("calibrate", "track", "reconstruct", "analyse", "report")}
    counts = [done for done, total, note in ticks]
    assert counts == sorted(counts)
    assert ticks[-1][:2] == (3, 3)
    assert any("tracking markers" in note for _, _, note in ticks)
    assert any(" left; " in note for _, _, note in ticks)


@pytest.mark.slow
def test_run_with_many_threads_and_batch_calibrate_the_same(tmp_path):
    ran, batched = (recordings(tmp_path / verb) for verb in ("run", "batch"))
    many = {"OMP_NUM_THREADS": "4", "OPENBLAS_NUM_THREADS": "4"}
    run = batch_trials.start(ran, verb="run", **many)
    batch = batch_trials.start(batched, "--workers", 1)
    for program in (run, batch):
        _, told = program.communicate(timeout=300)
        assert program.returncode in (0, 3), told
    assert read_contents(Trial.open(ran)) == read_contents(Trial.open(batched))


def recordings(folder: Path) -> Path:
    """The sample trial as it was recorded: nothing measured yet."""
    sample = batch_trials.ROOT / "trials" / "sample"
    left_out = shutil.ignore_patterns("*.h5", "rig.toml", "report.html", PRIVATE)
    return shutil.copytree(sample, folder, ignore=left_out)


def test_every_verb_computes_with_one_thread(monkeypatch, capsys):
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "8")
    monkeypatch.setenv("OMP_NUM_THREADS", "8")
    assert not uses_one_thread(os.environ)
    assert main(["markers", "list"]) == 0
    assert uses_one_thread(os.environ)


@pytest.mark.parametrize("threads", ["1", "2"])
def test_a_cluster_worker_with_many_threads_lets_a_process_measure(
    done, truth, tmp_path, monkeypatch, threads
):
    (trial,) = batch_trials.season(tmp_path, done, 1)
    holders = set()
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", threads)
    monkeypatch.setattr("olivevib.batch.unit.use_one_core", lambda: holders.add("here"))
    assert _measured(trial, silent).hash == truth
    assert holders == ({"here"} if threads == "1" else set())


@pytest.mark.slow
def test_a_killed_worker_costs_one_repetition(fresh, truth, tmp_path):
    trials = batch_trials.season(tmp_path, fresh, 2)
    kills = Killer(trials[0], 1)
    results = {r.folder: r for r in measure_here(trials, 1, kills)}
    assert kills.killed == 1
    assert {r.hash for r in results.values()} == {truth}


def test_a_trial_that_kills_its_workers_is_listed_and_the_others_are_measured(
    fresh, truth, tmp_path
):
    trials = batch_trials.season(tmp_path, fresh, 2)
    kills = Killer(trials[0], 5)
    results = {r.folder: r for r in measure_here(trials, 1, kills)}
    assert kills.killed == 2
    deadly = results[str(trials[0])]
    assert "ended its worker process 2 times" in deadly.what
    assert "SIGKILL" in deadly.why
    assert "--workers 1" in deadly.remedy
    assert results[str(trials[1])].hash == truth


class Killer:
    """A tick that kills whoever tracks a trial, so many times."""

    def __init__(self, trial: Path, times: int) -> None:
        self.trial, self.times, self.killed = trial, times, 0
        self.victims: set[int] = set()

    def __call__(self, done, total, note):
        victim = batch_trials.holder(self.trial)
        at_work = f"{self.trial.name} tracking" in note
        if at_work and victim and victim not in self.victims and self.killed < self.times:
            self.victims.add(victim)
            self.killed += 1
            batch_trials.kill(victim)


@pytest.mark.slow
def test_cancelling_keeps_acknowledged_frames_and_leaves_no_process(fresh, truth, tmp_path):
    (trial,) = batch_trials.season(tmp_path, fresh, 1)
    victims = set()

    def tick(done, total, note):
        if "tracking" in note:
            victims.add(batch_trials.holder(trial))
            raise Cancelled

    with pytest.raises(Cancelled):
        list(measure_here([trial], 1, tick))
    assert not any(batch_trials.alive(v) for v in victims if v)
    assert (trial / PRIVATE / "track.journal").exists()
    assert not (trial / "tracks.h5").exists()
    (result,) = measure_here([trial], 1)
    assert result.hash == truth


def test_a_batch_ended_by_kill_9_takes_its_workers_along_and_resumes(fresh, truth, tmp_path):
    trials = batch_trials.season(tmp_path, fresh, 2)
    batch = batch_trials.start(tmp_path, "--workers", 2)
    workers = [batch_trials.wait_for(lambda t=t: batch_trials.holder(t)) for t in trials]
    batch.kill()
    batch.communicate()
    batch_trials.wait_for(lambda: not any(batch_trials.alive(w) for w in workers), 10)
    again = batch_trials.start(tmp_path, "--workers", 2)
    printed, told = again.communicate(timeout=120)
    assert again.returncode == 3, told  # offset-unknown
    assert batch_trials.hashes(printed) == {"T00": truth, "T01": truth}


@pytest.mark.slow
def test_whoever_is_killed_and_whenever_the_results_are_the_same(fresh, truth, tmp_path):
    trials = batch_trials.season(tmp_path, fresh, 5)
    chance = random.Random(1)
    for victims in ("batch", "worker", "batch", "worker"):
        batch = batch_trials.start(tmp_path, "--workers", 2, "--json")
        batch_trials.wait_for(lambda b=batch: b.poll() is not None or any(map(at_work, trials)))
        time.sleep(chance.uniform(0, 2.5))
        workers = [w for w in map(batch_trials.holder, trials) if w]
        if victims == "batch":
            batch.kill()
        elif workers:
            batch_trials.kill(chance.choice(workers))
            time.sleep(chance.uniform(0, 1.5))
            batch.kill()
        batch.communicate()
    finished = [t for t in trials if (t / PRIVATE / NOTE).exists()]
    results = {r.folder: r for r in measure_here(trials, 2)}
    assert {r.hash for r in results.values()} == {truth}
    assert all(results[str(t)].ran == () for t in finished)


def at_work(trial: Path) -> bool:
    return batch_trials.holder(trial) is not None


def test_ctrl_c_tells_what_is_done(done, truth, fresh, tmp_path):
    batch_trials.season(tmp_path / "b", fresh, 2)
    batch_trials.season(tmp_path / "a", done, 1)
    batch = batch_trials.start(tmp_path / "a", tmp_path / "b", "--workers", 1)
    worker = batch_trials.wait_for(lambda: batch_trials.holder(tmp_path / "b" / "T00"))
    batch.send_signal(signal.SIGINT)
    printed, told = batch.communicate(timeout=60)
    assert batch.returncode == 130, told
    assert batch_trials.hashes(printed) == {str(tmp_path / "a" / "T00"): truth}
    assert "1 of 3 done, 0 failed" in told
    assert "Cancelled" in told
    assert "Traceback" not in told
    assert not batch_trials.alive(worker)
    assert batch_trials.holder(tmp_path / "b" / "T00") is None


def test_failures_are_listed_with_their_remedy_and_stop_nobody(done, truth, tmp_path, capsys):
    good, typo, lost = batch_trials.season(tmp_path, done, 3)
    (typo / "trial.toml").write_text("[markers]\nsizes_mm = 3\n")
    (lost / "left.nut").unlink()
    code = main(["batch", str(tmp_path), "--workers", "1"])
    printed, told = capsys.readouterr()
    assert code == 1
    assert batch_trials.hashes(printed) == {good.name: truth}
    listed = told.split("1 of 3 done, 2 failed")[1]
    assert "T01 failed" in listed
    assert "did you mean 'size_mm'" in listed
    assert "T02 failed" in listed
    assert "left.nut is missing" in listed
    assert "Put the file back" in listed


def test_json_tells_everything_and_warnings_alone_give_3(done, truth, tmp_path, capsys):
    batch_trials.season(tmp_path, done, 1)
    assert main(["batch", "-q", str(tmp_path), "--json"]) == 3
    printed, told = capsys.readouterr()
    (row,) = json.loads(printed)["trials"]
    assert (row["trial"], row["state"], row["hash"]) == ("T00", "done", truth)
    assert row["ran"] == ["report"]
    assert row["error"] is None
    assert row["warnings"][0]["code"] == "offset-unknown"
    assert told == ""


def test_a_trial_that_somebody_is_at_is_not_touched(done, tmp_path, capsys):
    (trial,) = batch_trials.season(tmp_path, done, 1)
    with alone_in(trial, PRIVATE):
        assert main(["batch", str(trial), "--workers", "1"]) == 1
    printed, told = capsys.readouterr()
    assert printed == ""
    assert "is being worked on by process" in told
    assert "Wait until it has ended" in told


def test_wrong_use(tmp_path, done, capsys):
    assert main(["batch", str(tmp_path / "never")]) == 2
    assert main(["batch", str(done), "--workers", "0"]) == 2
    assert main(["batch", str(done), "--scheduler", "far:8786"]) == 2
    assert "not encrypted" in capsys.readouterr().err
    with pytest.raises(UsageError, match="no number of workers"):
        next(measure_here([done], -1))


def test_workers_that_cannot_start_are_told_with_what_they_said(done, monkeypatch):
    monkeypatch.setenv("PYTHONHOME", "/nowhere")
    with pytest.raises(InputError, match="end before they begin") as caught:
        list(measure_here([done], 1))
    assert "ended with code 1" in caught.value.why
    assert "doctor" in caught.value.remedy
