"""Recording a trial: what the command line and the app share."""

from olivevib.pipeline.capture.looks import Look, advise
from olivevib.pipeline.capture.plan import (
    CameraState,
    Captured,
    CapturePlan,
    CaptureState,
    Hold,
    Watch,
    at_once,
    unwatched,
)
from olivevib.pipeline.capture.prompts import Prompt, Prompter
from olivevib.pipeline.capture.record import capture
from olivevib.pipeline.capture.trial import board_in, board_trial, place_of, trial_from
from olivevib.pipeline.capture.verdict import CameraResult, Verdict, good_for, judge

__all__ = [
    "CameraResult",
    "CameraState",
    "CapturePlan",
    "CaptureState",
    "Captured",
    "Hold",
    "Look",
    "Prompt",
    "Prompter",
    "Verdict",
    "Watch",
    "advise",
    "at_once",
    "board_in",
    "board_trial",
    "capture",
    "good_for",
    "judge",
    "place_of",
    "trial_from",
    "unwatched",
]
