"""WAV recordings of an accelerometer on a sound input: rate from the file, unit from a person."""

from __future__ import annotations

import io

import numpy as np

from olivevib.errors import InputError
from olivevib.files.accelerometer.foreign import foreign_parser
from olivevib.files.accelerometer.record import Channel, Table


def is_wav(head: bytes) -> bool:
    """True for RIFF, RIFX and RF64 files of type WAVE."""
    return head[:4] in (b"RIFF", b"RIFX", b"RF64") and head[8:12] == b"WAVE"


def read_wav(data: bytes, source: str) -> Table:
    """Read a WAV file: whole numbers stay as they are (24 bit: shifted by 8), floats too.

    It names no unit: ``unit`` or ``per_g`` must be given, unless whole numbers show gravity.
    """
    from scipy.io import wavfile

    with foreign_parser(source, "WAV"):
        rate_hz, samples = wavfile.read(io.BytesIO(data))
        values = np.asarray(samples, dtype=np.float64).reshape(len(samples), -1)
    if values.shape[1] > 16 or not values.size:
        raise InputError(
            f"{source} holds {values.shape[1]} channels of {len(values)} samples.",
            "",
            "Export the channels of the accelerometer alone.",
        )
    names = "xyz" if values.shape[1] <= 3 else ""
    channels = tuple(
        Channel(names[k] if names else f"Channel {k + 1}", "", column)
        for k, column in enumerate(values.T)
    )
    return Table("WAV", channels, rate_hz=float(rate_hz), layout=f"WAV, {samples.dtype}")
