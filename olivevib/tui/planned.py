"""The form of a plan, and what a recording planned like that would tell."""

from __future__ import annotations

from collections.abc import Mapping

from olivevib.errors import UsageError
from olivevib.tui.fields import Field, FieldError, number_in
from olivevib.tui.plan import BANDS, EXPOSURES, SIZES

FIELDS = (
    Field("fps", "frames/s", "30", choices=("30", "60", "120")),
    Field("readout", "readout, ms", "first to last row; 0: global", choices=("0", "10", "20")),
    Field("offset", "right late, ms", "0: in step; empty: unknown", choices=("0", "8", "10")),
    Field("frequency", "frequency, Hz", "empty: the whole band", choices=("12", "18", "25")),
    Field("amplitude", "amplitude, mm", "peak, that is expected", choices=("1", "3", "5")),
    Field("exposure", "exposure, ms", "2", choices=EXPOSURES),
    Field("marker", "marker size, mm", "outer side of the dark square", choices=SIZES),
    Field("distance", "distance, mm", "cameras to tree", choices=("1000", "1400", "2000")),
    Field("baseline", "baseline, mm", "between the cameras", choices=("300", "420", "600")),
    Field("focal_px", "focal length, px", "fx in rig.toml", choices=("600", "950", "1400")),
    Field("rows", "rows", "height of the picture", choices=("480", "720", "1080")),
    Field("seconds", "seconds", "of steady shaking", choices=("5", "10", "20")),
    Field("band", "band, Hz", "where the frequency may lie", choices=BANDS),
)
USUAL = {
    "fps": "30",
    "amplitude": "3",
    "exposure": "2",
    "marker": "60",
    "distance": "1400",
    "baseline": "420",
    "focal_px": "950",
    "rows": "720",
    "seconds": "10",
}  # as olivevib plan takes them where nothing is said


def planned_words(values: Mapping[str, str]) -> str:
    """What ``olivevib plan`` says of this plan; FieldError or UsageError where it is none."""
    from olivevib import values as typed
    from olivevib.planning import Setup, advice, outlook
    from olivevib.planning.words import frequencies, one_words, table_words

    said = {name: text.strip() for name, text in values.items() if text.strip()}
    number = {name: number_in(USUAL | said, name) for name in (*USUAL, *said) if name != "band"}
    try:
        band = typed.band(said.get("band"))
    except UsageError as error:
        raise FieldError("band", f"{said['band']!r} cannot be read.", error.remedy) from error
    try:
        setup = Setup(
            fps=number["fps"] or 0.0,
            readout_s=_seconds(number.get("readout")),
            offset_s=_seconds(number.get("offset")),
            marker_mm=number["marker"] or 0.0,
            distance_mm=number["distance"] or 0.0,
            exposure_s=1e-3 * (number["exposure"] or 0.0),
            focal_px=number["focal_px"] or 0.0,
            baseline_mm=number["baseline"] or 0.0,
            rows=int(number["rows"] or 0),
            seconds=number["seconds"] or 0.0,
            band_hz=band,
        )
        wanted = frequencies(number.get("frequency"))
        found = [outlook(setup, f, number["amplitude"] or 0.0) for f in wanted]
    except ValueError as error:
        raise UsageError(f"This cannot be planned: {error}.", "", "Correct the form.") from error
    if len(found) > 1:
        return table_words(setup, found)
    return one_words(setup, found[0], advice(setup, found[0]))


def _seconds(ms: float | None) -> float | None:
    return None if ms is None else 1e-3 * ms
