"""Two looks of our own, dark and sunlight, and the plot styles of whatever theme is on."""

from __future__ import annotations

from rich.style import Style
from textual.color import Color
from textual.theme import Theme

from olivevib.tui.views.palette import Palette

DARK = "olive-dark"
SUNLIGHT = "sunlight"
ANSI = "ansi-dark"  # for terminals without many colours

THEMES = (
    Theme(
        name=DARK,
        primary="#8fb339",
        secondary="#5c7a29",
        accent="#e9c46a",
        warning="#f4a261",
        error="#e76f51",
        success="#90be6d",
        foreground="#e8e6df",
        background="#14160f",
        surface="#1b1e15",
        panel="#262a1e",
    ),
    Theme(
        name=SUNLIGHT,
        primary="#1f4d00",
        secondary="#003b6f",
        accent="#7a0099",
        warning="#8a3b00",
        error="#b00000",
        success="#005a1e",
        foreground="#000000",
        background="#ffffff",
        surface="#ffffff",
        panel="#e6e6e6",
        dark=False,
        text_alpha=1.0,
    ),
)


def palette_of(theme: Theme) -> Palette:
    """The plot styles of a theme."""
    text = _style(theme.foreground)
    warn, good = _style(theme.warning), _style(theme.success)
    return Palette(
        text=text,
        muted=_muted(theme),
        accent=_style(theme.accent) + Style(bold=True),
        good=good,
        warn=warn,
        bad=_style(theme.error) + Style(bold=True),
        axes=(_style(theme.primary), _style(theme.accent), _style(theme.secondary or theme.accent)),
    )


def _style(color: str | None) -> Style:
    return Style(color=Color.parse(color).rich_color) if color else Style()


def _muted(theme: Theme) -> Style:
    if theme.ansi or not (theme.foreground and theme.background):
        return Style(dim=True)
    fore, back = Color.parse(theme.foreground), Color.parse(theme.background)
    return Style(color=fore.blend(back, 0.35).rich_color)
