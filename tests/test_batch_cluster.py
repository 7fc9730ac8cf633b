"""A real Dask scheduler and workers on loopback: the same hashes, also with a worker killed."""

import json
import os
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import batch_trials
import pytest

from olivevib import pipeline
from olivevib.batch import measure_here, measure_on_cluster
from olivevib.batch.contents import read_contents
from olivevib.errors import InputError, UsageError
from olivevib.progress import Cancelled
from olivevib.trial import Trial

pytest.importorskip("distributed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("default"),  # of a package that is not ours
    pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc"),
]


@pytest.fixture(scope="module")
def fresh(tmp_path_factory) -> Path:
    return batch_trials.one(tmp_path_factory.mktemp("ws") / "fresh")


@pytest.fixture(scope="module")
def truth(fresh, tmp_path_factory) -> str:
    (folder,) = batch_trials.season(tmp_path_factory.mktemp("done"), fresh, 1)
    list(pipeline.run(Trial.open(folder)))
    return read_contents(Trial.open(folder))[0]


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory) -> str:
    """The address of a scheduler with two workers of one thread."""
    with cluster(tmp_path_factory.mktemp("dask"), 2) as (address, _):
        yield address


@contextmanager
def cluster(place: Path, workers: int):
    """A scheduler and its workers: its address and its process."""
    told = place / "scheduler.json"
    one = ("--scheduler-file", told)
    head = daemon(place, "dask_scheduler", *one, "--port", 0, "--no-dashboard")
    hands = daemon(place, "dask_worker", *one, "--nworkers", workers, "--nthreads", 1)
    try:
        yield batch_trials.wait_for(lambda: address_in(told)), head.pid
    finally:
        for program in (hands, head):
            program.terminate()
            program.wait(60)


def daemon(place: Path, name: str, *arguments: object) -> subprocess.Popen:
    command = [sys.executable, "-m", f"distributed.cli.{name}", "--host", "127.0.0.1"]
    with (place / f"{name}.log").open("w") as log:
        return subprocess.Popen(
            [*command, *map(str, arguments)],
            cwd=place,
            env=os.environ | {"PYTHONPATH": f"{batch_trials.ROOT}:{os.environ.get('PYTHONPATH')}"},
            stdout=log,
            stderr=log,
        )


def address_in(file: Path) -> str:
    try:
        return json.loads(file.read_text())["address"]
    except (OSError, ValueError):
        return ""


def test_a_cluster_measures_the_same_with_a_worker_killed(fresh, truth, scheduler, tmp_path):
    trials = batch_trials.season(tmp_path, fresh, 5)
    ticks, killed = [], []

    def tick(done, total, note):
        ticks.append((done, total, note))
        victim = batch_trials.holder(trials[1])
        if victim and not killed:
            killed.append(victim)
            batch_trials.kill(victim)

    results = list(measure_on_cluster(trials, scheduler, tick))
    assert killed
    assert sorted(r.folder for r in results) == [str(t) for t in trials]
    assert {r.hash for r in results} == {truth}, [r.what for r in results]
    assert ticks[-1][:2] == (5, 5)
    assert any(" left; 2 at work" in note for _, _, note in ticks)


def test_a_failure_on_the_cluster_is_a_result(fresh, truth, scheduler, tmp_path):
    good, lost = batch_trials.season(tmp_path, fresh, 2)
    (lost / "right.nut").unlink()
    results = {r.folder: r for r in measure_on_cluster([good, lost], scheduler)}
    assert results[str(good)].hash == truth
    assert "right.nut is missing" in results[str(lost)].what


def test_cancelling_withdraws_and_frees_the_trials(fresh, truth, scheduler, tmp_path):
    trials = batch_trials.season(tmp_path, fresh, 4)

    def tick(done, total, note):
        if batch_trials.holder(trials[0]):
            raise Cancelled

    with pytest.raises(Cancelled):
        list(measure_on_cluster(trials, scheduler, tick))
    batch_trials.wait_for(lambda: not any(batch_trials.holder(t) for t in trials), 20)
    assert not (trials[3] / "tracks.h5").exists()
    results = list(measure_here(trials, 2))
    assert {r.hash for r in results} == {truth}


def test_the_command_prints_the_same_lines(fresh, truth, scheduler, tmp_path):
    batch_trials.season(tmp_path, fresh, 2)
    batch = batch_trials.start(tmp_path, "--scheduler", scheduler)
    printed, told = batch.communicate(timeout=120)
    assert batch.returncode == 3, told
    assert batch_trials.hashes(printed) == {"T00": truth, "T01": truth}


def test_a_lost_scheduler_is_one_error_and_what_is_done_is_kept(fresh, truth, tmp_path):
    trials = batch_trials.season(tmp_path / "season", fresh, 3)
    results = []
    with cluster(tmp_path, 1) as (address, head):

        def tick(done, total, note):
            if done == 1 and batch_trials.alive(head):
                batch_trials.kill(head)

        with pytest.raises(InputError, match="the scheduler is gone") as caught:
            results.extend(measure_on_cluster(trials, address, tick))
    assert "run the same command" in caught.value.remedy
    assert results[0].hash == truth
    assert len(results) < 3


def test_where_no_scheduler_answers_it_says_how_to_start_one(tmp_path):
    with pytest.raises(InputError, match="no scheduler answers") as caught:
        next(measure_on_cluster([tmp_path], "tcp://127.0.0.1:9"))
    assert "dask scheduler" in caught.value.remedy


def test_tls_without_certificates_is_explained(tmp_path):
    with pytest.raises(UsageError, match="needs certificates") as caught:
        next(measure_on_cluster([tmp_path], "tls://127.0.0.1:9"))
    assert "ca-file" in caught.value.remedy
