"""Figures and pages of one trial or a season."""
