"""Pages and figures of one trial or a season: self-contained HTML that needs no network."""

from __future__ import annotations

from olivevib.report.content import ReportContent
from olivevib.report.gather import content_of
from olivevib.report.page import render_page
from olivevib.report.season import SeasonEntry, render_season
from olivevib.report.season_table import season_table
from olivevib.report.write import Also, write_season_report, write_trial_report

__all__ = [
    "Also",
    "ReportContent",
    "SeasonEntry",
    "content_of",
    "render_page",
    "render_season",
    "season_table",
    "write_season_report",
    "write_trial_report",
]
