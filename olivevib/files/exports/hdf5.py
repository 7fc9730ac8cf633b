"""HDF5: one self-contained file of paths, rig and spectra that xarray opens without our code."""

from __future__ import annotations

import io
from typing import Any, BinaryIO

import h5py
import numpy as np

from olivevib.arrays import Floats
from olivevib.files.exports.facts import ExportFacts
from olivevib.geometry import LENS, RIG, CameraModel, StereoRig
from olivevib.reconstruction.trajectory import ContinuousFit, Trajectory
from olivevib.signals import State
from olivevib.vibration.types import Spectrum

Dims = tuple[str, ...]
SCHEMA = "olivevib export 1"


def write_h5(trajectory: Trajectory, facts: ExportFacts, out: BinaryIO) -> None:
    """Write the root group (paths), /rig and /spectra/QUANTITY with CF attributes and scales.

    NaN is the fill value: not seen. Layout: FORMAT.md, HDF5 export.
    """
    buffer = io.BytesIO()
    with h5py.File(buffer, "w", track_order=True) as file:
        file.attrs["Conventions"] = "CF-1.11"
        file.attrs["title"] = f"Marker paths of {facts.trial}" if facts.trial else "Marker paths"
        file.attrs["schema"] = SCHEMA
        file.attrs["frame"] = trajectory.frame
        file.attrs["method"] = trajectory.method
        _paths(file, trajectory)
        for fit in trajectory.fits:
            _fit(file.create_group(f"continuous/marker_{fit.id}", track_order=True), fit)
        if facts.rig is not None:
            _rig(file.create_group("rig", track_order=True), facts.rig)
        for spectrum in facts.spectra:
            _spectrum(file.create_group(_spectrum_name(file, spectrum)), spectrum)
    out.write(buffer.getvalue())


def _paths(group: Any, trajectory: Trajectory) -> None:
    _scale(group, "time", trajectory.t_s, "s", "time of the frame on the trial clock")
    _scale(group, "marker", trajectory.ids, "1", "marker id")
    _axes(group)
    _scale(group, "axis2", np.arange(3), "1", "second axis of a covariance")
    tm, tma = ("time", "marker"), ("time", "marker", "axis")
    _put(group, "sample_time", trajectory.sample_t_s, tm, "s", "instant at which it was seen")
    _put(group, "xyz_mm", trajectory.xyz_mm, tma, "mm", "marker centre")
    _put(group, "sigma_xyz_mm", trajectory.sigma_xyz_mm, tma, "mm", "standard deviation of xyz_mm")
    covariance = trajectory.covariance_mm2
    _put(group, "covariance_mm2", covariance, (*tma, "axis2"), "mm2", "covariance of xyz_mm")
    _put(group, "rotation_rad", trajectory.rotation_rad, tma, "rad", "rotation vector")
    sigma = trajectory.sigma_rotation_rad
    _put(group, "sigma_rotation_rad", sigma, tma, "rad", "standard deviation of rotation_rad")
    _put(group, "epipolar_px", trajectory.epipolar_px, tm, "px", "signed epipolar distance")
    _put(group, "state", trajectory.state.astype(np.int8), tm, "1", "why a sample is there or not")
    state = group["state"]
    state.attrs["flag_values"] = np.array([int(s) for s in State], dtype=np.int8)
    state.attrs["flag_meanings"] = " ".join(s.word for s in State)


def _fit(group: Any, fit: ContinuousFit) -> None:
    _scale(group, "knot", fit.knots_s, "s", "knots of the sway spline")
    _names(group, "component", ("x", "y", "z", "rx", "ry", "rz"))
    _scale(group, "harmonic", np.arange(1, len(fit.cosine) + 1), "1", "multiple of f_hz")
    for name in ("parameter", "parameter2"):
        _scale(group, name, np.arange(len(fit.covariance)), "1", "f_hz, cosine, sine")
    what = "mm and rad"
    _put(group, "sway", fit.sway, ("component", "knot"), what, "coefficients of the sway spline")
    _put(group, "cosine", fit.cosine, ("harmonic", "component"), what, "cosine amplitudes")
    _put(group, "sine", fit.sine, ("harmonic", "component"), what, "sine amplitudes")
    _put(group, "covariance", fit.covariance, ("parameter", "parameter2"), "", "covariance")
    for name in ("f_hz", "t_ref_s", "chi2"):
        group.attrs[name] = getattr(fit, name)
    group.attrs["marker"] = fit.id
    group.attrs["candidates_hz"] = np.array(fit.candidates_hz, dtype=np.float64)
    group.attrs["evidence"] = np.array(fit.evidence, dtype=np.float64)


def _rig(group: Any, rig: StereoRig) -> None:
    for side, camera in (("left", rig.left), ("right", rig.right)):
        _camera(group.create_group(side, track_order=True), camera)
    for name, size in (("row", 3), ("column", 3), ("column4", 4)):
        _scale(group, name, np.arange(size), "1", "index of a matrix")
    _put(group, "R_right_left", rig.R_right_left, ("row", "column"), "1", "left to right camera")
    _put(group, "t_right_left_mm", rig.t_right_left_mm, ("row",), "mm", "left to right camera")
    left, right = rig.projection_matrices()
    _put(group, "P_left", left, ("row", "column4"), "", "perspective projection matrix")
    _put(group, "P_right", right, ("row", "column4"), "", "perspective projection matrix")
    _covariance(group, RIG, rig.covariance)


def _camera(group: Any, camera: CameraModel) -> None:
    for name in ("row", "column"):
        _scale(group, name, np.arange(3), "1", "index of a matrix")
    _names(group, "coefficient", ("k1", "k2", "p1", "p2", "k3"))
    _put(group, "K", camera.K, ("row", "column"), "px", "camera matrix")
    _put(group, "distortion", camera.distortion, ("coefficient",), "1", "OpenCV's order")
    group.attrs["size_px"] = np.array(camera.size_px, dtype=np.int64)
    group.attrs["row_time_s"] = camera.row_time_s
    group.attrs["row_time_sigma_s"] = camera.row_time_sigma_s
    group.attrs["row_time_source"] = camera.row_time_source
    _covariance(group, LENS, camera.covariance)


def _covariance(group: Any, names: Dims, covariance: Floats | None) -> None:
    if covariance is None:
        return
    _names(group, "parameter", names)
    _names(group, "parameter2", names)
    _put(group, "covariance", covariance, ("parameter", "parameter2"), "", "covariance")


def _spectrum_name(file: Any, spectrum: Spectrum) -> str:
    """spectra/QUANTITY; of a second phase spectra/QUANTITY_PHASE."""
    name = f"spectra/{spectrum.quantity}"
    return f"{name}_{spectrum.phase}" if name in file else name


def _spectrum(group: Any, spectrum: Spectrum) -> None:
    unit = spectrum.unit
    for name in ("quantity", "unit", "window", "resolution_hz", "enbw_bins", "phase"):
        group.attrs[name] = getattr(spectrum, name)
    _scale(group, "f_hz", spectrum.f_hz, "Hz", "frequency")
    _scale(group, "marker", spectrum.ids, "1", "marker id")
    _axes(group)
    fma, ma = ("f_hz", "marker", "axis"), ("marker", "axis")
    _put(group, "amplitude", spectrum.amplitude, fma, unit, "peak amplitude spectrum")
    _put(group, "psd", spectrum.psd, fma, f"({unit})2/Hz", "power spectral density")
    lines = spectrum.lines
    line_hz = np.array([line.f_hz for line in lines])
    line_sigma = np.array([line.f_sigma_hz for line in lines])
    _put(group, "line_hz", line_hz, ("marker",), "Hz", "dominant line; see line_status")
    _put(group, "line_sigma_hz", line_sigma, ("marker",), "Hz", "standard deviation of line_hz")
    status = np.array([line.status.value for line in lines], dtype=object)
    _put(group, "line_status", status, ("marker",), "1", "how far line_hz is known")
    if not lines:
        return
    amplitude = np.array([line.amplitude for line in lines])
    sigma = np.array([line.amplitude_sigma for line in lines])
    phase = np.array([line.phase_rad for line in lines])
    _put(group, "line_amplitude", amplitude, ma, unit, "peak amplitude of the line")
    _put(group, "line_amplitude_sigma", sigma, ma, unit, "its standard deviation")
    _put(group, "line_phase_rad", phase, ma, "rad", "phase at line_t_ref_s")
    t_ref = np.array([line.t_ref_s for line in lines])
    _put(group, "line_t_ref_s", t_ref, ("marker",), "s", "reference time of the phases")
    _candidates(group, spectrum)


def _candidates(group: Any, spectrum: Spectrum) -> None:
    width = max(len(line.candidates_hz) for line in spectrum.lines)
    if not width:
        return
    table = np.full((len(spectrum.lines), width), np.nan)
    for row, line in zip(table, spectrum.lines, strict=True):
        row[: len(line.candidates_hz)] = line.candidates_hz
    _scale(group, "candidate", np.arange(width), "1", "number of the candidate")
    dims = ("marker", "candidate")
    _put(group, "line_candidates_hz", table, dims, "Hz", "frequencies that remain possible")


def _axes(group: Any) -> None:
    _names(group, "axis", ("x", "y", "z"))


def _names(group: Any, name: str, words: Dims) -> None:
    _scale(group, name, np.array(words, dtype=object), "", f"names along {name}")


def _scale(group: Any, name: str, values: Any, unit: str, long_name: str) -> None:
    dataset = _dataset(group, name, values)
    dataset.make_scale(name)
    _describe(dataset, unit, long_name)


def _put(group: Any, name: str, values: Any, dims: Dims, unit: str, long_name: str) -> None:
    """A dataset whose dimensions are the scales ``dims``; compressed where it is worth it."""
    dataset = _dataset(group, name, values)
    for k, dim in enumerate(dims):
        dataset.dims[k].attach_scale(group[dim])
    _describe(dataset, unit, long_name)


def _dataset(group: Any, name: str, values: Any) -> Any:
    if values.dtype == object:
        return group.create_dataset(name, data=values, dtype=h5py.string_dtype())
    fill = {"fillvalue": np.nan} if values.dtype == np.float64 else {}
    if values.size < 1000:
        return group.create_dataset(name, data=values, **fill)
    return group.create_dataset(
        name,
        data=values,
        chunks=True,
        shuffle=True,
        compression="gzip",
        compression_opts=4,
        fletcher32=True,
        **fill,
    )


def _describe(dataset: Any, unit: str, long_name: str) -> None:
    if unit:
        dataset.attrs["units"] = unit
    dataset.attrs["long_name"] = long_name
