"""The styles that views draw with; meanings are told by words too, never by colour alone."""

from __future__ import annotations

from dataclasses import dataclass, field

from rich.style import Style


@dataclass(frozen=True)
class Palette:
    """Styles by meaning. ``axes``: x, y and z."""

    text: Style = field(default_factory=Style)
    muted: Style = field(default_factory=lambda: Style(dim=True))
    accent: Style = field(default_factory=lambda: Style(bold=True))
    good: Style = field(default_factory=Style)
    warn: Style = field(default_factory=Style)
    bad: Style = field(default_factory=lambda: Style(bold=True))
    axes: tuple[Style, Style, Style] = field(default_factory=lambda: (Style(), Style(), Style()))
