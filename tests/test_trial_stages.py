"""States of stages computed from content: done, stale, missing, failed, blocked, skipped."""

import pytest

from olivevib.errors import InputError
from olivevib.files.store import StageFile, write_stage
from olivevib.trial.stages import (
    STAGES,
    Fingerprint,
    StageState,
    stage_states,
    write_failure,
)

PRINTS = {s.name: Fingerprint({"in": s.name}, {"a": 1, "b": [1, 2]}) for s in STAGES}


def write(folder, name, print_=None, schema=None):
    stage = next(s for s in STAGES if s.name == name)
    print_ = print_ or PRINTS[name]
    schema = stage.schema if schema is None else schema
    file = StageFile(stage.name, schema, dict(print_.settings), dict(print_.inputs), {}, {})
    write_stage(folder / stage.file, file)


def states(folder, prints=PRINTS, wanting=None) -> dict[str, StageState]:
    return stage_states(folder, lambda stage: prints[stage.name], wanting or {})


def words(folder, **more) -> dict[str, str]:
    return {name: s.state.value for name, s in states(folder, **more).items()}


def test_a_fresh_trial_is_missing_and_blocked(tmp_path):
    assert words(tmp_path) == {
        "calibrate": "missing",
        "track": "missing",
        "reconstruct": "blocked",
        "analyse": "blocked",
        "compare": "blocked",
    }


def test_everything_written_is_done(tmp_path):
    for stage in STAGES:
        write(tmp_path, stage.name)
    assert set(words(tmp_path).values()) == {"done"}


def test_a_changed_input_makes_it_and_what_rests_on_it_stale(tmp_path):
    for stage in STAGES:
        write(tmp_path, stage.name)
    changed = {**PRINTS, "track": Fingerprint({"in": "other"}, PRINTS["track"].settings)}
    found = states(tmp_path, prints=changed)
    assert found["track"].state == "stale"
    assert found["track"].reason == "in changed"
    assert found["reconstruct"].reason == "track is stale"
    assert found["analyse"].state == "stale"
    assert found["calibrate"].state == "done"


def test_a_changed_setting_is_named(tmp_path):
    write(tmp_path, "track")
    changed = {**PRINTS, "track": Fingerprint({"in": "track"}, {"a": 2, "b": [1, 2]})}
    assert states(tmp_path, prints=changed)["track"].reason == "the setting a changed"


def test_a_damaged_or_older_file_is_stale(tmp_path):
    write(tmp_path, "track", schema=0)
    assert "another version" in states(tmp_path)["track"].reason
    (tmp_path / "tracks.h5").write_bytes(b"no hdf5 at all")
    assert states(tmp_path)["track"].state == "stale"


def test_a_failure_counts_until_its_cause_changes(tmp_path):
    write_failure(tmp_path, STAGES[1], PRINTS["track"], InputError("no markers", "dark", "light"))
    assert states(tmp_path)["track"] == StageState("failed", "no markers")
    changed = {**PRINTS, "track": Fingerprint({"in": "better video"}, {})}
    assert states(tmp_path, prints=changed)["track"].state == "missing"


def test_skipped_blocks_what_needs_it(tmp_path):
    found = states(tmp_path, wanting={"calibrate": "no rig"})
    assert found["calibrate"] == StageState("skipped", "no rig")
    assert found["reconstruct"] == StageState("blocked", "calibrate is skipped")


def test_an_unreadable_input_blocks_with_its_name(tmp_path):
    def failing(stage):
        raise InputError("left.mkv is missing.")

    found = stage_states(tmp_path, failing, {})
    assert found["track"] == StageState("blocked", "left.mkv is missing.")


@pytest.mark.parametrize("stage", STAGES)
def test_every_stage_needs_only_earlier_ones(stage):
    order = [s.name for s in STAGES]
    assert all(order.index(n) < order.index(stage.name) for n in stage.needs)
