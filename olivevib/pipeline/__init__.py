"""The only door for those above: one function a stage, and the order of the stages."""

from olivevib.pipeline.calibrate import calibrate
from olivevib.pipeline.check import Finding, check
from olivevib.pipeline.compare import compare, keep_preset
from olivevib.pipeline.measure import analyse, reconstruct
from olivevib.pipeline.new import NewTrial, new_trial
from olivevib.pipeline.new_checks import Fault, faults, unsaid
from olivevib.pipeline.outputs import export, export_place, export_words, report
from olivevib.pipeline.run import Outcome, run, run_stage
from olivevib.pipeline.sensor_plan import SensorPlan, sensor_plans
from olivevib.pipeline.track import track

__all__ = [
    "Fault",
    "Finding",
    "NewTrial",
    "Outcome",
    "SensorPlan",
    "analyse",
    "calibrate",
    "check",
    "compare",
    "export",
    "export_place",
    "export_words",
    "faults",
    "keep_preset",
    "new_trial",
    "reconstruct",
    "report",
    "run",
    "run_stage",
    "sensor_plans",
    "track",
    "unsaid",
]
