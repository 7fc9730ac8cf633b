"""The paper's calibration: camera matrix, poses and stereo pose in closed form, without refinement.

No lens distortion, no lag, no sigmas: reproducible, an initial value, never the best result.
Source: Zhang, A flexible new technique for camera calibration, 2000, section 3.1 and appendix B.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats
from olivevib.calibration.lag import Pose, medoid_pose
from olivevib.calibration.views import BoardView, pair_views
from olivevib.errors import InputError
from olivevib.geometry import CameraModel, homography, nearest_rotation

LEAST_VIEWS = 3
SURE = 1e-3  # least singular value but one of a homography's equations, of the largest
MANY = 1e-9  # the same of Zhang's equations: below it, a family of cameras explains the views


@dataclass(frozen=True)
class ClosedForm:
    """One camera without distortion (K may hold skew), and the board's pose in every view.

    X_camera = R X_board + t_mm, R (V, 3, 3), t_mm (V, 3).
    """

    camera: CameraModel
    R: Floats
    t_mm: Floats


def solve_closed(views: Sequence[BoardView], size_px: tuple[int, int], name: str) -> ClosedForm:
    """Camera ``name`` and board poses from at least three views; size (width, height) px.

    Every point of a view counts alike (coded boards: one a marker, its centre). Raises InputError
    where no camera matrix exists, or more than one: views that are all parallel.
    """
    H = np.array([homography(view.board_mm[:, :2], view.px) for view in views]).reshape(-1, 3, 3)
    K = camera_matrix(H, size_px, name)
    poses = [pose_of(K, one) for one in H]
    camera = CameraModel(size_px, K, np.zeros(5))
    return ClosedForm(camera, np.array([R for R, _ in poses]), np.array([t for _, t in poses]))


def fixes_homography(view: BoardView) -> bool:
    """Whether a view's points fix its homography: four of them, no three in line.

    The homography of the board to itself must be the identity and no other.
    """
    points = view.board_mm[:, :2] - view.board_mm[:, :2].mean(axis=0)
    x, y = points.T / max(float(np.abs(points).max()), 1e-12)
    one, zero = np.ones_like(x), np.zeros_like(x)
    top = np.column_stack([x, y, one, zero, zero, zero, -x * x, -x * y, -x])
    low = np.column_stack([zero, zero, zero, x, y, one, -y * x, -y * y, -y])
    if x.size < 4:
        return False
    s = np.linalg.svd(np.vstack([top, low]), compute_uv=False)
    return bool(s[7] > SURE * s[0])


def camera_matrix(H: Floats, size_px: tuple[int, int], name: str) -> Floats:
    """K (3, 3) with skew from board homographies (V, 3, 3), V >= 3, of views in different tilts.

    Pixels are conditioned by the image size. Raises InputError where the image of the absolute
    conic B = K^-T K^-1 is not positive definite: no K exists.
    """
    if len(H) < LEAST_VIEWS:
        raise InputError(
            f"The closed form needs {LEAST_VIEWS} views of the {name} camera; {len(H)} are fit.",
            "A view counts where at least four board points, no three in line, were found.",
            "Show the whole board in more places.",
        )
    width, height = size_px
    N = np.array([[2 / width, 0, -1], [0, 2 / width, -height / width], [0, 0, 1.0]])
    conditioned = N @ H
    unit = conditioned / np.linalg.norm(conditioned, axis=(1, 2), keepdims=True)
    rows = np.concatenate([_row(unit, 0, 1), _row(unit, 0, 0) - _row(unit, 1, 1)])
    _, s, vt = np.linalg.svd(rows)
    if s[4] < MANY * s[0]:
        raise _no_camera(len(H), name, "the board was parallel in all of them")
    b = vt[-1] * (1.0 if vt[-1, 0] >= 0 else -1.0)
    B = np.array([[b[0], b[1], b[3]], [b[1], b[2], b[4]], [b[3], b[4], b[5]]])
    try:
        L = np.linalg.cholesky(B)
    except np.linalg.LinAlgError as error:
        why = "the matrix B = K^-T K^-1 that they give is not positive definite"
        raise _no_camera(len(H), name, why) from error
    K = np.linalg.inv(L).T
    out: Floats = np.linalg.solve(N, K / K[2, 2])
    return out


def _row(H: Floats, i: int, j: int) -> Floats:
    """Zhang's v_ij (V, 6) with h_i^T B h_j = v_ij b, b = B11 B12 B22 B13 B23 B33."""
    a, c = H[:, :, i], H[:, :, j]
    pairs = ((0, 0), (0, 1), (1, 1), (2, 0), (2, 1), (2, 2))
    terms = [a[:, p] * c[:, q] + (a[:, q] * c[:, p] if p != q else 0) for p, q in pairs]
    return np.column_stack(terms)


def _no_camera(count: int, name: str, why: str) -> InputError:
    return InputError(
        f"The closed form finds no lens for the {name} camera: no K exists.",
        f"Of {count} views: {why}. Little tilt, blur or a strongly bending lens do that.",
        "Tilt the board by 30 to 45 degrees to all sides, near and far; or calibrate with "
        "--set calibration.paper=false, which models the lens.",
    )


def pose_of(K: Floats, H: Floats) -> tuple[Floats, Floats]:
    """Rotation (3, 3) and translation (3,) mm of the board in front of the camera, t_z > 0."""
    h = np.linalg.solve(K, H)
    h = h * (np.sign(h[2, 2]) / np.linalg.norm(h[:, 0]))
    R = nearest_rotation(np.column_stack([h[:, 0], h[:, 1], np.cross(h[:, 0], h[:, 1])]))
    return R, h[:, 2]


def stereo_pose(
    left: ClosedForm,
    right: ClosedForm,
    left_views: Sequence[BoardView],
    right_views: Sequence[BoardView],
) -> Pose:
    """The pose of the right camera: medoid of R2 R1^T over common views, median of t2 - R t1."""
    pairs = np.array(pair_views(left_views, right_views), dtype=np.int64).reshape(-1, 2)
    if not len(pairs):
        raise InputError(
            "The closed form finds no view that both cameras share.",
            "Each camera saw the board, but never at the same time.",
            "Show the board to both cameras at once.",
        )
    a, b = pairs.T
    return medoid_pose(left.R[a], left.t_mm[a], right.R[b], right.t_mm[b])
