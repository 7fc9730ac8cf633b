"""The trial folder: what the technician knows, what each stage wrote, what is stale."""

from olivevib.trial.settings import TrialSettings
from olivevib.trial.stages import STAGES, Condition, StageState
from olivevib.trial.trial import Trial

__all__ = ["STAGES", "Condition", "StageState", "Trial", "TrialSettings"]
