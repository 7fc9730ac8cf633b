"""The gain of the fine detector on markers that move while the shutter is open.

Markers are rendered at several phases of a sine with exposures whose sub-exposures are taken at
their mid-points; the fundamental of where they are found, over the true amplitude, is the gain.
"""

from __future__ import annotations

import numpy as np

from olivevib.arrays import Floats
from olivevib.detection.exposure_gain import BLUR, GAIN, SIGMA, SIZES_PX
from olivevib.detection.template_reader import TemplateReader
from olivevib.geometry import CameraModel, rotation_from_vector
from olivevib.marker import MarkerLibrary, load_library
from olivevib.progress import Tick
from olivevib.simulation.motion import Motion, Sway
from olivevib.simulation.planar import marker_planar
from olivevib.simulation.render import Renderer
from olivevib.simulation.scene import Body, Camera, Optics, Scene
from olivevib.simulation.surroundings import Surroundings
from olivevib.studies.study import Chart, Curve, Effort, Goal, Study, Table

F_PX, Z_MM, SIZE = 950.0, 1400.0, (176, 160)
F_HZ = 25.0
PHASES = 24
MARKERS = 12  # draws of code, size, tilt and direction of motion


def run(effort: Effort, tick: Tick) -> Study:
    """Measure the gain table again and compare it with the one in use."""
    library = load_library("olive49")
    reader = TemplateReader(library)
    draws = effort.count(MARKERS)
    cells = [(b, a) for b in range(len(BLUR)) for a in range(len(SIZES_PX))]
    found = np.full((len(BLUR), len(SIZES_PX), draws), np.nan)
    third = found.copy()
    for k, (b, a) in enumerate(cells):
        for d in range(draws):
            tick(k * draws + d, len(cells) * draws, f"f E = {BLUR[b]:g}, {SIZES_PX[a]:g} px")
            found[b, a, d], third[b, a, d] = _cell(
                library, reader, BLUR[b], SIZES_PX[a], effort.draws(7, d)
            )
    tick(1, 1, "gains")
    return _study(found, third, draws)


def _cell(
    library: MarkerLibrary,
    reader: TemplateReader,
    blur: float,
    size_px: float,
    rng: np.random.Generator,
) -> tuple[float, float]:
    """Gain of the fundamental and size of the third harmonic, of the true amplitude."""
    marker = int(rng.choice(library.ids))
    angle, tilt = rng.uniform(0, np.pi), np.radians(rng.uniform(0, 35, 2))
    psf, noise = rng.uniform(0.6, 0.9), int(rng.integers(1 << 20))
    planar = marker_planar("olive49", marker, rng.uniform(45, 75), library)
    along = np.array([np.cos(angle), np.sin(angle)]) * size_px
    motion = np.concatenate([along * Z_MM / F_PX, np.zeros(4)])
    K = np.array([[F_PX, 0, SIZE[0] / 2], [0, F_PX, SIZE[1] / 2], [0, 0, 1]])
    optics = Optics(psf_px=psf, exposure_s=blur / F_HZ, step_px=0.25)
    camera = Camera(CameraModel(SIZE, K, np.zeros(5), 0.0, 0.0, "global"), optics)
    R0 = rotation_from_vector([tilt[0], tilt[1], 0.0])
    place = np.array([*rng.uniform(-1, 1, 2), Z_MM])
    body = Body(planar, R0, place, Motion((Sway(F_HZ, motion, np.zeros(6)),)))
    still = Body(planar, R0, place)
    renderer = Renderer(Scene(camera, camera, (body,), Surroundings(), noise), "left")
    times = np.arange(PHASES) / PHASES / F_HZ
    seen = np.array([_centre(reader, renderer, n, t, body) for n, t in enumerate(times)])
    rest = camera.project(still.points_mm(0.0, np.zeros((1, 2)))[0])[0]
    true = (camera.project(body.points_mm(0.25 / F_HZ, np.zeros((1, 2)))[0])[0]) - rest
    along_px = (seen - rest) @ true / float(true @ true)
    return _waves(times, along_px)


def _waves(t_s: Floats, along: Floats) -> tuple[float, float]:
    """Sine of the fundamental and size of the third harmonic, over the frames that were read."""
    turn = 2 * np.pi * F_HZ * t_s[:, None] * np.arange(1, 4)
    basis = np.hstack([np.ones((t_s.size, 1)), np.sin(turn), np.cos(turn)])
    good = np.isfinite(along)
    if good.sum() < 2 * basis.shape[1]:
        return float("nan"), float("nan")
    found = np.linalg.lstsq(basis[good], along[good], rcond=None)[0]
    return float(found[1]), float(np.hypot(found[3], found[6]))


def _centre(
    reader: TemplateReader, renderer: Renderer, number: int, t_s: float, body: Body
) -> Floats:
    found = reader.detect(renderer.frame(number, float(t_s), (body,)))
    return found[0].centre_px if len(found) == 1 else np.full(2, np.nan)


def _study(found: Floats, third: Floats, draws: int) -> Study:
    gain, scatter = np.nanmean(found, axis=2), np.nanstd(found, axis=2)
    kept = np.array(GAIN)
    worst = float(np.abs(gain - kept).max())
    sigma = np.array(SIGMA)[:, None]
    largest = float((np.abs(gain - kept) / sigma).max())
    cells = [(b, a) for b in range(len(BLUR)) for a in range(len(SIZES_PX))]
    measured = (gain, scatter, kept, np.nanmean(third, axis=2))
    rows = tuple(
        (BLUR[b], SIZES_PX[a], *(_r(v) for v in (np.sinc(BLUR[b]), *(m[b, a] for m in measured))))
        for b, a in cells
    )
    columns = ("f E", "amplitude px", "sinc(f E)", "gain", "scatter", "in use", "third harmonic")
    curves = [Curve(f"{size:g} px", np.array(BLUR), gain[:, a]) for a, size in enumerate(SIZES_PX)]
    fine = np.linspace(0, BLUR[-1], 40)
    curves.append(Curve("mean of the motion", fine, np.asarray(np.sinc(fine))))
    at = float(np.interp(22.0 * 0.006, BLUR, gain.mean(axis=1)))
    in_use = float(np.interp(22.0 * 0.006, BLUR, kept.mean(axis=1)))
    share = abs(at / in_use - 1)
    return Study(
        name="exposure",
        title="What the exposure takes from an amplitude: gain of the fine detector",
        tables=(Table("Gain by blur and amplitude", columns, rows),),
        charts=(Chart("gain", "Gain", "frequency x exposure", "gain", tuple(curves)),),
        goals=(
            Goal(
                "the table in use is that measured here",
                "within 4 of its sigmas",
                f"worst {worst:.4f}, {largest:.1f} sigmas",
                largest <= 4 if draws >= MARKERS else None,
            ),
            Goal(
                "amplitude at 6 ms and 22 Hz (f E = 0.13), corrected",
                "within 5 %",
                f"{100 * share:.2f} % (uncorrected {100 * abs(at - 1):.1f} %)",
                share <= 0.05,
            ),
        ),
        facts=(("markers a cell", str(draws)), ("phases a marker", str(PHASES))),
    )


def _r(value: float | np.floating) -> float:
    return round(float(value), 4)
