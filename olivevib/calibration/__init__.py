"""Boards, closed form, joint refinement and quality of the stereo calibration."""

from olivevib.calibration.boards import Board, board_from_table, parse_board
from olivevib.calibration.calibrate import calibrate
from olivevib.calibration.closed_form import ClosedForm, solve_closed
from olivevib.calibration.coverage import Coverage
from olivevib.calibration.diagnosis import diagnose
from olivevib.calibration.finding import BoardFinder, find_board
from olivevib.calibration.holdout import HoldOut
from olivevib.calibration.looks import Diagnosis
from olivevib.calibration.paper import calibrate_paper
from olivevib.calibration.result import (
    BoardPoses,
    Calibration,
    HalfTest,
    Residuals,
    ViewUse,
)
from olivevib.calibration.settings import CalibrationSettings, LensPrior, Shutter
from olivevib.calibration.uncertainty import PointSigma, length_sigma, point_sigma
from olivevib.calibration.views import BoardView

__all__ = [
    "Board",
    "BoardFinder",
    "BoardPoses",
    "BoardView",
    "Calibration",
    "CalibrationSettings",
    "ClosedForm",
    "Coverage",
    "Diagnosis",
    "HalfTest",
    "HoldOut",
    "LensPrior",
    "PointSigma",
    "Residuals",
    "Shutter",
    "ViewUse",
    "board_from_table",
    "calibrate",
    "calibrate_paper",
    "diagnose",
    "find_board",
    "length_sigma",
    "parse_board",
    "point_sigma",
    "solve_closed",
]
