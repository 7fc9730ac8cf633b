"""Studies: the paper's experiments reproduced, and speed and accuracy beside other libraries.

Each is a function ``run(effort, tick) -> Study`` in a file of its own, listed in ``catalogue``;
``olivevib paper`` and ``olivevib benchmark`` run them and ``write`` keeps what they measured.
"""

from olivevib.studies.catalogue import BENCHMARKS, PAPER, Entry, find
from olivevib.studies.study import Chart, Curve, Effort, Goal, Study, Table
from olivevib.studies.write import as_json, as_text, write_study

__all__ = [
    "BENCHMARKS",
    "PAPER",
    "Chart",
    "Curve",
    "Effort",
    "Entry",
    "Goal",
    "Study",
    "Table",
    "as_json",
    "as_text",
    "find",
    "write_study",
]
