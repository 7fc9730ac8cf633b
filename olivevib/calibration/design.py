"""What the parameters of a pair do to a marker in the working volume, and how sure that is then."""

from __future__ import annotations

import numpy as np

from olivevib.arrays import Floats
from olivevib.calibration.bundle import LAG, STEREO
from olivevib.calibration.joint import JointFit
from olivevib.calibration.uncertainty import firm_inverse, rig_sensitivity, vector_jacobian
from olivevib.calibration.verdict import working_point
from olivevib.geometry import StereoRig


def expected_variance(slopes: Floats, information: Floats) -> float:
    """Sum of the variances of several quantities with ``slopes`` (n, p) by the parameters."""
    return float(np.einsum("ni,ij,nj->", slopes, firm_inverse(information), slopes))


def depth_slopes(fit: JointFit, rig: StereoRig, distance_mm: float) -> Floats:
    """Derivatives (5, p) of depth at five points of the working volume by the free THETA."""
    middle = working_point(rig, distance_mm)
    reach = 0.25 * distance_mm * np.array([[0, 0], [1, 1], [1, -1], [-1, 1], [-1, -1.0]])
    points = middle + np.column_stack([reach, np.zeros(5)])
    by_rig = rig_sensitivity(rig, points)[0][:, 2]
    by_rig[:, STEREO][:, :3] = by_rig[:, STEREO][:, :3] @ vector_jacobian(rig.R_right_left)
    out = np.zeros((5, fit.problem.free.size))
    out[:, :LAG] = by_rig
    return out[:, fit.problem.free]
