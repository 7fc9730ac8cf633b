"""Errors of the pipeline in the words of a form: lines by their labels, never options of a verb."""

from __future__ import annotations

import re
from collections.abc import Sequence

from olivevib.errors import OlivevibError, UsageError
from olivevib.tui.fields import Field
from olivevib.tui.harmless import harmless
from olivevib.tui.plan import FORM_NAMES
from olivevib.tui.sensors import PARTS, sensor_line, sensor_of

_UNITS = r"(?: (?:FILE|PATH|SPEC|MM|US|MS|LIB|ID|DEVICE|NAME|HZ|\d[\d.,-]*(?=[):;])))?"
_OPTION = re.compile(rf"--([a-z][a-z-]*){_UNITS}")
_PLAIN = (
    (re.compile(r"; olivevib \w+ --help lists them"), "; Ctrl+O in that line lists them"),
    (re.compile(r" \([a-z_]+\.[a-z_]+ in trial\.toml\)"), ""),
    (re.compile(r"--[a-z-]+="), ""),
    (re.compile(r" \(olivevib \w+[^)]*\)"), ""),
)


def in_form_words(
    error: OlivevibError, fields: Sequence[Field], field: str | None = None
) -> OlivevibError:
    """The same error, naming the line of the form where it can be mended.

    field: the line that it is about, where that is known.
    """
    labels = {f.name: f.label for f in fields}
    if number := sensor_of(field or ""):  # its options name the lines of this sensor
        labels |= {sensor_line(1, part): labels[sensor_line(number, part)] for part in PARTS}
    parts = [_plain(part, labels) for part in (error.what, error.why, error.remedy)]
    label = labels.get(field or "")
    if label and f"“{label}”" not in parts[0]:
        parts[0] = f"“{label}”: {parts[0]}"
    return UsageError(*parts)


def sentence_of(error: OlivevibError) -> str:
    """The error on one line: what, and what to do."""
    return "  ".join(part for part in (error.what, error.remedy) if part)


def _plain(text: str, labels: dict[str, str]) -> str:
    def label(found: re.Match[str]) -> str:
        name = found[1].replace("-", "_")
        name = FORM_NAMES.get(name, name)
        return f"“{labels[name]}”" if name in labels else found[0]

    for pattern, words in _PLAIN:
        text = pattern.sub(words, text)
    return _OPTION.sub(label, text)


def unsaid_words(unsaid: Sequence[str], fields: Sequence[Field]) -> str:
    """What a form leaves unsaid, on one line; "" for nothing."""
    labels = {f.name: f.label for f in fields}
    words = []
    for text in unsaid:
        options = [m[1].replace("-", "_") for m in _OPTION.finditer(text)]
        names = [labels.get(FORM_NAMES.get(o, o), o) for o in options] or [text.split(":")[0]]
        words.append(f"{names[0]} ({text.split(': ', 1)[1]})")
    return f"Not said yet: {'; '.join(words)}." if words else ""


def taken_words(source: str, taken: Sequence[tuple[str, str]]) -> str:
    """Which lines, (label, value), stand as in another trial; "" for none."""
    words = []
    for label, value in taken:
        name, _, unit = label.partition(", ")
        words.append(f"{name} {harmless(value, 40)}{' ' * bool(unit)}{unit}")
    return f"Taken from {source}, check it: {' · '.join(words)}" if words else ""
