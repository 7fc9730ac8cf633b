"""Prints at true scale: edges on a 600 dpi raster, white quiet zones, rulers, words."""

from __future__ import annotations

import re
import shutil
import subprocess
from xml.etree import ElementTree

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis.extra.numpy import arrays

from olivevib.calibration.boards import parse_board
from olivevib.errors import InputError, UsageError
from olivevib.files.prints import (
    PAPERS_MM,
    board_page,
    in_words,
    marker_modules,
    marker_picture,
    paper_size,
    pdf_bytes,
    sheet_pages,
    svg_text,
    write_pages,
    write_picture,
)
from olivevib.files.prints.page import outline
from olivevib.marker import load_library

DPI = 600
PX_MM = 25.4 / DPI
LIMIT_MM = 0.02
LIBRARY = load_library()
NUMBER = r"-?\d+(?:\.\d+)?"


def pdf_loops(content: bytes) -> tuple[tuple[float, float], list[np.ndarray]]:
    """Page size and filled loops of the first page in mm, read from the PDF's own operators."""
    text = content.decode("latin-1")
    box = re.search(rf"MediaBox \[0 0 ({NUMBER}) ({NUMBER})\]", text)
    size = (float(box[1]) * 25.4 / 72, float(box[2]) * 25.4 / 72)
    stream = text.split("stream\n")[1].split("\nendstream")[0]
    a, b, c, d, e, f = map(float, re.search(rf"((?:{NUMBER} ){{6}})cm", stream)[1].split())
    loops = []
    for line in stream.splitlines():
        if line.endswith(" h"):
            xy = np.array(re.findall(rf"({NUMBER}) ({NUMBER}) [ml]", line), float)
            points = np.column_stack(
                [a * xy[:, 0] + c * xy[:, 1] + e, b * xy[:, 0] + d * xy[:, 1] + f]
            )
            points *= 25.4 / 72
            points[:, 1] = size[1] - points[:, 1]
            loops.append(points)
    return size, loops


def svg_loops(text: str) -> tuple[tuple[float, float], list[np.ndarray]]:
    root = ElementTree.fromstring(text)
    width, height = (root.get(side) for side in ("width", "height"))
    assert width.endswith("mm")
    box = [float(v) for v in root.get("viewBox").split()]
    scale = float(width[:-2]) / box[2]
    loops = []
    for path in root.iter("{http://www.w3.org/2000/svg}path"):
        for loop in path.get("d").split("Z")[:-1]:
            loops.append(np.array(re.findall(rf"({NUMBER}) ({NUMBER})", loop), float) * scale)
    return (float(width[:-2]), float(height[:-2])), loops


def raster(size_mm: tuple[float, float], loops: list[np.ndarray], box_mm) -> np.ndarray:
    """Ink coverage (rows, columns) at 600 dpi of rectilinear loops within box (x0, y0, x1, y1)."""
    x = np.arange(round(box_mm[0] / PX_MM), round(box_mm[2] / PX_MM))
    y = np.arange(round(box_mm[1] / PX_MM), round(box_mm[3] / PX_MM))
    ink = np.zeros((y.size, x.size))
    for loop in loops:
        for (xa, ya), (xb, yb) in zip(loop, np.roll(loop, -1, axis=0), strict=True):
            if abs(xa - xb) < 1e-9:
                right = np.clip(x + 1 - xa / PX_MM, 0, 1)
                down = np.clip(y + 1 - min(ya, yb) / PX_MM, 0, 1)
                down -= np.clip(y + 1 - max(ya, yb) / PX_MM, 0, 1)
                ink += np.outer(down, right) * np.sign(ya - yb)
    return ink


def edge_errors_mm(ink: np.ndarray, origin_mm, start_mm, module_mm: float, dark) -> np.ndarray:
    """Measured minus nominal of every edge that a scan line through module centres crosses, mm."""
    errors = []
    for turned in (False, True):
        image = ink.T if turned else ink
        first = (start_mm[0] - origin_mm[0], start_mm[1] - origin_mm[1])
        along, across = (first[1], first[0]) if turned else first
        pattern = np.pad(dark.T if turned else dark, ((0, 0), (1, 1))).astype(int)
        for row in range(len(dark)):
            scan = image[round((across + (row + 0.5) * module_mm) / PX_MM)]
            for k in np.flatnonzero(np.diff(pattern[row])):
                nominal = (along + k * module_mm) / PX_MM
                low, high = (
                    int(nominal - 0.4 * module_mm / PX_MM),
                    int(nominal + 0.4 * module_mm / PX_MM),
                )
                darker = pattern[row, k + 1] > pattern[row, k]
                inked = scan[low:high].sum()
                errors.append((high - inked if darker else low + inked) - nominal)
    return np.array(errors) * PX_MM


def first_cell(size_mm: float):
    module = size_mm / 11
    start = 10 + 1 + 2 * module
    return module, (start, start), (10.5, 10.5, 12 + 15 * module, 12 + 15 * module)


@pytest.mark.parametrize("size_mm", [20.0, 44.0, 60.0, 87.3])
@pytest.mark.parametrize("form", ["pdf", "svg"])
def test_edges_on_a_600_dpi_raster(size_mm, form):
    (page, *_) = sheet_pages(LIBRARY, [7, 8, 9], size_mm)
    size, loops = pdf_loops(pdf_bytes([page])) if form == "pdf" else svg_loops(svg_text(page))
    assert size == pytest.approx((210, 297), abs=1e-4)
    module, start, box = first_cell(size_mm)
    origin = (round(box[0] / PX_MM) * PX_MM, round(box[1] / PX_MM) * PX_MM)
    ink = raster(size, loops, box)
    errors = edge_errors_mm(ink, origin, start, module, marker_modules(LIBRARY, 7))
    assert errors.size > 60
    assert np.abs(errors).max() <= LIMIT_MM


def test_the_measurement_of_edges_sees_a_wrong_scale():
    (page,) = sheet_pages(LIBRARY, [7], 60)
    size, loops = pdf_loops(pdf_bytes([page]))
    module, start, box = first_cell(60)
    origin = (round(box[0] / PX_MM) * PX_MM, round(box[1] / PX_MM) * PX_MM)
    ink = raster(size, [loop * 1.001 for loop in loops], box)
    errors = edge_errors_mm(ink, origin, start, module, marker_modules(LIBRARY, 7))
    assert np.abs(errors).max() > LIMIT_MM


def rendered(path, page: int = 1) -> np.ndarray:
    """Page as grey levels at 600 dpi by poppler."""
    out = path.with_suffix("")
    command = ["pdftoppm", "-r", str(DPI), "-gray", "-f", str(page), "-l", str(page), "-singlefile"]
    subprocess.run([*command, str(path), str(out)], check=True)
    return cv2.imread(f"{out}.pgm", cv2.IMREAD_UNCHANGED)


@pytest.mark.skipif(shutil.which("pdftoppm") is None, reason="poppler's pdftoppm is not installed")
@pytest.mark.parametrize("paper", ["A4", "letter"])
def test_edges_and_quiet_zones_as_poppler_prints_them(tmp_path, paper):
    pages = sheet_pages(LIBRARY, [66, 8, 9, 10, 11], 60, paper)
    image = rendered(write_pages(tmp_path / "sheet.pdf", pages)[0])
    width, height = PAPERS_MM[paper]
    assert abs(image.shape[1] * PX_MM - width) < 2 * PX_MM
    assert abs(image.shape[0] * PX_MM - height) < 2 * PX_MM
    module, start, _ = first_cell(60)
    ink = 1 - image / 255.0
    errors = edge_errors_mm(ink, (0, 0), start, module, marker_modules(LIBRARY, 66))
    assert np.abs(errors).max() <= LIMIT_MM
    card = 15 * module
    for column in range(2):  # the quiet zone of both markers of the first row is white
        x = 11 + column * (card + 2)
        box = [round(v / PX_MM) for v in (x, 11, x + card, 11 + card)]
        patch = image[box[1] + 1 : box[3] - 1, box[0] + 1 : box[2] - 1].copy()
        q = int(2 * module / PX_MM) - 2
        patch[q:-q, q:-q] = 255
        assert patch.min() == 255


@pytest.mark.skipif(shutil.which("pdftoppm") is None, reason="poppler's pdftoppm is not installed")
def test_the_ruler_is_150_mm_as_poppler_prints_it(tmp_path):
    pages = sheet_pages(LIBRARY, [1], 60)
    image = rendered(write_pages(tmp_path / "sheet.pdf", pages)[0])
    row = image[round((297 - 14 - 2.7) / PX_MM)]  # below the figures: ticks of 5 mm
    dark = np.flatnonzero(row[: round(165 / PX_MM)] < 160) * PX_MM
    assert dark.min() == pytest.approx(10, abs=0.1)
    assert dark.max() == pytest.approx(160, abs=0.1)
    ticks = dark[np.diff(dark, prepend=0) > 1]
    assert np.allclose(ticks, 10 + 5 * np.arange(31), atol=0.1)


def test_nothing_dark_in_the_quiet_zone_by_geometry():
    for size in (20.0, 60.0):
        (page, *_) = sheet_pages(LIBRARY, list(range(1, 7)), size)
        module = size / 11
        for area in page.areas:
            corners = np.concatenate(area.loops)
            low = corners.min(axis=0) - 2 * module
            high = corners.max(axis=0) + 2 * module
            for line in page.lines:
                ends = np.array([line.start, line.end])
                apart = (ends.max(0) + line.width_mm / 2 < low) | (
                    ends.min(0) - line.width_mm / 2 > high
                )
                assert apart.any()
            for label in page.labels:
                x, y = label.at
                right = x + 0.6 * label.height_mm * len(label.text)
                apart_y = y - label.height_mm >= high[1] - 1 or y + 0.3 * label.height_mm <= low[1]
                assert apart_y or right <= low[0] or x >= high[0]


@settings(deadline=None, max_examples=40)
@given(arrays(np.bool_, (5, 6)))
def test_outlines_enclose_exactly_the_dark_modules(dark):
    area = outline(dark, (0.0, 0.0), 1.0)
    y, x = np.indices(dark.shape) + 0.5
    crossings = np.zeros(dark.shape, int)
    for loop in area.loops:
        for (xa, ya), (xb, yb) in zip(loop, np.roll(loop, -1, axis=0), strict=True):
            if xa == xb:
                crossings += (xa < x) & (min(ya, yb) < y) & (y < max(ya, yb))
    assert np.array_equal(crossings % 2 == 1, dark)


def test_sheet_says_every_id_in_words_and_has_its_ruler_on_every_page():
    ids = list(range(1, 25))
    pages = sheet_pages(LIBRARY, ids, 60)
    said = [label.text for page in pages for label in page.labels]
    for wanted in ids:
        assert f"Marker {wanted} ({in_words(wanted)})" in said
    assert len(pages) > 1
    for page in pages:
        assert any("150 mm" in label.text for label in page.labels)
        assert any(line.end[0] - line.start[0] == 150 for line in page.lines)
        assert any(line.dash_mm for line in page.lines)
    assert sum(len(page.areas) for page in pages) == 24
    keys = [line for line in pages[0].lines if line.dash_mm]
    assert len(keys) == len(set(keys))


def test_pdf_is_repeatable_and_forbids_scaling():
    pages = sheet_pages(LIBRARY, [1, 2], 50)
    content = pdf_bytes(pages, "markers (1)\\")
    assert content == pdf_bytes(sheet_pages(LIBRARY, [1, 2], 50), "markers (1)\\")
    assert b"/PrintScaling /None" in content
    assert b"/Title (markers \\(1\\)\\\\)" in content
    assert b"Date" not in content
    starts = [
        int(row[:10]) for row in content.split(b"xref\n")[1].splitlines()[2:] if row.endswith(b"n ")
    ]
    for number, start in enumerate(starts, 1):
        assert content[start:].startswith(b"%d 0 obj" % number)


def test_hostile_names_stay_text():
    page = sheet_pages(LIBRARY, [1], 50)[0]
    text = svg_text(page, "<script>&\x1b[0m")
    root = ElementTree.fromstring(text)
    assert not list(root.iter("script"))


def test_paper_sizes_and_what_does_not_fit():
    assert paper_size("A4") == (210.0, 297.0)
    assert paper_size("a4-landscape") == (297.0, 210.0)
    assert paper_size("Letter") == (215.9, 279.4)
    with pytest.raises(UsageError, match="A4"):
        paper_size("B52")
    with pytest.raises(UsageError, match="does not fit") as caught:
        sheet_pages(LIBRARY, [1], 200)
    largest = int(re.search(r"--size (\d+)", caught.value.remedy)[1])
    assert len(sheet_pages(LIBRARY, [1], largest)) == 1
    with pytest.raises(UsageError, match="ruler"):
        sheet_pages(LIBRARY, [1], 20, "A5")
    with pytest.raises(UsageError, match="no marker 4000"):
        sheet_pages(LIBRARY, [4000], 20)
    with pytest.raises(UsageError, match="cannot be printed"):
        sheet_pages(LIBRARY, [1], float("nan"))


@pytest.mark.parametrize("name", ["olive49", "aruco:DICT_4X4_50", "apriltag:36h11"])
def test_picture_has_only_two_levels_and_its_quiet_zone(name):
    library = load_library(name)
    wanted = int(library.ids[5])
    picture = marker_picture(library, wanted, 8)
    layout = library.layout
    assert picture.shape == (8 * (layout.modules + 2 * layout.quiet),) * 2
    assert set(np.unique(picture)) == {0, 255}
    q = 8 * layout.quiet
    assert picture[:q].min() == picture[:, -q:].min() == 255
    assert np.array_equal(
        picture[q + 4 : -q : 8, q + 4 : -q : 8] == 0, marker_modules(library, wanted)
    )


@pytest.mark.parametrize("name", ["aruco:DICT_4X4_50", "apriltag:36h11"])
def test_foreign_pictures_are_read_by_opencv(name):
    library = load_library(name)
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, library.dictionary))
    picture = np.pad(marker_picture(library, 3, 8), 30, constant_values=255)
    _, ids, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(picture)
    assert ids.ravel().tolist() == [3]


def board_image(spec: str, paper: str = "A3", px_mm: float = 0.5) -> np.ndarray:
    page = board_page(parse_board(spec), LIBRARY, paper)
    fine = 8
    shape = (int(page.height_mm / px_mm), int(page.width_mm / px_mm))
    ink = np.zeros((shape[0] * fine, shape[1] * fine), np.uint8)
    loops = [
        np.rint(loop / px_mm * fine).astype(np.int32) for area in page.areas for loop in area.loops
    ]
    cv2.fillPoly(ink, loops, 255)
    return 255 - cv2.resize(ink, shape[::-1], interpolation=cv2.INTER_AREA)


@pytest.mark.parametrize("words", ["", ",legacy", ",inverted"])
@pytest.mark.parametrize("rows", [5, 6])
def test_charuco_boards_are_read_by_opencv(words, rows):
    spec = f"charuco:4x{rows},square=50,marker=37.5,dict=DICT_4X4_1000{words}"
    image = board_image(spec)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_1000)
    board = cv2.aruco.CharucoBoard((4, rows), 50, 37.5, dictionary)
    board.setLegacyPattern("legacy" in words)
    image = 255 - image if "inverted" in words else image
    corners, ids, _, _ = cv2.aruco.CharucoDetector(board).detectBoard(image)
    points = parse_board(spec).points_mm
    assert len(ids) == len(points)
    offset = corners.reshape(-1, 2) * 0.5 - points[ids.ravel(), :2]
    assert np.ptp(offset, axis=0).max() < 0.1  # mm: the board's grid, wherever it lies on the page


def test_aruco_grid_is_read_by_opencv():
    spec = "arucogrid:5x7,size=30,gap=8,dict=DICT_6X6_250"
    image = board_image(spec)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_6X6_250)
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(image)
    assert sorted(ids.ravel().tolist()) == list(range(35))
    centres = (
        np.array([c.reshape(4, 2).mean(axis=0) for c in corners])[np.argsort(ids.ravel())] * 0.5
    )
    want = parse_board(spec).points_mm[::5, :2]
    assert np.ptp(centres - want, axis=0).max() < 0.5


def test_chessboard_is_read_by_opencv():
    spec = "chessboard:9x6,square=25"
    found, corners = cv2.findChessboardCorners(board_image(spec), (9, 6))
    assert found
    steps = np.linalg.norm(np.diff(corners.reshape(6, 9, 2), axis=1), axis=2) * 0.5
    assert np.allclose(steps, 25, atol=0.6)


def test_coded_board_places_and_limits():
    board = parse_board("coded:5x4,pitch=50,size=36,first=3")
    page = board_page(board, LIBRARY, "A3")
    assert any("markers 3 (three) to 22 (twenty-two)" in label.text for label in page.labels)
    low = np.concatenate(page.areas[0].loops).min(axis=0)
    high = np.concatenate(page.areas[0].loops).max(axis=0)
    assert high - low == pytest.approx([4 * 50 + 36, 3 * 50 + 36])
    with pytest.raises(UsageError, match="too close"):
        board_page(parse_board("coded:5x4,pitch=40,size=36"), LIBRARY)
    with pytest.raises(UsageError, match="--paper A2"):
        board_page(parse_board("coded:5x5,pitch=70,size=52"), LIBRARY, "A4")
    with pytest.raises(UsageError, match="no marker"):
        board_page(parse_board("coded:9x9,pitch=30,size=20"), LIBRARY)


def test_the_board_of_the_manual_fits_a3_and_says_what_it_lacks():
    board = parse_board("coded:5x5,pitch=60,size=44")
    page = board_page(board, LIBRARY, "A3")
    dark = np.concatenate(page.areas[0].loops)
    assert dark.min() >= 5
    assert dark[:, 0].max() <= 297 - 5
    assert any("white border" in label.text for label in page.labels)
    assert not any(line.dash_mm for line in page.lines)
    assert any(line.dash_mm for line in board_page(board, LIBRARY, "A2").lines)


def test_a_board_that_fits_only_on_its_side_turns_the_paper():
    page = board_page(parse_board("chessboard:14x8,square=24"), None, "A3")
    assert page.width_mm == 420


def test_files_by_their_ending(tmp_path):
    pages = sheet_pages(LIBRARY, list(range(1, 31)), 60)
    names = write_pages(tmp_path / "new" / "sheet.svg", pages)
    assert [name.name for name in names] == [f"sheet-{k}.svg" for k in range(1, len(pages) + 1)]
    picture = marker_picture(LIBRARY, 4, 5)
    path = write_picture(tmp_path / "four.png", picture)
    assert np.array_equal(cv2.imread(str(path), cv2.IMREAD_UNCHANGED), picture)
    with pytest.raises(UsageError, match="PDF or an SVG"):
        write_pages(tmp_path / "sheet.docx", pages)
    with pytest.raises(UsageError, match="PNG"):
        write_picture(tmp_path / "four.jpg", picture)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        write_pages(tmp_path / "file" / "sheet.pdf", pages)


def test_numbers_in_words():
    want = {0: "zero", 12: "twelve", 66: "sixty-six", 100: "one hundred"}
    want |= {619: "six hundred nineteen", 2041: "two thousand forty-one", 30: "thirty"}
    assert {n: in_words(n) for n in want} == want
    assert len({in_words(n) for n in range(3000)}) == 3000
