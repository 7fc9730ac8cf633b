"""Exports: a trajectory as files that spreadsheets, CAD, MATLAB and modal software open."""

from olivevib.files.exports.door import FORMATS, export
from olivevib.files.exports.facts import ExportFacts, only_markers

__all__ = ["FORMATS", "ExportFacts", "export", "only_markers"]
