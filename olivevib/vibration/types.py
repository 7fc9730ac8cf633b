"""Spectra, spectral lines and what is known of their true frequency."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from math import nan
from typing import Any

import numpy as np

from olivevib.arrays import Floats, Ints, floats, ints

CRYSTAL = 50e-6  # relative standard deviation of a camera's own clock, which no picture shows


class LineStatus(StrEnum):
    """How far the frequency of a line is known; never print a frequency without it.

    ``direct``: the sampling rate exceeds twice the declared band, no alias exists. ``confirmed``,
    ``supported``: decided by sampling-time evidence. ``ambiguous``: candidates remain. ``blind``:
    the motion looks like sway at this frame rate. ``chirp``: speed changes too fast. ``aliased``:
    no usable stamps, row time or fit to decide. ``none``: no line stands out of the noise.
    """

    DIRECT = "direct"
    CONFIRMED = "confirmed"
    SUPPORTED = "supported"
    AMBIGUOUS = "ambiguous"
    BLIND = "blind"
    CHIRP = "chirp"
    ALIASED = "aliased"
    NONE = "none"


@dataclass(frozen=True)
class Line:
    """The dominant line of one marker: frequency, amplitudes (peak) and phases of its three axes.

    f_hz is the frequency at which the line was fitted (NaN for status none); where the status is
    ambiguous or aliased it is only the lowest of ``candidates_hz``. amplitude, sigma, phase_rad
    (3,): peak, in ``unit``; x(t) = amplitude cos(2 pi f (t - t_ref_s) + phase).
    harmonics: amplitudes (H, 3) at 2f, 3f, …; probabilities of the candidates or empty.
    reasons: why this status, in words a technician understands.
    """

    f_hz: float
    f_sigma_hz: float
    status: LineStatus
    candidates_hz: tuple[float, ...]
    amplitude: Floats
    amplitude_sigma: Floats
    phase_rad: Floats
    t_ref_s: float
    unit: str
    harmonics: Floats
    probabilities: tuple[float, ...] = ()
    reasons: tuple[str, ...] = ()

    @property
    def f_clock_sigma_hz(self) -> float:
        """What the camera's crystal may add to f_sigma_hz: common to all markers and trials."""
        return CRYSTAL * self.f_hz

    @property
    def f_total_sigma_hz(self) -> float:
        """Of the fit and of the camera's own clock together."""
        return float(np.hypot(self.f_sigma_hz, self.f_clock_sigma_hz))

    def __post_init__(self) -> None:
        for name in ("amplitude", "amplitude_sigma", "phase_rad"):
            object.__setattr__(self, name, floats(name, getattr(self, name), (3,), nan=True))
        harmonics = floats("harmonics", self.harmonics, (None, 3), nan=True)
        object.__setattr__(self, "harmonics", harmonics)


@dataclass(frozen=True)
class Spectrum:
    """One-sided spectra of all markers on one frequency grid, with the dominant line of each.

    f_hz (F,); ids (M,); amplitude (F, M, 3) peak in ``unit``; psd (F, M, 3) in unit²/Hz;
    window name, resolution_hz (bin spacing), enbw_bins (equivalent noise bandwidth);
    lines (M,): the dominant line of each marker, with its status. phase: the part of the trial,
    from start_s to end_s. Velocity and acceleration are NaN where aliases may lie in the band.
    """

    f_hz: Floats
    ids: Ints
    amplitude: Floats
    psd: Floats
    quantity: str
    unit: str
    window: str
    resolution_hz: float
    enbw_bins: float
    lines: tuple[Line, ...]
    phase: str = "whole"
    start_s: float = nan
    end_s: float = nan

    def __post_init__(self) -> None:
        f_hz = floats("f_hz", self.f_hz, (None,))
        ids = ints("ids", self.ids, (None,))
        shape = (f_hz.size, ids.size, 3)
        object.__setattr__(self, "f_hz", f_hz)
        object.__setattr__(self, "ids", ids)
        object.__setattr__(self, "amplitude", floats("amplitude", self.amplitude, shape, nan=True))
        object.__setattr__(self, "psd", floats("psd", self.psd, shape, nan=True))
        if len(self.lines) != ids.size:
            raise ValueError(f"need one line a marker, got {len(self.lines)} for {ids.size}")

    def to_dataframe(self) -> Any:
        """One row a marker and frequency, markers in their order (pandas).

        Columns f_hz, marker, x, y, z (peak amplitude in ``unit``), psd_x, psd_y, psd_z (unit²/Hz).
        """
        import pandas as pd

        bins, markers = self.f_hz.size, self.ids.size
        table = {"f_hz": np.tile(self.f_hz, markers), "marker": np.repeat(self.ids, bins)}
        for name, values in (("", self.amplitude), ("psd_", self.psd)):
            for k, axis in enumerate("xyz"):
                table[f"{name}{axis}"] = values[:, :, k].T.ravel()
        return pd.DataFrame(table)

    def to_xarray(self) -> Any:
        """Amplitude and density with named axes frequency, marker, axis (xarray.Dataset).

        Units stand in the attributes; each marker has the status of its dominant line. Needs the
        package xarray, which olivevib does not install.
        """
        import xarray as xr

        fma = ("frequency", "marker", "axis")
        data = {
            "amplitude": (fma, self.amplitude, {"units": self.unit}),
            "psd": (fma, self.psd, {"units": f"({self.unit})2/Hz"}),
            "line_frequency": ("marker", [line.f_hz for line in self.lines], {"units": "Hz"}),
            "line_status": ("marker", np.array([str(line.status) for line in self.lines], "U")),
        }
        coords = {
            "frequency": ("frequency", self.f_hz, {"units": "Hz"}),
            **{"marker": self.ids, "axis": ["x", "y", "z"]},
        }
        facts = {"quantity": self.quantity, "window": self.window, "phase": self.phase}
        return xr.Dataset(data, coords, facts)
