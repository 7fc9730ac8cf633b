"""Warnings on sound recordings: false, or right because other data of the same cameras show it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from olivevib.arrays import Floats
from olivevib.calibration import (
    BoardView,
    CalibrationSettings,
    LensPrior,
    calibrate,
    diagnose,
    parse_board,
)
from olivevib.calibration.calibrate import fit_all, make_pair_checked
from olivevib.calibration.diagnosis import roll_deg
from olivevib.calibration.uncertainty import uncertainty
from olivevib.calibration.views import pair_views
from olivevib.errors import Caution
from olivevib.geometry import LENS, StereoRig
from olivevib.progress import Tick
from olivevib.studies.calibration.faults import CHARUCO, PICTURES, pictures, recording, solved
from olivevib.studies.calibration.recorded import (
    FOLDER,
    SETS,
    WEBCAM,
    WEBCAM_SIZE,
    Camera,
    frames,
    stamps_off_s,
    stills,
    there,
    webcams,
)
from olivevib.studies.calibration.webcams import LATE_MS, Found, pair
from olivevib.studies.study import Effort

LATE_WITHIN_MS, UNEVEN_S, DEVIATES = 10.0, 0.003, 2.0
SIDES = ("left", "right")


@dataclass(frozen=True)
class Alarms:
    """What was warned of a sound recording: what is false, and what is right with its proof."""

    recording: str
    false: tuple[str, ...]
    right: tuple[str, ...] = ()


def sound_recordings(effort: Effort, tick: Tick) -> list[Alarms]:
    """Rendered boards, simulated pairs (where every warning is false), and recordings."""
    out = []
    for spec in (CHARUCO, "arucogrid:4x3,size=50,gap=20,dict=DICT_6X6_250",
                 "chessboard:7x5,square=40"):  # fmt: skip
        board = parse_board(spec)
        found = diagnose(board, pictures(board, PICTURES, effort.draws(84)))
        wrong = (found.cause,) if found.cause != "sound" or "turned" in found.text else ()
        out.append(Alarms(f"rendered {board.kind}", wrong))
    for k in range(effort.count(4, 1)):
        tick(k, 4, "sound: simulated")
        told = solved(*recording(effort, 100 + k)).cautions
        out.append(Alarms(f"simulated {k + 1}", tuple(c.code for c in told)))
    if there():
        out += _recorded(effort, tick)
    return out


def _recorded(effort: Effort, tick: Tick) -> list[Alarms]:
    network = webcams("A", tick)
    pairs = list(combinations(range(4), 2)) if effort.share >= 0.5 else [(0, 2)]
    found = {(a, b): pair(network[a], network[b]) for a, b in pairs}
    out = [_judged(name, found, network) for name in found]
    for k in range(4 if effort.share >= 0.5 else 1):
        out.append(_diagnosed(k, network[k]))
    sets = [
        stills("opencv_stereo_chess13", f"{side}*.jpg", "chessboard:9x6,square=25")
        for side in SIDES
    ]
    out.append(_chess(sets[0][0], sets[1][0], sets[0][1]))
    return out


def _chess(left: list[BoardView], right: list[BoardView], size: tuple[int, int]) -> Alarms:
    """OpenCV's pairs: the board may be said to be bent if frames that were not used gain by it."""
    bent = calibrate(left, right, size, size)
    flat = calibrate(left, right, size, size, CalibrationSettings(lens=LensPrior(bow_sd_mm=1e-3)))
    false = [c.code for c in bent.cautions]
    proof: tuple[str, ...] = ()
    if bent.holdout is not None and flat.holdout is not None and "bent-board" in false:
        off = bent.holdout.reprojection_rms_px, flat.holdout.reprojection_rms_px
        if off[0] < off[1]:
            false.remove("bent-board")
            proof = (f"bent-board: unused frames fit to {off[0]:.3f} px, flat {off[1]:.3f} px",)
    return Alarms("OpenCV's 13 pairs", tuple(false), proof)


def _diagnosed(k: int, camera: Camera) -> Alarms:
    """The diagnosis may say that the board lies on its side where it does: it was held so."""
    found = diagnose(parse_board(WEBCAM), frames(FOLDER / SETS["A"] / f"cam_{k}.mp4")[::5])
    name = f"A {k}, diagnosis"
    if found.cause != "sound":
        return Alarms(name, (found.text,))
    if "on its side" not in found.text:
        return Alarms(name, ())
    roll = abs(roll_deg(camera.views))
    words = f"on its side: turned by {roll:.0f} degrees in {len(camera.views)} views"
    return Alarms(name, (), (words,)) if 60 < roll < 120 else Alarms(name, (words,))


def _judged(name: tuple[int, int], found: Found, network: Mapping[int, Camera]) -> Alarms:
    """Each caution of a pair of recording A, false unless other data show that it is right."""
    false: list[str] = []
    right: list[str] = []
    for caution in found[name].cautions:
        proof = _PROOFS.get(caution.code, _none)(caution, name, found, network)
        (right if proof else false).append(f"{caution.code}: {proof}" if proof else caution.code)
    return Alarms(f"A {name[0]}-{name[1]}", tuple(false), tuple(right))


Proof = Callable[[Caution, tuple[int, int], Found, Mapping[int, Camera]], str]


def _none(caution: Caution, name: tuple[int, int], found: Found, _: Mapping[int, Camera]) -> str:
    """No data could show that this is right."""
    return ""


def _late(caution: Caution, name: tuple[int, int], found: Found, _: Mapping[int, Camera]) -> str:
    """The latency that others found for this recording with other tools."""
    known = LATE_MS[name[1]] - LATE_MS[name[0]]
    told = -1e3 * found[name].right_offset_s
    allowed = float(np.hypot(LATE_WITHIN_MS, LATE_WITHIN_MS))  # each camera's is known so well
    words = f"{told:+.0f} ms, known independently {known:+.0f} ± {allowed:.0f} ms"
    return words if abs(told - known) <= allowed else ""


def _uneven(caution: Caution, name: tuple[int, int], found: Found, _: Mapping[int, Camera]) -> str:
    """How far the recording's own stamps lie off a straight line."""
    off = [1e3 * float(np.std(stamps_off_s("A", k))) for k in name]
    words = f"stamps scatter by {off[0]:.0f} and {off[1]:.0f} ms about an even rate"
    return words if max(off) > 1e3 * UNEVEN_S else ""


def _swapped(caution: Caution, name: tuple[int, int], found: Found, _: Mapping[int, Camera]) -> str:
    """Where the right camera stands by way of a third one, from two other pairs."""
    for third in set(range(4)) - set(name):
        keys = [(min(k, third), max(k, third)) for k in name]
        if not all(key in found for key in keys):
            continue
        (c_a, R_a), (c_b, _R_b) = (
            _centre_and_turn(found[key].rig, k < third) for key, k in zip(keys, name, strict=True)
        )
        x = float((R_a.T @ (c_b - c_a))[0])
        if x < 0:
            return f"by way of camera {third} it stands {-x:.0f} mm to the left"
    return ""


def _centre_and_turn(rig: StereoRig, is_left: bool) -> tuple[Floats, Floats]:
    """Centre (3,) and axes (3, 3) of one camera of a pair in the other camera's frame."""
    R, t = rig.R_right_left, rig.t_right_left_mm
    if is_left:  # the third camera is the right one: X_third = R X + t
        return t, R
    return -R.T @ t, np.asarray(R.T, dtype=np.float64)


def _halves(
    caution: Caution, name: tuple[int, int], found: Found, network: Mapping[int, Camera]
) -> str:
    """By how much a half's lens departs from what the other pairs say of the same camera."""
    worst = (0.0, "")
    for half, (lenses, sds) in _half_lenses(*(network[k].views for k in name)).items():
        for side, camera in enumerate(name):
            others = [
                (c.rig.left if key[0] == camera else c.rig.right)
                for key, c in found.items()
                if camera in key and key != name
            ]
            known = [(o.lens, np.sqrt(np.diag(o.covariance))) for o in others
                     if o.covariance is not None]  # fmt: skip
            if not known:
                continue
            lens, sd = (np.mean([k[i] for k in known], axis=0) for i in (0, 1))
            z = (lenses[side] - lens)[:4] / np.hypot(sds[side], sd)[:4]
            at = int(np.abs(z).argmax())
            if abs(z[at]) > worst[0]:
                worst = (
                    float(abs(z[at])),
                    f"the {half} half tells {LENS[at]} of camera {camera} as "
                    f"{lenses[side][at]:.1f} ± {sds[side][at]:.1f}, {len(known)} other pairs "
                    f"{lens[at]:.1f} ± {sd[at]:.1f} px ({abs(z[at]):.1f} sigma)",
                )
    return worst[1] if worst[0] > DEVIATES else ""


def _half_lenses(
    left: tuple[BoardView, ...], right: tuple[BoardView, ...]
) -> dict[str, tuple[Floats, Floats]]:
    """Both lenses (2, 6) with sigma (2, 6) from each half of the common time alone."""
    settings, pairs = CalibrationSettings(), pair_views(left, right)
    k, m = pairs[len(pairs) // 2]
    middle = (left[k].t_s, right[m].t_s)
    out = {}
    for half, first in (("first", True), ("second", False)):
        a, b = (
            [v for v in views if (v.t_s < t) == first]
            for views, t in zip((left, right), middle, strict=True)
        )
        fit = fit_all(make_pair_checked(a, b, (WEBCAM_SIZE, WEBCAM_SIZE), settings), settings).fit
        sd = np.sqrt(np.diag(uncertainty(fit.problem, fit.solution).published))[:12]
        lenses = np.array([fit.state.left.lens, fit.state.right.lens])
        out[half] = (lenses, np.asarray(sd.reshape(2, 6), dtype=np.float64))
    return out


_PROOFS: dict[str, Proof] = {
    "late-camera": _late,
    "early-camera": _late,
    "uneven-stamps": _uneven,
    "cameras-swapped": _swapped,
    "halves-contradict": _halves,
}
