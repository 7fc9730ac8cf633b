"""The page of one trial: complete, self-contained, harmless whatever was typed, always the same."""

from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
import report_scene as scene

from olivevib.errors import Caution
from olivevib.report.content import ReportContent
from olivevib.report.page import SECTIONS, render_page
from olivevib.trial.records.calibration import CalibrationRecord
from olivevib.vibration import LineStatus

VOID = {"meta", "br", "link", "img", "hr"}
HOSTILE = (
    "<script>alert(1)</script><img src=x onerror=alert(1)>\x1b[31m\u202egnp.exe\u2066\u0000"
    "\ufeff$\\foo$[/nope]{{ 7*7 }}{% raw %}]]>\"'&amp;"
)


class Reader(HTMLParser):
    """Collects tags, attributes and visible text, and checks that tags close in order."""

    def __init__(self, page: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text: list[str] = []
        self.feed(page)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if not set(self.open) & {"style", "script"}:
            self.text.append(data)

    @property
    def visible(self) -> str:
        return " ".join(" ".join(self.text).split())


@pytest.fixture(scope="module")
def direct() -> str:
    return render_page(scene.content())


@pytest.fixture(scope="module")
def ambiguous() -> str:
    return render_page(scene.content([1, 2, 17], LineStatus.AMBIGUOUS, simulated=True))


def test_page_is_well_formed_and_has_every_section_and_figure(direct):
    reader = Reader(direct)
    assert reader.open == []
    ids = [attrs["id"] for _, attrs in reader.tags if "id" in attrs]
    assert len(ids) == len(set(ids))
    assert {s.name for s in SECTIONS} <= set(ids)
    assert "Not in this report" not in direct
    figures = [attrs for tag, attrs in reader.tags if tag == "svg"]
    assert len(figures) == 21
    assert all(attrs["aria-label"] and attrs["viewbox"] for attrs in figures)
    assert sum(tag == "figcaption" for tag, _ in reader.tags) == len(figures)


def test_every_reference_in_a_figure_stays_inside_it(direct):
    for svg in re.findall(r"<svg.*?</svg>", direct, flags=re.S):
        used = set(re.findall(r'(?:url\(#|href="#)([^")]+)', svg))
        assert used == set(re.findall(r' id="([^"]+)"', svg))


def test_page_asks_nothing_of_the_network(direct):
    without_names = re.sub(r'xmlns(:\w+)?="[^"]*"|"data:image/png;base64,[^"]*"', "", direct)
    assert not re.search(r"(https?:)?//\w", without_names)
    assert "default-src 'none'" in direct
    tags = {tag for tag, _ in Reader(direct).tags}
    assert not tags & {"script", "link", "iframe", "object", "embed", "form", "base"}


def test_nothing_unknown_is_printed_as_code(direct, ambiguous):
    for page in (direct, ambiguous):
        text = Reader(page).visible
        assert not re.search(r"\b(nan|NaN|None|null|inf|undefined|array)\b", text)
        assert "not known" in text


def test_page_fits_in_three_megabytes(direct):
    assert len(direct.encode()) < 3_000_000


def test_same_content_gives_same_bytes(ambiguous):
    again = render_page(scene.content([1, 2, 17], LineStatus.AMBIGUOUS, simulated=True))
    assert again == ambiguous


def test_a_frequency_never_stands_without_its_status(direct):
    text = Reader(direct).visible
    found = list(re.finditer(r"12\.0030[ \u00a0]±[ \u00a0]0\.0017[ \u00a0]Hz", text))
    assert found
    assert all("direct" in text[one.end() : one.end() + 12] for one in found)


def test_an_ambiguous_line_shows_candidates_and_what_each_would_mean(ambiguous):
    text = Reader(ambiguous).visible
    assert "5.00 or 25.00 or 35.00 Hz" in text
    assert "if 25.00 Hz" in text
    assert "(50%)" in text
    assert "5.0000" not in text  # no bare frequency


def test_verdict_is_three_sentences_before_everything_else(direct):
    head = direct[direct.index('class="verdict"') : direct.index("<nav")]
    first = head[: head.index("</section>")]
    assert first.count("<p>") == 3
    assert "8\u00a0markers were located in space" in first
    assert "0.35\u00a0mm (0.38\u00a0%)" in first
    assert "camera and accelerometer agree" in first


def test_warnings_come_with_remedies(direct):
    text = Reader(direct).visible
    assert "1 warning The right camera's row time is not known." in text
    assert "olivevib rowtime FILE --led HZ" in text


def test_simulated_trials_say_so(direct, ambiguous):
    assert "This trial is simulated" in ambiguous
    assert "This trial is simulated" not in direct


def test_numbers_of_the_rig_carry_sigma_and_unit(direct):
    text = Reader(direct).visible.replace("\u00a0", " ")
    expected = (
        "421.91 ± 0.13 mm", "990.0 ± 2.1 px", "9.120 ± 0.050 ms", "27.80 ± 0.40 µs",
        "1.0026 ± 0.0018", "trunk diameter 182 mm", "not known, taken as 0 s",
    )  # fmt: skip
    for words in expected:
        assert words in text, words


def test_hostile_text_is_shown_as_text_or_not_at_all():
    long = "x" * 10_000
    page = render_page(
        scene.content(
            [1, 2],
            seconds=4.0,
            name=HOSTILE,
            places={1: HOSTILE, 2: long},
            record={"session": {"place": HOSTILE, "notes": long, HOSTILE: HOSTILE}},
            cautions=(Caution(HOSTILE, HOSTILE, HOSTILE),),
            provenance={"command": HOSTILE, HOSTILE: long},
            recordings={"left": {"video": HOSTILE, "codec": long}},
            calibration=CalibrationRecord(
                "board", HOSTILE, verdict=HOSTILE, facts={HOSTILE: HOSTILE}
            ),
        )
    )
    reader = Reader(page)
    assert reader.open == []
    assert not {"script", "img"} & {tag for tag, _ in reader.tags}
    assert not any(key.startswith("on") for _, attrs in reader.tags for key in attrs)
    assert not re.search("[\x00-\x08\x0b-\x1f\x7f\u200b-\u200f\u202a-\u202e\u2066-\u2069]", page)
    assert "{{ 7*7 }}" in reader.visible
    assert "x" * 400 not in page


def test_an_empty_trial_says_what_is_missing():
    page = render_page(ReportContent("T00"))
    reader = Reader(page)
    assert reader.open == []
    text = reader.visible
    assert "No marker has been located in space yet." in text
    assert "How well the calibration measures distances is not known" in text
    assert "Not in this report" in text
    assert text.count("found nothing to show") == 11
    assert "<svg" not in page
    assert not re.search(r"\b(nan|None)\b", text)


def test_a_trial_with_only_a_rig_shows_the_rig():
    page = render_page(ReportContent("T01", rig=scene.rig()))
    assert page.count("<svg") == 1
    assert "421.91" in page


def test_tick_counts_the_figures_and_can_cancel():
    seen = []
    render_page(
        scene.content([1, 17], seconds=4.0),
        lambda done, total, note: seen.append((done, total, note)),
    )
    assert [done for done, _, _ in seen] == list(range(len(seen)))
    assert seen[-1][0] == seen[-1][1]

    class Stop(Exception):
        pass

    def stop(done, total, note):
        raise Stop

    with pytest.raises(Stop):
        render_page(scene.content([1, 17], seconds=4.0), stop)


def test_markers_never_seen_are_listed_but_not_drawn():
    content = scene.content([1, 2, 3], seconds=4.0)
    path = content.trajectory
    xyz = path.xyz_mm.copy()
    xyz[:, 1] = np.nan
    page = render_page(replace(content, trajectory=replace(path, xyz_mm=xyz)))
    assert Reader(page).open == []
    assert not re.search(r"\b(nan|None)\b", Reader(page).visible)


@pytest.mark.slow
def test_ten_minutes_of_twelve_markers_still_fit():
    page = render_page(scene.content(list(range(1, 13)), seconds=600.0))
    assert len(page.encode()) < 3_000_000
