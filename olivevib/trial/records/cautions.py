"""Cautions as an attribute of a stage file."""

from __future__ import annotations

import json
from collections.abc import Sequence

from olivevib.errors import Caution


def cautions_text(cautions: Sequence[Caution]) -> str:
    """The cautions as JSON, for one attribute."""
    rows = [{"code": c.code, "text": c.text, "remedy": c.remedy} for c in cautions]
    return json.dumps(rows, ensure_ascii=False)


def cautions_from(text: object) -> tuple[Caution, ...]:
    """The cautions of an attribute; none where the attribute is missing."""
    rows = json.loads(text) if isinstance(text, str) and text else []
    return tuple(Caution(str(r["code"]), str(r["text"]), str(r["remedy"])) for r in rows)
