"""The six parameters of the paper (and the detector's mode) as rows that can be tried."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from rich.text import Text

from olivevib.errors import UsageError
from olivevib.tui.views.palette import Palette

if TYPE_CHECKING:
    from olivevib.detection import DetectionSettings


@dataclass(frozen=True)
class Parameter:
    """One parameter: its name in trial.toml, the paper's sign, a step of + and -, its meaning."""

    name: str
    sign: str
    step: float
    means: str


PARAMETERS = (
    Parameter("fill", "Δfill", 0.05, "least share of its rectangle that a bar fills"),
    Parameter("pos", "Δpos", 0.1, "largest distance of two bars, in bar lengths"),
    Parameter("angle_deg", "Δangle", 1.0, "smallest angle between neighbouring bars, °"),
    Parameter("conf", "Δconf", 1 / 49, "largest share of unmatched modules"),
    Parameter("scale", "Δscale", 0.1, "search rectangle over the last box"),
    Parameter("marker", "Δmarker", 1, "markers a frame must show; 0: all seen so far"),
    Parameter("mode", "detector", 0, "default, or paper: as printed in 2011"),
)
COLUMNS = ("parameter", "value", "meaning")


def parameter_rows(settings: DetectionSettings, palette: Palette) -> list[tuple[Text, Text, Text]]:
    """Cells: name with the paper's sign, value, meaning; muted where the mode does not use it."""
    paper = settings.mode == "paper"
    rows = []
    for parameter in PARAMETERS:
        unused = parameter.name in ("fill", "pos", "angle_deg", "conf") and not paper
        style = palette.muted if unused else palette.text
        value = getattr(settings, parameter.name)
        shown = f"{value:.4g}" if isinstance(value, float) else f"{value}"
        means = f"{parameter.means}{' (paper only)' if unused else ''}"
        rows.append(
            (
                Text(f"{parameter.sign} {parameter.name}", style),
                Text(shown, style),
                Text(means, style),
            )
        )
    return rows


def stepped(settings: DetectionSettings, number: int, step: int) -> DetectionSettings:
    """The settings with one parameter a step up or down; at the end of its range it stays."""
    parameter = PARAMETERS[number]
    if parameter.name == "mode":
        return replace(settings, mode="default" if settings.mode == "paper" else "paper")
    value = getattr(settings, parameter.name) + step * parameter.step
    value = round(value) if parameter.name == "marker" else round(value, 6)
    try:
        return _with(settings, {parameter.name: value})
    except UsageError:
        return settings


def typed_parameter(settings: DetectionSettings, number: int, text: str) -> DetectionSettings:
    """The settings with one parameter as it was typed; UsageError where it cannot be."""
    name, said = PARAMETERS[number].name, text.strip().replace(",", ".")
    if name == "mode":
        return _with(settings, {name: said})
    try:
        return _with(settings, {name: int(said) if name == "marker" else float(said)})
    except ValueError:
        raise UsageError(f"{text!r} is no number.", "", "Write e.g. 0.6.") from None


def _with(settings: DetectionSettings, change: Mapping[str, Any]) -> DetectionSettings:
    try:
        return replace(settings, **change)
    except ValueError as error:
        raise UsageError(f"{error}.", "", "Choose a value inside the range.") from error


def changes_of(settings: DetectionSettings) -> dict[str, Any]:
    """The parameters as dotted settings of trial.toml."""
    return {f"detection.{p.name}": getattr(settings, p.name) for p in PARAMETERS}
