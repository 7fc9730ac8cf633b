"""Optical against accelerometer: clocks, axes, gain, coherence."""

from olivevib.comparison.compare import compare
from olivevib.comparison.settings import ComparisonSettings, Localised
from olivevib.comparison.types import Comparison, LineDifference, Verdict
from olivevib.comparison.views import View

__all__ = [
    "Comparison",
    "ComparisonSettings",
    "LineDifference",
    "Localised",
    "Verdict",
    "View",
    "compare",
]
