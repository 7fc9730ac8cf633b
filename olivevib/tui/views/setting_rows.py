"""The settings of a trial as rows: dotted key, value as it would be typed, what it means."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from rich.text import Text

from olivevib.tui.harmless import harmless, plain
from olivevib.tui.views.palette import Palette

MEANS = {
    "session.date": "when the trial was recorded",
    "session.notes": "anything worth knowing later",
    "markers.size_mm": "outer side of the dark square, mm",
    "markers.ids": "the markers on the tree, [1, 2, 3]; empty: all of the library",
    "markers.marker": "place of each: [{id = 1, place = 'trunk'}]; trunk, branch, twig, fixed",
    "cameras.shutter": "rolling, global or unknown",
    "cameras.left.row_time_us": "µs from a sensor row to the next, signed",
    "cameras.right.row_time_us": "µs from a sensor row to the next, signed",
    "calibration.board": "the board, e.g. coded:5x5,pitch=60,size=44",
    "calibration.rig": "rig.toml of an earlier calibration, instead of a board",
    "accelerometers": "[{file = 'accelerometer.csv', marker = 1}]",
    "vibration.band_hz": "where the shaker's frequency may lie, [5, 45]",
    "reconstruction.right_offset_ms": "add to the right camera's stamps, where it is known",
    "machine.set_frequency_hz": "as its operator set it; never used by the analysis",
    "detection.fill": "Δfill: least share of its rectangle that a location bar fills",
    "detection.pos": "Δpos: largest distance of two bars, in lengths of the longer one",
    "detection.angle_deg": "Δangle: smallest angle between neighbouring bars, degrees",
    "detection.conf": "Δconf: largest share of unmatched modules of the code area",
    "detection.scale": "Δscale: how much a location rectangle exceeds the last box",
    "detection.marker": "Δmarker: how many markers a frame must show; 0: all seen so far",
    "detection.mode": "which detector reads the markers; paper: as the paper does",
    "detection.paper_centre": "true: the mean of the cornerstones as centre (biased)",
    "outcome.removed_kg": "what the harvest gave",
}


@dataclass(frozen=True)
class SettingRow:
    """One setting: its dotted key, and its value as it would be typed; "" is not set."""

    key: str
    value: str


def setting_rows(settings: Mapping[str, Any]) -> tuple[SettingRow, ...]:
    """Every setting of ``model_dump(mode="json")``, in order."""
    return tuple(_rows("", settings))


def _rows(prefix: str, values: Mapping[str, Any]) -> Iterator[SettingRow]:
    for name, value in values.items():
        key = f"{prefix}{name}"
        if isinstance(value, Mapping):
            yield from _rows(f"{key}.", value)
        else:
            yield SettingRow(key, typed(value))


def typed(value: Any) -> str:
    """A value as it is typed into trial.toml, texts without quotation marks."""
    return value if isinstance(value, str) else "" if value in (None, [], ()) else _toml(value)


def _toml(value: Any) -> str:
    if isinstance(value, list | tuple):
        return f"[{', '.join(_toml(v) for v in value)}]"
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{k} = {_toml(v)}' for k, v in value.items() if v is not None)}}}"
    return json.dumps(value, ensure_ascii=False)


def setting_cells(row: SettingRow, palette: Palette) -> tuple[Text, Text]:
    """Key and value."""
    table, _, name = row.key.rpartition(".")
    key = Text(f"{table}." if table else "", palette.muted, no_wrap=True)
    key.append(name, palette.text)
    return key, plain(row.value, 60) if row.value else Text("–", palette.muted)


def setting_words(row: SettingRow, palette: Palette) -> Text:
    """The marked setting in full, with its meaning."""
    out = Text(f"{row.key}  ", palette.accent)
    out.append(harmless(row.value, 300) or "not set")
    out.append(f"\n{MEANS.get(row.key, 'Enter changes it; empty takes it out')}", palette.muted)
    return out


def change_of(row: SettingRow, text: str) -> dict[str, Any]:
    """The change that typing ``text`` means; nothing typed takes the setting out of the file."""
    from olivevib.values import settings

    if not text.strip():
        return {row.key: None}
    (value,) = settings([f"the.value={text.strip()}"]).values()
    return {row.key: value}
