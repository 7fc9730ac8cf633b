"""What became of one trial of a batch, as a value that travels between processes as JSON."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field

from olivevib.errors import Caution, OlivevibError


@dataclass(frozen=True)
class TrialResult:
    """One trial of a batch: done with its result hash, or failed with what, why and remedy.

    folder: absolute. ran: the stages (and "report") that were not up to date. cautions: all
    warnings of the trial, also those of earlier runs. seconds: how long it took; no part of the
    result.
    """

    folder: str
    hash: str = ""
    ran: tuple[str, ...] = ()
    cautions: tuple[Caution, ...] = ()
    what: str = ""
    why: str = ""
    remedy: str = ""
    seconds: float = field(default=0.0, compare=False)

    @property
    def failed(self) -> bool:
        """Whether something went wrong; ``what`` says it."""
        return bool(self.what)

    @classmethod
    def failure(cls, folder: str, error: OlivevibError) -> TrialResult:
        """The result of a trial that could not be measured."""
        return cls(folder, what=error.what, why=error.why, remedy=error.remedy)

    def to_json(self) -> str:
        """One line of JSON, ASCII."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> TrialResult:
        """What ``to_json`` wrote."""
        facts = json.loads(text)
        facts["ran"] = tuple(facts["ran"])
        facts["cautions"] = tuple(Caution(**c) for c in facts["cautions"])
        return cls(**facts)
