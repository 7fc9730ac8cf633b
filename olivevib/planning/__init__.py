"""Before a trial: what these cameras, markers and frequencies will let one measure."""

from olivevib.planning.advice import advice
from olivevib.planning.outlook import Outlook, outlook
from olivevib.planning.reach import reach, reach_words, step_words
from olivevib.planning.setup import Setup
from olivevib.planning.zones import Zone, zone_of, zones

__all__ = [
    "Outlook",
    "Setup",
    "Zone",
    "advice",
    "outlook",
    "reach",
    "reach_words",
    "step_words",
    "zone_of",
    "zones",
]
