"""Marker libraries: proven distances, repeatable search, readable files, faults all at once."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from olivevib.errors import InputError, UsageError
from olivevib.marker import (
    MarkerLayout,
    MarkerLibrary,
    check_library,
    generate_library,
    library_text,
    load_library,
    parse_library,
    shipped_libraries,
    shipped_text,
)
from olivevib.marker.distances import distance, distance_table, pack

CODES = arrays(np.bool_, (3, 7, 7))


def naive_distance(a: np.ndarray, b: np.ndarray, mirrors: bool) -> int:
    views = [np.rot90(b, k) for k in range(4)]
    if mirrors:
        views = [np.rot90(np.fliplr(b), k) for k in range(4)]
    return min(int((a != view).sum()) for view in views)


def test_olive49_keeps_its_promise():
    library = load_library("olive49")
    check = check_library(library)
    assert check.sound
    assert check.codes >= 64
    assert min(check.rotation, check.pair, check.mirror) >= 18 == library.distance
    dark = library.codes.sum(axis=(1, 2))
    assert dark.min() >= 18
    assert dark.max() <= 31
    codes = library.codes
    changes = (codes[:, 1:] != codes[:, :-1]).sum((1, 2))
    changes += (codes[:, :, 1:] != codes[:, :, :-1]).sum((1, 2))
    assert changes.min() >= 30


def test_olive49_by_counting_modules_one_by_one():
    library = load_library()
    codes = library.codes[:12]
    for m, a in enumerate(codes):
        own = min(int((a != np.rot90(a, k)).sum()) for k in (1, 2, 3))
        assert own >= 18
        for n, b in enumerate(codes):
            assert m == n or naive_distance(a, b, mirrors=False) >= 18
            assert naive_distance(a, b, mirrors=True) >= 18


def test_shipped_file_is_what_the_search_with_its_seed_finds():
    library = load_library()
    again = generate_library(18, mirrors=True, seed=3, budget=400_000)
    count = len(again.ids)
    assert count > 30
    assert np.array_equal(library.codes[:count], again.codes)
    assert shipped_text("olive49") == library_text(
        library, "Made by: olivevib markers generate --distance 18 --mirrors --seed 3"
    )


def test_a_changed_module_is_found_by_check():
    library = load_library()
    codes = library.codes.copy()
    codes[5] = np.rot90(library.codes[2])
    codes[5, 0, :4] ^= True
    check = check_library(MarkerLibrary("x", library.ids, codes, library.layout, 18, mirrors=True))
    assert not check.sound
    close = min(check.too_close, key=lambda pair: pair.distance)
    assert (close.id, close.other, close.distance) == (3, 6, 4)
    assert "turned" in str(close)


def test_a_mirror_image_counts_only_where_it_is_promised():
    codes = load_library().codes[:3].copy()
    codes[2] = np.fliplr(codes[0])
    kept = [
        check_library(MarkerLibrary("x", np.arange(3), codes, MarkerLayout(), 18, mirrors=mirrors))
        for mirrors in (False, True)
    ]
    assert kept[0].sound
    assert kept[0].mirror == 0
    assert not kept[1].sound
    assert "mirrored" in str(kept[1].too_close[0])


@settings(deadline=None, max_examples=30)
@given(CODES)
def test_distances_agree_with_counting(codes):
    table = distance_table(codes)
    for m in range(3):
        for n in range(3):
            assert table[:4, m, n].min() == naive_distance(codes[m], codes[n], mirrors=False)
            assert table[4:, m, n].min() == naive_distance(codes[m], codes[n], mirrors=True)


def test_packing_holds_for_areas_above_64_modules():
    rng = np.random.default_rng(1)
    codes = rng.integers(0, 2, (20, 9, 9)).astype(bool)
    words = pack(codes)
    assert words.shape == (20, 2)
    want = (codes[:, None] != codes[None]).sum(axis=(2, 3))
    assert np.array_equal(distance(words[:, None], words[None]), want)


@pytest.mark.parametrize("mirrors", [False, True])
def test_search_is_repeatable_and_keeps_distance(mirrors):
    made = [generate_library(16, mirrors, seed=5, budget=200_000) for _ in range(2)]
    assert np.array_equal(made[0].codes, made[1].codes)
    check = check_library(made[0])
    assert check.sound
    assert check.codes > 60
    assert min(check.rotation, check.pair) >= 16
    assert (check.mirror >= 16) == mirrors


def test_a_finer_layout_of_9_by_9():
    layout = MarkerLayout(modules=13, code=9, bar=9)
    library = generate_library(30, mirrors=True, seed=1, layout=layout, budget=200_000)
    assert check_library(library).sound
    assert len(library.ids) > 10
    assert layout.pattern(library.codes[0]).shape == (13, 13)
    back = parse_library(library_text(library), "nine.toml")
    assert np.array_equal(back.codes, library.codes)
    assert back.layout == layout


def test_impossible_search_says_so():
    with pytest.raises(UsageError, match="distance"):
        generate_library(60, mirrors=True, seed=1, budget=1000)
    with pytest.raises(UsageError, match="No code"):
        generate_library(40, mirrors=True, seed=1, budget=1000)


@settings(deadline=None, max_examples=20)
@given(arrays(np.bool_, (4, 7, 7)), st.booleans())
def test_text_round_trip(codes, mirrors):
    table = distance_table(codes)
    table[0][np.diag_indices(4)] = 49
    promise = int(table[: 8 if mirrors else 4].min())
    if promise < 1:
        return
    ids = np.array([7, 3, 900, 12])
    library = MarkerLibrary("drawn", ids, codes, MarkerLayout(), promise, mirrors=mirrors)
    back = parse_library(library_text(library), "drawn.toml")
    assert np.array_equal(back.ids, library.ids)
    assert np.array_equal(back.codes, library.codes)
    assert (back.name, back.distance, back.mirrors) == ("drawn", promise, mirrors)


def test_every_fault_is_told_at_once(tmp_path):
    lines = shipped_text("olive49").splitlines()
    text = "\n".join(lines[: lines.index("4 = '''")])
    text = text.replace("mirrors = true", "miror = true").replace("quiet = 2", "quiet = 0")
    first = text.split("1 = '''\n")[1].split("'''")[0]
    turned = "\n".join("".join(row) for row in np.rot90([list(r) for r in first.split()]))
    text += f"80 = '''\n{turned}'''\n81 = '''\n#######\n###x###\n##'''\nabc = 5\n"
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        load_library(str(path))
    said = str(caught.value)
    assert "mine.toml" in said
    assert "did you mean mirrors" in said
    assert "quiet" in said
    assert "code 1 and code 80 turned by" in said
    assert "differ in 0 modules" in said
    assert "codes.81: has 3 rows, wants 7" in said
    assert "codes.81: row 2 (###x###) holds x" in said
    assert "codes.81: row 3 (##) has 2 modules" in said
    assert "codes.abc" in said


@pytest.mark.parametrize(
    ("text", "word"),
    [("codes = [", "not TOML"), ("", "distance is missing"), ("distance = 0\ncodes = 1", "codes")],
)
def test_broken_files_are_input_errors(text, word):
    with pytest.raises(InputError, match=word):
        parse_library(text, "broken.toml")


def test_a_missing_file_and_a_wrong_name(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        load_library(str(tmp_path / "none.toml"))
    with pytest.raises(UsageError, match="Did you mean olive49"):
        load_library("oliv49")
    assert "olive49" in shipped_libraries()


def test_a_code_added_by_hand_is_loaded(tmp_path):
    extra = generate_library(18, mirrors=True, seed=3, budget=20_000, name="few")
    text = library_text(extra)
    other = load_library().only((60,))
    block = library_text(other).split("[codes]\n")[1].replace("60 =", "500 =")
    path = tmp_path / "mine.toml"
    path.write_text(text + block)
    library = load_library(str(path))
    assert library.ids[-1] == 500
    assert np.array_equal(library.code(500), other.codes[0])


@pytest.mark.parametrize(
    ("name", "count", "side"),
    [("aruco:DICT_4X4_1000", 1000, 6), ("apriltag:36h11", 587, 8), ("aruco:DICT_5X5_50", 50, 7)],
)
def test_foreign_families(name, count, side):
    library = load_library(name)
    assert len(library.ids) == count
    assert library.codes.shape == (count, 0, 0)
    assert library.layout.modules == side
    assert library.layout.framed
    assert np.array_equal(library.layout.cornerstones[0], [-side / 2, -side / 2])
    assert check_library(library).sound


@pytest.mark.parametrize("name", ["aruco:DICT_9X9_1", "apriltag:99h1", "aruco:APRILTAG_36h11"])
def test_unknown_foreign_family(name):
    with pytest.raises(UsageError, match="OpenCV knows"):
        load_library(name)


def test_layout_refuses_what_does_not_fit():
    for wrong in ({"code": 8}, {"bar": 9, "code": 7, "modules": 11}, {"quiet": 0}, {"code": 9}):
        with pytest.raises(ValueError, match=r"fit|quiet"):
            MarkerLayout(**wrong)


def test_only_keeps_codes_with_their_ids():
    library = load_library()
    few = library.only((7, 2))
    assert few.ids.tolist() == [7, 2]
    assert np.array_equal(few.codes[0], library.code(7))
    assert few.mirrors
    with pytest.raises(KeyError):
        library.only((99999,))
