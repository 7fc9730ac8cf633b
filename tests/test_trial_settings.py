"""trial.toml: all faults at once with the nearest key, comments kept, states from content."""

import pytest

from olivevib.errors import InputError, UsageError
from olivevib.trial.document import change_settings, read_settings
from olivevib.trial.settings import TrialSettings

GOOD = """\
# a morning in November
[session]
date = 2026-11-20
place = "Bari"   # the old grove

[markers]
library = "aruco:DICT_4X4_50"
size_mm = 70.0

[[markers.marker]]
id = 3
place = "trunk"
size_mm = 90

[cameras]
shutter = "rolling"
[cameras.left]
video = "left.mkv"
row_time_us = 27.8
[cameras.right]
video = "right.mkv"
"""


def trial(tmp_path, text=GOOD):
    (tmp_path / "trial.toml").write_text(text, encoding="utf-8")
    return tmp_path


def test_reads_what_a_person_wrote(tmp_path):
    settings = read_settings(trial(tmp_path))
    assert settings.markers.size_of(3) == 90
    assert settings.markers.size_of(4) == 70
    assert settings.markers.place_of(3) == "trunk"
    assert settings.cameras.row_time_s("left")[0] == pytest.approx(27.8e-6)
    assert settings.cameras.row_time_s("right")[2] == "unknown"


def test_all_faults_are_told_at_once_with_the_nearest_key(tmp_path):
    text = GOOD.replace("size_mm = 70.0", "sise_mm = 70.0").replace('"trunk"', '"truk"')
    text = text.replace("row_time_us = 27.8", 'row_time_us = "fast"')
    text += "[detection]\nfil = 0.7\n"
    with pytest.raises(InputError) as caught:
        read_settings(trial(tmp_path, text))
    told = str(caught.value)
    assert "4 fault(s)" in told
    for words in (
        "markers.sise_mm: there is no such key; did you mean 'size_mm'?",
        "markers.marker.0.place",
        "cameras.left.row_time_us",
        "detection.fil: there is no such key; did you mean 'fill'?",
    ):
        assert words in told
    assert "Correct the file" in told


def test_a_value_out_of_range_names_the_rule(tmp_path):
    with pytest.raises(InputError, match="fill must lie in"):
        read_settings(trial(tmp_path, GOOD + "[detection]\nfill = 7\n"))


@pytest.mark.parametrize("text", ["[session\n", "a = 'x", "\x00"])
def test_what_is_no_toml_is_told_with_its_place(tmp_path, text):
    with pytest.raises(InputError, match="cannot be read"):
        read_settings(trial(tmp_path, text))


def test_bytes_that_are_no_text(tmp_path):
    (tmp_path / "trial.toml").write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(InputError, match="cannot be read"):
        read_settings(tmp_path)


def test_a_folder_without_trial_says_how_to_make_one(tmp_path):
    with pytest.raises(InputError, match="olivevib new"):
        read_settings(tmp_path)


def test_comments_survive_a_change(tmp_path):
    folder = trial(tmp_path)
    settings = change_settings(folder, {"detection.fill": 0.7, "markers.size_mm": 71.5})
    assert settings.detection.fill == 0.7
    text = (folder / "trial.toml").read_text(encoding="utf-8")
    assert "# a morning in November" in text
    assert "# the old grove" in text
    assert read_settings(folder) == settings
    assert change_settings(folder, {"detection.fill": None}).detection.fill == 0.6


def test_a_wrong_change_changes_nothing(tmp_path):
    folder = trial(tmp_path)
    before = (folder / "trial.toml").read_bytes()
    with pytest.raises(UsageError, match="did you mean 'fill'"):
        change_settings(folder, {"detection.filll": 0.7})
    with pytest.raises(UsageError, match="not a table"):
        change_settings(folder, {"session.place.x": 1})
    assert (folder / "trial.toml").read_bytes() == before


def test_an_empty_trial_has_the_house_defaults():
    settings = TrialSettings()
    assert settings.markers.library == "olive49"
    assert settings.vibration.band_hz is None
    assert settings.cameras.shutter == "unknown"
