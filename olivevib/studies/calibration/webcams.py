"""Recording A: distances on unused frames, hidden latency of a network, halves of A and C."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from olivevib.arrays import Floats
from olivevib.calibration import Calibration, calibrate
from olivevib.progress import Tick
from olivevib.studies.calibration.recorded import WEBCAM_SIZE, Camera, there, webcams
from olivevib.studies.study import Effort, Goal, Study, Table

PAIRS = tuple(combinations(range(4), 2))
CORNERS = {(0, 2): 0.32, (0, 3): 0.42, (2, 3): 0.70}
STEREO_PX = {(0, 1): 0.35, (0, 3): 0.35, (0, 2): 0.45}
LATE_MS = (0.0, 128.0, -27.0, -27.0)


def run(effort: Effort, tick: Tick) -> Study:
    """Calibrate all six pairs of recording A (and the sound ones of C); nothing is drawn."""
    if not there():
        return _absent()
    network = webcams("A", tick)
    pairs = PAIRS if effort.share >= 0.5 else ((0, 2), (0, 3), (2, 3))
    found = {}
    for n, (a, b) in enumerate(pairs):
        tick(n, len(pairs), f"pair {a}-{b}")
        found[a, b] = pair(network[a], network[b])
    halves = [("A", name, result) for name, result in found.items()]
    if effort.share >= 0.5:
        other = webcams("C", tick)
        halves.append(("C", (0, 2), pair(other[0], other[2])))
    goals = [*_distance_goals(found), *_latency_goals(found), *_halves_goals(halves)]
    return Study(
        name="calibration-webcams",
        title="Calibration of four webcams in a public recording, on frames that were not used",
        tables=(_distances(found), _latencies(found), _halves(halves)),
        goals=tuple(goals),
        facts=(("recording", "webcam4_charuco_A and C, 1280 x 720, 6 frames/s"),),
    )


def _absent() -> Study:
    goal = Goal("recordings", "beside this checkout", "not there: nothing measured", None)
    return Study("calibration-webcams", "Calibration of four webcams", (), goals=(goal,))


def pair(left: Camera, right: Camera) -> Calibration:
    """The calibration of two webcams."""
    return calibrate(left.views, right.views, WEBCAM_SIZE, WEBCAM_SIZE)


def stereo_rms_px(result: Calibration) -> float:
    """Rms distance of all points of common views, both cameras, px (OpenCV's convention)."""
    shared = result.poses.frame[result.poses.both]
    r = result.residuals
    mine = (r.weight > 0) & ((r.camera == 1) | np.isin(r.frame, shared))
    return float(np.sqrt((r.residual_px[mine] ** 2).sum(axis=1).mean()))


Found = dict[tuple[int, int], Calibration]


def _distances(found: Found) -> Table:
    rows = []
    for (a, b), c in found.items():
        h = c.holdout
        if h is not None:
            rows.append((
                f"{a}-{b}", h.frames, h.pairs, round(h.usable, 3), round(h.rms_mm, 3),
                round(h.rms_percent, 3), round(h.epipolar_rms_px, 3), round(h.rms_z, 2),
                round(stereo_rms_px(c), 3),
            ))  # fmt: skip
    columns = (
        *("pair", "test frames", "distances", "usable", "rms mm", "rms %", "epipolar px"),
        *("rms z", "stereo rms px"),
    )
    return Table("Rigid distances on unused frames", columns, tuple(rows))


def _distance_goals(found: Found) -> list[Goal]:
    out = []
    for name, most in CORNERS.items():
        h = found[name].holdout if name in found else None
        if h is not None:
            what = f"corner distances {name[0]}-{name[1]}"
            out.append(Goal(what, f"<= {most} %", f"{h.rms_percent:.2f} %", h.rms_percent <= most))
    for name, px in STEREO_PX.items():
        if name in found:
            rms = stereo_rms_px(found[name])
            what = f"stereo rms {name[0]}-{name[1]}"
            out.append(Goal(what, f"<= {px} px", f"{rms:.3f} px", rms <= px))
    return out


def network_ms(found: Found) -> Floats:
    """How late each of the four cameras is against camera 0, ms, by weighted least squares (4,)."""
    A, y = [], []
    for (a, b), c in found.items():
        weight = 1 / max(1e3 * c.right_offset_sigma_s, 0.3)
        row = np.zeros(4)
        row[b], row[a] = weight, -weight
        A.append(row)
        y.append(-1e3 * c.right_offset_s * weight)
    late = np.linalg.lstsq(np.array(A)[:, 1:], np.array(y), rcond=None)[0]
    return np.concatenate([[0.0], late])


def loops_ms(found: Found) -> list[tuple[str, float, float]]:
    """Every triangle: its name, how far it fails to close, ms, and the sigma of that."""
    out = []
    for a, b, c in combinations(range(4), 3):
        legs = [(a, b), (b, c), (a, c)]
        if all(leg in found for leg in legs):
            lag = [-1e3 * found[leg].right_offset_s for leg in legs]
            sigma = 1e3 * np.linalg.norm([found[leg].right_offset_sigma_s for leg in legs])
            out.append((f"{a}-{b}-{c}", lag[0] + lag[1] - lag[2], float(sigma)))
    return out


def _latencies(found: Found) -> Table:
    rows = [
        (f"{a}-{b}", round(-1e3 * c.right_offset_s, 1), round(1e3 * c.right_offset_sigma_s, 2))
        for (a, b), c in found.items()
    ]
    rows += [
        (f"loop {name}", round(gap, 1), round(sigma, 2)) for name, gap, sigma in loops_ms(found)
    ]
    if len(found) == len(PAIRS):
        rows += [
            (f"network, camera {k}", round(float(v), 1), float("nan"))
            for k, v in enumerate(network_ms(found))
        ]
    return Table("How late the right camera is", ("pair", "late ms", "sigma ms"), tuple(rows))


def _latency_goals(found: Found) -> list[Goal]:
    loops = [abs(gap) for _, gap, _ in loops_ms(found)]
    if len(found) < len(PAIRS) or not loops:
        return [Goal("latency as one network", "128, -27, -27 ms +- 10", "not measured", None)]
    late = network_ms(found)
    worst = float(np.abs(late - LATE_MS)[1:].max())
    words = ", ".join(f"{v:+.0f}" for v in late[1:]) + " ms"
    return [
        Goal("latency as one network", "+128, -27, -27 ms +- 10", words, worst <= 10),
        Goal("loops close", "<= 10 ms", f"{max(loops):.1f} ms", max(loops) <= 10),
    ]


def _halves(halves: list[tuple[str, tuple[int, int], Calibration]]) -> Table:
    rows = []
    for name, (a, b), c in halves:
        for half in c.halves:
            rows.append((
                f"{name} {a}-{b}", half.name, round(half.largest_z, 2), half.parameter,
                round(half.focal_percent, 2), round(half.rms_z, 2),
            ))  # fmt: skip
    columns = ("pair", "halves", "largest z", "of", "focal length %", "rms z")
    return Table("Halves against each other", columns, tuple(rows))


def _halves_goals(halves: list[tuple[str, tuple[int, int], Calibration]]) -> list[Goal]:
    tests = [(c, half) for _, _, c in halves for half in c.halves]
    if not tests:
        return []
    rms = float(np.sqrt(np.mean([half.rms_z**2 for _, half in tests])))
    focal = max(half.focal_percent for _, half in tests)
    beyond = [c for c, half in tests if half.largest_z > 3]
    warned = [c for c in beyond if "halves-contradict" in {x.code for x in c.cautions}]
    return [
        Goal("halves and even/odd, rms z", "0.8-1.3", f"{rms:.2f}", 0.8 <= rms <= 1.3),
        Goal("worst focal difference", "<= 2.5 %", f"{focal:.1f} %", focal <= 2.5),
        Goal(
            "beyond 3 sigma: warned",
            "all",
            f"{len(warned)} of {len(beyond)}",
            len(warned) == len(beyond),
        ),
    ]
