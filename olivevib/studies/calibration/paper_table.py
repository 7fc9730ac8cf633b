"""Section 6.2 of the paper: Tab. 2, Fig. 15 (repeatability), Fig. 16 (sensitivity to pattern)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from olivevib.arrays import Floats
from olivevib.calibration import BoardView
from olivevib.progress import Tick
from olivevib.studies.calibration import lens_alone, scenes
from olivevib.studies.calibration.lens_alone import METHODS, Method
from olivevib.studies.calibration.recorded import WEBCAM_SIZE, there, webcams
from olivevib.studies.study import Cell, Chart, Curve, Effort, Goal, Study, Table

COUNTS = (5, 7, 10, 15, 20, 25)
ORDERS, TRIALS = 10, 20
NOISE_PX = (0.05, 0.1, 0.2)
PATTERNS = ((5, 5), (5, 4), (5, 3), (5, 2), (3, 3), (3, 2), (2, 2))
ASKED_A0 = np.array([3.0, 3.0, 2.5, 3.0])
OURS = "ours, frames of a video"  # stamps and neighbouring frames tell a rolling shutter
FALSE_MINIMUM = 0.15  # of the focal length of all views; the closed form alone is that far off


def run(effort: Effort, tick: Tick) -> Study:
    """Real recordings where they lie beside this checkout; simulation always."""
    tables, goals = [_simulated(effort, tick)], []
    if there():
        real, asked = _recorded(effort, tick)
        tables.insert(0, real)
        goals += asked
    else:
        goals.append(Goal("recordings A and C", "beside this checkout", "not there", None))
    patterns, chart = _patterns(effort, tick)
    return Study(
        name="6.2",
        title="Repeatability of the calibration (Tab. 2, Fig. 15) and patterns (Fig. 16)",
        tables=(*tables, patterns),
        charts=(chart, _fig_15(effort)),
        goals=tuple(goals),
        facts=(
            ("sets", "nested sets of 5, 7, 10, 15, 20, 25 views; sd over the six, median order"),
            ("paper", "2.71/2.53/0.82/1.64 px; Caltech toolbox 20/14.5/10/18 px"),
        ),
    )


def repeated(
    views: Sequence[BoardView],
    size_px: tuple[int, int],
    method: Method,
    orders: int,
    rng: np.random.Generator,
    nested: bool = True,
) -> Floats:
    """fx, fy, cx, cy (orders, 6 sets, 4) of random sets of the views; NaN: no camera."""
    out = np.full((orders, len(COUNTS), 4), np.nan)
    for k in range(orders):
        order = rng.permutation(len(views))
        for n, count in enumerate(COUNTS):
            pick = order[:count] if nested else rng.permutation(len(views))[:count]
            if len(views) >= count:
                out[k, n] = method([views[i] for i in pick], size_px)[:4]
    return out


def scatter(found: Floats) -> Floats:
    """Sd over the six sets, of the median order (4,)."""
    with np.errstate(invalid="ignore"):
        sd = np.nanstd(found, axis=1, ddof=1)
    return np.asarray(np.nanmedian(sd, axis=0), dtype=np.float64)


def failures(found: Floats, width: int) -> int:
    """Sets without a camera, or with a focal length outside 0.3 to 3 widths."""
    f = found[:, :, 0]
    with np.errstate(invalid="ignore"):
        return int((~np.isfinite(f) | (f < 0.3 * width) | (f > 3 * width)).sum())


def _recorded(effort: Effort, tick: Tick) -> tuple[Table, list[Goal]]:
    rows: list[tuple[Cell, ...]] = []
    goals: list[Goal] = []
    orders = effort.count(ORDERS, 2)
    failed, astray, worst = 0, 0, ("", 0.0)
    for name in ("A", "C"):
        for camera in webcams(name, tick).values():
            views = [view for view in camera.views if view.ids.size >= 8]
            if len(views) < COUNTS[-1]:
                continue
            ours = lens_alone.of_video(camera.views)
            whole = ours(views, WEBCAM_SIZE)
            methods = {
                **{f"{label}, stills": how for label, how in METHODS.items()},
                OURS: ours,
            }
            for m, (method, how) in enumerate(methods.items()):
                tick(m, len(methods), f"camera {camera.name}, {method}")
                rng = effort.draws(62, ord(name), int(camera.name[1:]))
                found = repeated(views, WEBCAM_SIZE, how, orders, rng)
                sd, fails = scatter(found), failures(found, WEBCAM_SIZE[0])
                off = np.abs(found[:, :, 0] / whole[0] - 1) > FALSE_MINIMUM
                share = 100 * float(sd[:2].max() / whole[0])
                rows.append((camera.name, method, *(round(float(v), 1) for v in sd), fails,
                             int(off.sum()), round(share, 2)))  # fmt: skip
                if method != OURS:
                    continue
                failed, astray = failed + fails, astray + int(off.sum())
                worst = max(worst, (camera.name, share), key=lambda w: w[1])
                if camera.name == "A0":
                    words = "/".join(f"{v:.1f}" for v in sd) + " px"
                    goals.append(
                        Goal(
                            "camera 0 of A", "<= 3/3/2.5/3 px", words, bool((sd <= ASKED_A0).all())
                        )
                    )
    goals += [
        Goal("sets without a camera", "0", str(failed), failed == 0),
        Goal("sets in a false minimum (focal length 15 % off)", "0", str(astray), astray == 0),
        Goal("sd of the focal length, every camera", "<= 1.2 %", f"{worst[0]} {worst[1]:.2f} %",
             worst[1] <= 1.2),
    ]  # fmt: skip
    columns = ("camera", "method", "fx", "fy", "cx", "cy", "no camera", "15 % off", "sd f %")
    note = f"sd in px over nested sets; {orders} orders x 6 sets of 5 to 25 views"
    return Table("Repeatability on recordings", columns, tuple(rows), note), goals


def _simulated(effort: Effort, tick: Tick) -> Table:
    rows: list[tuple[Cell, ...]] = []
    trials = effort.count(TRIALS, 2)
    for n, (name, (k1, k2)) in enumerate(scenes.LENSES.items()):
        lens = scenes.camera(990.0, k1, k2, (645.0, 352.0))
        for noise in NOISE_PX:
            tick(n, len(scenes.LENSES), f"simulated, lens {name}, {noise} px")
            rng = effort.draws(622, n, round(100 * noise))
            sets = [
                scenes.tilted(lens, scenes.grid(), COUNTS[-1], noise, rng) for _ in range(trials)
            ]
            pools = [scenes.tilted(lens, scenes.grid(), 60, noise, rng) for _ in range(trials)]
            for label, method, source, nested in (
                ("closed, nested", "closed form", sets, True),
                ("closed, independent", "closed form", pools, False),
                ("ours, nested", "ours", sets, True),
            ):
                how = METHODS[method]
                found = np.concatenate([
                    repeated(views, scenes.SIZE, how, 1, rng, nested) for views in source
                ])  # fmt: skip
                sd, bias = scatter(found), np.nanmedian(found[:, -1, 0]) - 990.0
                rows.append((name, noise, label, *(round(float(v), 2) for v in sd),
                             round(float(bias), 2)))  # fmt: skip
    columns = ("lens k1/k2", "noise px", "method", "fx", "fy", "cx", "cy", "bias of fx, 25 views")
    note = f"truth: 990 px, 5 x 5 points of 45 mm; median of {trials} trials"
    return Table("Repeatability in simulation", columns, tuple(rows), note)


def _fig_15(effort: Effort) -> Chart:
    lens = scenes.camera(990.0, 0.10, -0.20, (645.0, 352.0))
    rng = effort.draws(15)
    views = scenes.tilted(lens, scenes.grid(), COUNTS[-1], 0.1, rng)
    x = np.array(COUNTS, dtype=np.float64)
    curves = [
        Curve(
            method, x, repeated(views, scenes.SIZE, METHODS[method], 1, effort.draws(16))[0, :, 0]
        )
        for method in ("closed form", "ours")
    ]
    curves.append(Curve("truth", x, np.full(x.size, 990.0)))
    return Chart(
        "fig15",
        "Focal length by number of views (lens 0.10/-0.20)",
        "views",
        "fx, px",
        tuple(curves),
    )


def _patterns(effort: Effort, tick: Tick) -> tuple[Table, Chart]:
    """Robust sd of fx from ten views at 0.1 px, by pattern: fixed pitch, and fixed extent."""
    trials = effort.count(40, 4)
    rows: list[tuple[str | float, ...]] = []
    series: dict[str, list[float]] = {}
    cells = [(lens, fixed) for lens in ("none", "0.10/-0.20") for fixed in ("pitch", "extent")]
    for name, fixed in cells:
        for n, (columns, height) in enumerate(PATTERNS):
            tick(n, len(PATTERNS), f"pattern {columns} x {height}, fixed {fixed}")
            pitch = 45.0 if fixed == "pitch" else 180.0 / (columns - 1)
            found = _trials(name, scenes.grid(columns, height, pitch), trials, effort.draws(16, n))
            row: list[str | float] = [f"{columns} x {height}", f"fixed {fixed}", name]
            for method in ("closed form", "ours"):
                sd = robust_sd(found[method])
                row.append(round(sd, 1))
                series.setdefault(f"{method}, fixed {fixed}, lens {name}", []).append(sd)
            rows.append(tuple(row))
    x = np.arange(len(PATTERNS), dtype=np.float64)
    shown = [(label, values) for label, values in series.items() if "none" in label]
    curves = [Curve(label, x, np.array(values)) for label, values in shown]
    heads = ("pattern", "board", "lens", "closed form: sd of fx px", "ours: sd of fx px")
    note = f"ten views, 0.1 px, one point a marker; {trials} trials"
    table = Table("Sensitivity to the pattern", heads, tuple(rows), note)
    names = ", ".join(f"{k} = {c}x{r}" for k, (c, r) in enumerate(PATTERNS))
    chart = Chart("fig16", f"Sd of fx by pattern ({names})", "pattern", "sd of fx, px",
                  tuple(curves), log_y=True)  # fmt: skip
    return table, chart


def _trials(
    name: str, board: Floats, trials: int, rng: np.random.Generator
) -> dict[str, list[float]]:
    lens = scenes.camera(990.0, *scenes.LENSES[name], (645.0, 352.0))
    out: dict[str, list[float]] = {"closed form": [], "ours": []}
    for _ in range(trials):
        views = scenes.tilted(lens, board, 10, 0.1, rng)
        for method, values in out.items():
            values.append(float(METHODS[method](views, scenes.SIZE)[0]))
    return out


def robust_sd(values: Sequence[float]) -> float:
    """1.4826 times the median distance from the median; what is no camera counts as far off."""
    x = np.array(values)
    middle = np.nanmedian(x)
    off = np.where(np.isfinite(x), np.abs(x - middle), np.inf)
    return 1.4826 * float(np.median(off))
