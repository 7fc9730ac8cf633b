"""Does a rig still hold: the trial's own markers against it, long after the board was put away.

Two tests that need no board: the markers' images must meet across the epipolar lines, and a
marker's sides must come out as long as they are. A bumped tripod turns one camera; a changed focus
stretches its picture: the misfits differ, so they can be told apart where markers are spread. Where
the markers fit the rig with left and right exchanged, the recordings are swapped.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Bools, Floats
from olivevib.calibration.rigid import triangulate
from olivevib.calibration.uncertainty import rig_sensitivity, symmetric
from olivevib.errors import Caution, InputError
from olivevib.geometry import StereoRig, rotation_from_vector, vector_from_rotation

LIMIT_Z = 4.0  # misfit over what rig and pixels allow
LIMIT_PX, LIMIT_SIZE = 0.5, 0.01  # and at least so much
SIDE_Z = 3.0
CLEARLY = 4.0  # times smaller a misfit must be with left and right exchanged
LEAST_MARKERS = 4
TURN_RAD, STRETCH = 0.02, 0.05  # how far a bump turns, how far a focus stretches
SHARED_PX = 0.1  # of what the localiser has in common in all frames (light, print, exposure)


@dataclass(frozen=True)
class Trust:
    """The rig against M markers of a trial.

    epipolar_px: rms misfit of the markers' mean images; expected_px: what rig and pixels allow;
    size_percent: measured side lengths over true ones, less 1; expected_percent: sigma that the rig
    allows. turned_deg and stretched_percent: the change of the right camera against the left that
    explains the misfit best, each alone; likely: "swapped", "turned", "stretched" or "" (holds, or
    not told). behind: share of the points that would lie behind a camera; exchanged_px: the misfit
    with left and right exchanged (NaN: not asked).
    """

    markers: int
    epipolar_px: float
    expected_px: float
    size_percent: float
    expected_percent: float
    turned_deg: float
    stretched_percent: float
    likely: str
    behind: float = 0.0
    exchanged_px: float = float("nan")

    @property
    def moved(self) -> bool:
        """Whether the epipolar misfit is more than the rig allows, or the points are nowhere."""
        return self.behind > 0.5 or self.epipolar_px > max(LIMIT_PX, LIMIT_Z * self.expected_px)

    @property
    def resized(self) -> bool:
        """Whether the markers come out too large or too small."""
        off, allowed = abs(self.size_percent), SIDE_Z * self.expected_percent
        return off > max(100 * LIMIT_SIZE, allowed)


def judge_rig(rig: StereoRig, left_px: Floats, right_px: Floats, true_mm: Floats) -> Trust | None:
    """Test a rig on markers: corners (M, 4, 2) px in both images at one instant (means over time).

    true_mm (M, 4): the true side lengths P1P2, P2P3, P3P4, P4P1. None without markers.
    """
    as_is = _judged(rig, left_px, right_px, true_mm)
    if as_is is not None and not as_is.moved:
        return as_is
    other = _judged(exchanged(rig), left_px, right_px, true_mm)
    if other is None or other.moved or other.resized:
        return as_is
    seen = other if as_is is None else as_is
    if as_is is not None and as_is.behind < 0.5 and as_is.epipolar_px < CLEARLY * other.epipolar_px:
        return as_is
    return replace(seen, likely="swapped", exchanged_px=other.epipolar_px)


def exchanged(rig: StereoRig) -> StereoRig:
    """The same pair with left and right exchanged, its covariance too."""
    r, t = vector_from_rotation(rig.R_right_left), rig.t_right_left_mm
    back = -rig.R_right_left.T @ t
    cov = None
    if rig.covariance is not None:
        J, step = np.zeros((18, 18)), 1e-6
        J[0:6, 6:12] = J[6:12, 0:6] = np.eye(6)
        J[12:15, 12:15] = -np.eye(3)
        J[15:18, 15:18] = -rig.R_right_left.T
        for k in range(3):
            turned = rotation_from_vector(r + step * np.eye(3)[k])
            J[15:18, 12 + k] = (-turned.T @ t - back) / step
        cov = symmetric(J @ rig.covariance @ J.T)
    return StereoRig(rig.right, rig.left, rig.R_right_left.T, back, cov)


def _judged(rig: StereoRig, left_px: Floats, right_px: Floats, true_mm: Floats) -> Trust | None:
    count = len(left_px)
    if not count:
        return None
    flat = left_px.reshape(-1, 2), right_px.reshape(-1, 2)
    xyz, residual, _ = triangulate(rig, *flat)
    good = np.isfinite(xyz).all(axis=1) & np.isfinite(residual).all(axis=1)
    if good.sum() < 4:
        return None
    misfit = np.linalg.norm(residual, axis=1)[good]
    ratio, expected = _sizes(rig, xyz, true_mm)
    turned, stretched, likely = _explained(rig, flat[0][good], flat[1][good], count)
    return Trust(
        markers=count,
        epipolar_px=float(np.sqrt((misfit**2).mean())),
        expected_px=_expected_px(rig, xyz[good]),
        size_percent=100 * ratio,
        expected_percent=100 * expected,
        turned_deg=turned,
        stretched_percent=stretched,
        likely=likely,
        behind=float(np.mean((xyz[good][:, 2] <= 0) | (rig.to_right(xyz[good])[:, 2] <= 0))),
    )


def _expected_px(rig: StereoRig, xyz: Floats) -> float:
    """Rms epipolar misfit that the rig's covariance allows at points (N, 3), px."""
    if rig.covariance is None:
        return SHARED_PX
    slopes = _misfit_slopes(rig, xyz)
    variance = np.einsum("ni,ij,nj->n", slopes, rig.covariance, slopes)
    return float(np.sqrt(variance.mean() + SHARED_PX**2))


def _misfit_slopes(rig: StereoRig, xyz: Floats) -> Floats:
    """Derivative (N, 18) of the signed misfit of points by the rig's parameters."""
    _, by_left, left_lens = rig.left.project_jacobian(xyz)
    _, by_right, right_lens = rig.right.project_jacobian(rig.to_right(xyz))
    A = np.concatenate([by_left, by_right @ rig.R_right_left], axis=1)
    normal = np.linalg.svd(A)[0][:, :, 3]  # the direction in (u, v, u', v') no point can explain
    J = np.zeros((len(xyz), 4, 18))
    J[:, :2, 0:6], J[:, 2:, 6:12] = left_lens, right_lens
    step = 1e-6
    base = rig.right.project(rig.to_right(xyz))
    turned = xyz @ rig.R_right_left.T
    for k in range(3):
        R = rotation_from_vector(step * np.eye(3)[k])
        J[:, 2:, 12 + k] = (rig.right.project(turned @ R.T + rig.t_right_left_mm) - base) / step
    J[:, 2:, 15:18] = by_right
    return np.asarray(np.einsum("ni,nij->nj", normal, J), dtype=np.float64)


def _sizes(rig: StereoRig, xyz: Floats, true_mm: Floats) -> tuple[float, float]:
    """Measured over true side length less 1 (median of the sides), and the rig's sigma of it."""
    corners = xyz.reshape(-1, 4, 3)
    after = np.roll(corners, -1, axis=1)
    length = np.linalg.norm(after - corners, axis=2)
    with np.errstate(invalid="ignore"):
        ratio = length / true_mm - 1
    if not np.isfinite(ratio).any():
        return float("nan"), float("nan")
    middle = float(np.nanmedian(ratio))
    if rig.covariance is None:
        return middle, LIMIT_SIZE / SIDE_Z
    ok = np.isfinite(ratio).all(axis=1)
    unit = (after[ok] - corners[ok]) / length[ok][:, :, None]
    by_rig = rig_sensitivity(rig, corners[ok].reshape(-1, 3))[0].reshape(-1, 4, 3, 18)
    slope = np.einsum("mki,mkij->mkj", unit, np.roll(by_rig, -1, axis=1) - by_rig)
    mean = (slope / length[ok][:, :, None]).reshape(-1, 18).mean(axis=0)
    scatter = float(np.nanstd(ratio)) / np.sqrt(max(ok.sum(), 1))
    return middle, float(np.hypot(np.sqrt(mean @ rig.covariance @ mean), scatter))


def _explained(rig: StereoRig, a: Floats, b: Floats, count: int) -> tuple[float, float, str]:
    """The turn (deg) or the stretch (%) of the right camera that explains the misfits best."""
    xyz, residual, _ = triangulate(rig, a, b)
    slopes = _misfit_slopes(rig, xyz)
    _, by_left, _ = rig.left.project_jacobian(xyz)
    _, by_right, _ = rig.right.project_jacobian(rig.to_right(xyz))
    A = np.concatenate([by_left, by_right @ rig.R_right_left], axis=1)
    normal = np.linalg.svd(A)[0][:, :, 3]
    signed = (normal * residual).sum(axis=1)
    turn, left_turn = _fit(slopes[:, 12:15], signed, np.full(3, TURN_RAD))
    lens = np.column_stack([
        slopes[:, 0:2] @ rig.left.lens[:2], slopes[:, 6:8] @ rig.right.lens[:2]
    ])  # fmt: skip
    stretch, left_stretch = _fit(lens, signed, np.full(2, STRETCH))
    told = min(left_turn, left_stretch) < 0.5 * max(left_turn, left_stretch)
    likely = "turned" if left_turn < left_stretch else "stretched"
    worst = float(stretch[np.abs(stretch).argmax()])
    enough = count >= LEAST_MARKERS and told
    return float(np.degrees(np.linalg.norm(turn))), 100 * worst, likely if enough else ""


def _fit(slopes: Floats, signed: Floats, sd: Floats) -> tuple[Floats, float]:
    """The parameters that remove most of the misfit, and the rms that remains."""
    weight = max(float(np.sqrt((signed**2).mean())), SHARED_PX) * 0.1
    A = np.vstack([slopes, weight * np.diag(1 / sd)])
    y = np.concatenate([-signed, np.zeros(len(sd))])
    found = np.linalg.lstsq(A, y, rcond=None)[0]
    left = signed + slopes @ found
    return found, float(np.sqrt((left**2).mean() + SHARED_PX**2))


def cautions_of(trust: Trust | None) -> tuple[Caution, ...]:
    """What a person should know of a rig that does not hold."""
    if trust is None:
        return ()
    out = []
    if trust.likely == "swapped":
        error = swapped(trust)
        return (Caution("recordings-swapped", f"{error.what} {error.why}", error.remedy),)
    if trust.moved:
        out.append(_moved(trust))
    if trust.resized:
        out.append(
            Caution(
                "marker-size-contradicts",
                f"The markers come out {abs(trust.size_percent):.1f} % too "
                f"{'large' if trust.size_percent > 0 else 'small'}; the calibration allows "
                f"{trust.expected_percent:.1f} %.",
                "Measure a marker and correct markers.size_mm; if it is right, the distance "
                "between the cameras, their focus or the board's size changed: calibrate again.",
            )
        )
    return tuple(out)


def swapped(trust: Trust) -> InputError:
    """The error for recordings whose markers fit the rig with left and right exchanged."""
    named = f"miss the epipolar lines by {trust.epipolar_px:.1f} px"
    if trust.behind > 0.5:
        named = "would stand behind the cameras"
    return InputError(
        "the recordings of the trial are swapped: left is right.",
        f"As they are named, the markers {named}; with left and right exchanged they fit the "
        f"calibrated pair to {trust.exchanged_px:.2g} px.",
        "Exchange [cameras.left] and [cameras.right] in trial.toml (video, stamps, row time), and "
        "run again; if it was the board's recordings that were swapped, exchange those.",
    )


def _moved(trust: Trust) -> Caution:
    seen = (
        f"The markers miss the epipolar lines by {trust.epipolar_px:.1f} px; the calibration and "
        f"the pictures allow {trust.expected_px:.1f} px."
    )
    if trust.likely == "stretched":
        return Caution(
            "focus-changed",
            f"{seen} One picture is stretched by {abs(trust.stretched_percent):.1f} %: focus or "
            "zoom changed since the calibration.",
            "Switch autofocus off, and calibrate again with the focus as it is now.",
        )
    how = (
        f" One camera is turned by {trust.turned_deg:.2f} degrees against the other: a tripod was "
        "bumped."
        if trust.likely == "turned"
        else ""
    )
    return Caution(
        "rig-moved",
        seen + how,
        "Calibrate the pair again as it stands now; check tripods, focus and the time offset.",
    )


def sides_mm(corners_mm: Floats) -> Floats:
    """Side lengths (..., 4) of quadrilaterals (..., 4, 3)."""
    out: Floats = np.linalg.norm(np.roll(corners_mm, -1, axis=-2) - corners_mm, axis=-1)
    return out


def both_seen(left_px: Floats, right_px: Floats) -> Bools:
    """Frames (N,) in which all four corners (N, 4, 2) were seen by both cameras."""
    return np.asarray(
        np.isfinite(left_px).all(axis=(1, 2)) & np.isfinite(right_px).all(axis=(1, 2))
    )
