"""Exports: a trajectory as files that spreadsheets, CAD, MATLAB and modal software open."""

from olivevib.files.exports.door import EVEN, FORMATS, export
from olivevib.files.exports.even import even_part
from olivevib.files.exports.facts import ExportFacts, only_markers

__all__ = ["EVEN", "FORMATS", "ExportFacts", "even_part", "export", "only_markers"]
