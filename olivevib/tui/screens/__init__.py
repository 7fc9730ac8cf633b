"""One screen a file; each is imported when it is first opened."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from olivevib.tui.screens.page import Page

PAGES = {
    "trial": "trial:TrialPage",
    "results": "results:ResultsPage",
    "motion": "motion:MotionPage",
    "spectrogram": "spectrogram:SpectrogramPage",
    "calibration": "calibration:CalibrationPage",
    "compare": "compare:ComparePage",
    "pictures": "pictures:PicturesPage",
    "report": "report:ReportPage",
    "settings": "settings:SettingsPage",
}


TOOLS = {
    "planning": "PlanningPage",
    "batch": "BatchPage",
    "row_time": "RowTimePage",
    "machine": "MachinePage",
    "prints": "PrintsPage",
    "libraries": "LibrariesPage",
}  # about the workspace, not one trial


def make_tool(name: str, workspace: Path) -> Page:
    """The page ``name`` of the workspace."""
    module = import_module(f"olivevib.tui.screens.{name}")
    page: Page = getattr(module, TOOLS[name])(workspace)
    return page


def load_pages() -> None:
    """Import every page, in whatever thread this is called in."""
    modules = {place.split(":")[0] for place in PAGES.values()}
    for module in sorted({*modules, "new_trial", "capture", "live", *TOOLS}):
        import_module(f"olivevib.tui.screens.{module}")


def make_page(name: str, folder: Path) -> Page:
    """The page ``name`` of the trial in ``folder``."""
    module, kind = PAGES[name].split(":")
    page: Page = getattr(import_module(f"olivevib.tui.screens.{module}"), kind)(folder)
    return page
