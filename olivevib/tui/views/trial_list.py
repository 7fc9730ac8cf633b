"""The trial list: columns for the width there is, cells, search, words."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rich.text import Text

from olivevib.tui.harmless import harmless, plain
from olivevib.tui.loader import TrialRow
from olivevib.tui.views.palette import Palette
from olivevib.tui.views.tables import quality_cell, state_cell

WIDE = 100  # columns from which states are written out
SHORT = {"calibrate": "cal", "track": "trk", "reconstruct": "rec", "analyse": "ana"}


def columns_of(width: int, stages: Sequence[str]) -> tuple[str, ...]:
    """Headings of the table."""
    if width >= WIDE:
        return ("trial", "quality", *stages, "about")
    return ("trial", "quality", *(SHORT.get(s, "cmp") for s in stages))


def trial_cells(row: TrialRow, width: int, palette: Palette) -> tuple[Text, ...]:
    """One trial as cells, as many as there are columns."""
    wide = width >= WIDE
    states = [s.state for s in row.stages] or ["…"] * 5
    cells = [
        plain(row.name, 28 if wide else 34),
        quality_cell(row.word, palette),
        *(state_cell(s, palette, word=wide) for s in states),
    ]
    if wide:
        about = ("archived  " if row.archived else "") + ("simulated  " if row.simulated else "")
        about += row.about
        cells.append(plain(about, 40, "italic" if row.simulated else ""))
    return tuple(cells)


def matching(rows: Iterable[TrialRow], words: str) -> list[TrialRow]:
    """The trials in which every word stands somewhere: name, place, date, quality."""
    wanted = words.lower().split()

    def fits(row: TrialRow) -> bool:
        archived = "archived" if row.archived else ""
        text = f"{row.name} {row.about} {row.word} {row.notes} {archived}".lower()
        return all(word in text for word in wanted)

    return [row for row in rows if fits(row)]


def why_text(row: TrialRow, palette: Palette) -> Text:
    """Why the marked trial has its quality word, and what each unfinished stage waits for."""
    out = Text()
    out.append(f"{harmless(row.name, 60)} ", palette.accent)
    if row.about:
        out.append(f"{harmless(row.about, 120)} ", palette.muted)
    out.append_text(quality_cell(row.word, palette))
    out.append(f": {harmless(row.why, 300)}")
    if row.notes:
        out.append(f"\n{harmless(row.notes, 160)}", palette.muted)
    for fault in row.faults[:1]:
        for title, part in (("", fault.error.why), ("Next: ", fault.error.remedy)):
            out.append(f"\n{title}{harmless(part, 400)}" if part else "")
    open_ = [s for s in row.stages if s.state not in ("done", "missing")]
    if row.faults:  # the others wait for this one, and it stands above
        open_ = []
    for stage in open_[:3]:
        out.append(f"\n{stage.name} {stage.state}: {harmless(stage.reason, 160)}", palette.muted)
    return out


def empty_text(place: str, is_workspace: bool, palette: Palette) -> Text:
    """What to do first where there is no trial yet, with the keys."""
    out = Text(justify="left")
    out.append("No trials here yet.\n\n", palette.accent)
    out.append(f"{harmless(place, 70)}\n", palette.muted)
    out.append("holds no trial.\n\n" if is_workspace else "is no workspace yet.\n\n")
    for key, words in (
        ("n", "make a trial from two recordings"),
        ("c", "record one with two cameras, or rehearse"),
        ("g", "make a simulated trial, to try everything"),
        ("?", "what this screen shows"),
        ("q", "leave, and start olivevib in another folder"),
    ):
        out.append(f"  {key}  ", palette.accent)
        out.append(f"{words}\n")
    return out
