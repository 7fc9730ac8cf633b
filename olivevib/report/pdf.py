"""The page of one trial as PDF: the same facts and figures as the HTML, set by Typst."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import matplotlib as mpl

from olivevib.errors import InputError, UsageError

_VARIABLE = re.compile(r"var\(--[a-z]+,(#[0-9a-f]{6})\)")


def require_typst() -> Any:
    """The Typst compiler; UsageError with the line that installs it where it is absent."""
    try:
        import typst
    except ImportError as error:
        raise UsageError(
            "--pdf needs the package typst, which is not installed.",
            "It sets the pages; everything else works without it.",
            "Install it: pip install 'olivevib[pdf]'   or print report.html to PDF in a browser.",
        ) from error
    return typst


def render_pdf(facts: Mapping[str, Any]) -> bytes:
    """The PDF of what ``page_facts`` gathered; fonts inside, the same bytes for the same facts.

    Texts go in as data, never as markup. Fonts are DejaVu, which come with matplotlib, so that
    pages look alike on every machine. Raises UsageError where typst is absent, InputError where it
    cannot set the page.
    """
    typst = require_typst()
    template = resources.files("olivevib.report") / "templates" / "trial.typ"
    fonts = Path(mpl.get_data_path()) / "fonts" / "ttf"
    try:
        return bytes(
            typst.compile(
                template.read_bytes(),
                format="pdf",
                font_paths=[str(fonts)],
                ignore_system_fonts=True,
                sys_inputs={"facts": _plain_text(facts)},
                timestamp=0,
            )
        )
    except typst.TypstError as error:
        raise InputError(
            "the PDF could not be set.", f"Typst says: {error}", "Use report.html, and report this."
        ) from error


def _plain_text(facts: Mapping[str, Any]) -> str:
    """The facts as JSON, colours of figures as plain numbers."""
    plain = {
        name: value for name, value in facts.items() if name not in ("states", "state_rows")
    }  # too fine for paper
    return json.dumps(plain, default=_value, ensure_ascii=False)


def _value(value: Any) -> Any:
    """What JSON does not know: dataclasses, with figures freed of CSS variables."""
    if is_dataclass(value) and not isinstance(value, type):
        fields = asdict(value)
        if "svg" in fields:
            fields["svg"] = _VARIABLE.sub(r"\1", fields["svg"])
        return fields
    raise TypeError(f"no plain value for {type(value).__name__}")
