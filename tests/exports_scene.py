"""A small trajectory with gaps, a rig and a spectrum that the export tests share."""

from __future__ import annotations

import io

import numpy as np

from olivevib.files.exports import export
from olivevib.geometry import CameraModel, StereoRig
from olivevib.reconstruction.trajectory import ContinuousFit, Trajectory
from olivevib.signals import State
from olivevib.vibration.types import Line, LineStatus, Spectrum


def make_trajectory(n: int = 50, ids: tuple[int, ...] = (7, 2, 31), seed: int = 1) -> Trajectory:
    rng = np.random.default_rng(seed)
    m = len(ids)
    t_s = np.arange(n) * 1001 / 30000
    xyz = rng.normal(0, 200, (n, m, 3)) + np.array([0, 0, 1500])
    sample_t = np.repeat(t_s[:, None], m, axis=1) + rng.uniform(0, 0.02, m)
    state = np.zeros((n, m), dtype=np.int64)
    xyz[10:14, 0] = np.nan
    sample_t[10:14, 0] = np.nan
    state[10:14, 0] = State.HIDDEN
    state[20, 1] = State.FLAGGED
    sigma = np.where(np.isnan(xyz), np.nan, rng.uniform(0.05, 0.4, xyz.shape))
    covariance = sigma[..., None] * sigma[..., None, :] * np.eye(3)
    return Trajectory(
        t_s=t_s,
        ids=np.array(ids),
        sample_t_s=sample_t,
        xyz_mm=xyz,
        sigma_xyz_mm=sigma,
        covariance_mm2=covariance,
        rotation_rad=xyz / 1e4,
        sigma_rotation_rad=sigma / 1e3,
        state=state,
        epipolar_px=xyz[..., 0] / 1e3,
        frame="left camera",
        method="optimal",
        sigma_rig_mm=sigma / 10,  # every trajectory of a calibrated rig has it
    )


def make_fit(marker: int) -> ContinuousFit:
    return ContinuousFit(
        id=marker,
        f_hz=25.0,
        knots_s=np.arange(8.0),
        sway=np.ones((6, 8)),
        cosine=np.ones((2, 6)),
        sine=np.zeros((2, 6)),
        covariance=np.eye(25),
        t_ref_s=1.0,
        chi2=1.1,
        candidates_hz=(5.0, 25.0),
        evidence=(0.1, 0.9),
    )


def make_rig() -> StereoRig:
    camera = CameraModel((1280, 720), [[900, 0, 640], [0, 900, 360], [0, 0, 1]], np.zeros(5))
    return StereoRig(camera, camera, np.eye(3), [-420.0, 0, 0], np.eye(18))


def make_spectrum(ids: tuple[int, ...]) -> Spectrum:
    f_hz = np.linspace(0, 15, 31)
    shape = (f_hz.size, len(ids), 3)
    line = Line(
        f_hz=5.0,
        f_sigma_hz=0.01,
        status=LineStatus.AMBIGUOUS,
        candidates_hz=(5.0, 25.0, 35.0),
        amplitude=np.ones(3),
        amplitude_sigma=np.full(3, 0.1),
        phase_rad=np.zeros(3),
        t_ref_s=1.0,
        unit="mm",
        harmonics=np.empty((0, 3)),
    )
    ones = np.ones(shape)
    lines = (line,) * len(ids)
    return Spectrum(
        f_hz, np.array(ids), ones, ones / 2, "displacement", "mm", "hann", 0.5, 1.5, lines
    )


def exported(trajectory: Trajectory, to: str, **kwargs: object) -> bytes:
    stream = io.BytesIO()
    export(trajectory, to, stream, **kwargs)  # type: ignore[arg-type]
    return stream.getvalue()
