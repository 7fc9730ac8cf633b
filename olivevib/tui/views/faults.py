"""Errors in words, and what stands where a result would be as long as there is none."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rich.style import Style
from rich.text import Text

from olivevib.errors import OlivevibError
from olivevib.tui.harmless import harmless
from olivevib.tui.views.palette import Palette

if TYPE_CHECKING:
    from olivevib.trial.standing import Fault


def error_text(error: OlivevibError | None) -> Text:
    """The three parts of an error as text; lines of a list of faults stay lines."""
    out = Text()
    if error is None:
        return out
    for title, part in (("", error.what), ("", error.why), ("Next: ", error.remedy)):
        if part:
            lines = "\n".join(harmless(line, 400) for line in part.splitlines()[:40])
            out.append(f"{title}{lines}\n\n", "bold" if part is error.what else "")
    out.rstrip()
    return out


def fault_text(fault: Fault, palette: Palette) -> Text:
    """A stage that failed, with what, why and what to do next, a line each."""
    error = fault.error
    out = Text(f"✗ {fault.stage} {fault.state}: ", palette.bad)
    for title, part, style in (
        ("", error.what, palette.text),
        ("", error.why, palette.muted),
        ("Next: ", error.remedy, palette.accent),
    ):
        _append_part(out, title, part, style)
    out.rstrip()
    return out


def _append_part(out: Text, title: str, part: str, style: Style) -> None:
    for line in part.splitlines()[:40]:
        out.append(f"{title}{harmless(line, 400)}\n", style)
        title = ""


def absent(
    summary: Mapping[str, Any], faults: Sequence[Fault], what: str, stage: str
) -> Callable[[tuple[int, int], Palette], Text]:
    """The view of a pane whose ``what`` is not there: what ``stage`` waits for, what to do.

    The text is not cut: it wraps in its pane, whatever its size.
    """
    told = summary["stages"][stage]

    def drawn(size: tuple[int, int], palette: Palette) -> Text:
        out = Text(f"{what}: {stage} is {told['state']}", palette.accent)
        out.append(f" ({harmless(told['reason'], 300)})." if not faults else ".")
        for fault in faults:
            out.append("\n\n")
            out.append_text(fault_text(fault, palette))
        out.append("\n\nEsc, then r runs the stages.", palette.muted)
        return out

    return drawn
