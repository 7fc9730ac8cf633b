"""The rows of the report's tables: text with units, made from frozen values and the summary."""

from __future__ import annotations

from olivevib.report.tables.bodies import deflection_rows, motion_rows, rotation_rows
from olivevib.report.tables.comparison import comparison_lines, comparison_pairs
from olivevib.report.tables.markers import (
    candidate_accelerations,
    distance_rows,
    frequency_sigma,
    marker_rows,
    phase_rows,
    phase_word,
    state_rows,
)
from olivevib.report.tables.motion import (
    decay_rows,
    dose_rows,
    figure_rows,
    orbit_rows,
    transmissibility_rows,
)
from olivevib.report.tables.record import (
    outcome_pairs,
    provenance_pairs,
    record_sections,
    stage_rows,
)
from olivevib.report.tables.rig import (
    calibration_facts,
    camera_clocks,
    camera_columns,
    rig_pairs,
    timing_pairs,
)

__all__ = [
    "calibration_facts",
    "camera_clocks",
    "camera_columns",
    "candidate_accelerations",
    "comparison_lines",
    "comparison_pairs",
    "decay_rows",
    "deflection_rows",
    "distance_rows",
    "dose_rows",
    "figure_rows",
    "frequency_sigma",
    "marker_rows",
    "motion_rows",
    "orbit_rows",
    "outcome_pairs",
    "phase_rows",
    "phase_word",
    "provenance_pairs",
    "record_sections",
    "rig_pairs",
    "rotation_rows",
    "stage_rows",
    "state_rows",
    "timing_pairs",
    "transmissibility_rows",
]
