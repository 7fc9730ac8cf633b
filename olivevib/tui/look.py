"""A look at the form of a new trial: what is wrong, what is unsaid, the plan it describes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from olivevib.errors import OlivevibError
from olivevib.tui.fields import FieldError
from olivevib.tui.form_words import in_form_words, unsaid_words
from olivevib.tui.loader import guarded
from olivevib.tui.plan import FORM_NAMES, fields_of, plan_of, trial_name
from olivevib.tui.sensors import line_told

if TYPE_CHECKING:
    from olivevib.pipeline import NewTrial


@dataclass(frozen=True)
class Look:
    """What the form amounts to; ``field`` is the line that the error is about."""

    plan: NewTrial | None = None
    error: OlivevibError | None = None
    field: str = ""
    unsaid: str = ""


def look_at(values: Mapping[str, str], whole: bool = False) -> Look:
    """The plan of the form, or its first fault in the form's own words.

    whole: it is to be made, so that its name and both recordings must be there. Opens the files.
    """
    from olivevib import pipeline

    lines = fields_of(values)
    told = guarded(lambda: _told(values, whole))
    if isinstance(told, OlivevibError):
        field = told.field if isinstance(told, FieldError) else ""
        return Look(None, in_form_words(told, lines, field), field)
    found = guarded(lambda: next(pipeline.faults(told), None))
    if isinstance(found, OlivevibError):
        return Look(None, found)
    if found is not None:
        field = FORM_NAMES.get(found.field, line_told(found.field, found.sensor, values))
        return Look(None, in_form_words(found.error, lines, field), field)
    return Look(told, unsaid=unsaid_words(pipeline.unsaid(told), lines))


def _told(values: Mapping[str, str], whole: bool) -> NewTrial:
    if whole:
        trial_name(values)
        for side in ("left", "right"):
            if not values.get(side, "").strip():
                remedy = "Pick it with Ctrl+O in that line, or type its path."
                raise FieldError(side, f"the {side} recording is not named.", remedy)
    return plan_of(values)
