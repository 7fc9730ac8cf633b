"""Units as people write them in column headers, and what quantity each of them measures."""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass

from olivevib.signals import GRAVITY_M_S2

ACCELERATION = "acceleration"
TIME = "time"
RAW = "raw"  # counts or volts: an acceleration once the sensitivity is known


@dataclass(frozen=True)
class Unit:
    """A unit: its plain name, its quantity, and its factor to m/s2 or s (1 elsewhere)."""

    name: str
    quantity: str
    factor: float = 1.0


def _table() -> dict[str, Unit]:
    spellings: dict[Unit, str] = {
        Unit("m/s2", ACCELERATION): "m/s2 m/s/s m/sec2 m/sec/sec ms-2 mps2 ms2 m/s/sec m/ss"
        " meter/s2 metre/s2 meters/s2 metres/s2 meterpersecondsquared meterspersecondsquared"
        " metrespersecondsquared meter/second2 meters/second2 metres/second2 msec-2 metri/s2"
        " m/sq.s mpss mpersec2 mpers2",
        Unit("mm/s2", ACCELERATION, 1e-3): "mm/s2 mm/s/s mm/sec2 mms-2 mmps2 mms2 mm/sec/sec",
        Unit("cm/s2", ACCELERATION, 1e-2): "cm/s2 cm/s/s cm/sec2 cms-2 cmps2 cms2 gal gals galileo",
        Unit("mgal", ACCELERATION, 1e-5): "mgal milligal",
        Unit("um/s2", ACCELERATION, 1e-6): "um/s2 um/s/s ums-2",
        Unit("ft/s2", ACCELERATION, 0.3048): "ft/s2 ft/s/s ft/sec2 fts-2 fps2 fts2 feet/s2"
        " ft/sec/sec",
        Unit("in/s2", ACCELERATION, 0.0254): "in/s2 in/s/s in/sec2 ins-2 inch/s2 inches/s2",
        Unit("g", ACCELERATION, GRAVITY_M_S2): "g gn g0 g's gs gee gees gforce g-force grav"
        " gravity gravities standardgravity",
        Unit("mg", ACCELERATION, GRAVITY_M_S2 * 1e-3): "mg milli-g millig mgn milligee"
        " milligravity",
        Unit("ug", ACCELERATION, GRAVITY_M_S2 * 1e-6): "ug micro-g microg",
        Unit("counts", RAW): "count counts cnt cnts lsb lsbs raw digit digits adc adccounts"
        " rawcounts bits rawdata adu",
        Unit("V", RAW): "v volt volts",
        Unit("mV", RAW): "mv millivolt millivolts",
        Unit("uV", RAW): "uv microvolt microvolts",
        Unit("s", TIME): "s sec secs second seconds secondi secondo sekunden sekunde secondes"
        " segundos seg",
        Unit("ms", TIME, 1e-3): "ms msec msecs millisecond milliseconds millis millisecondi"
        " millisekunden milli",
        Unit("us", TIME, 1e-6): "us usec usecs microsecond microseconds micros microsecondi",
        Unit("ns", TIME, 1e-9): "ns nsec nanosecond nanoseconds nanos",
        Unit("min", TIME, 60.0): "min mins minute minutes",
        Unit("h", TIME, 3600.0): "h hr hour hours",
        Unit("rad/s", "angular velocity"): "rad/s rad/sec rads-1 radps radians/s radian/s"
        " radians/second rads",
        Unit("deg/s", "angular velocity"): "deg/s deg/sec degs-1 dps degree/s degrees/s °/s °/sec"
        " mdps rpm degps",
        Unit("rad/s2", "angular acceleration"): "rad/s2 rad/sec2 deg/s2 °/s2 deg/sec2",
        Unit("N", "force"): "n newton newtons kn mn lbf lb lbs kgf",
        Unit("Pa", "pressure"): "pa kpa mpa hpa bar mbar psi mmhg",
        Unit("dB", "level"): "db dba dbspl",
        Unit("T", "magnetic field"): "t ut mt nt gauss mgauss microtesla tesla a/m",
        Unit("degC", "temperature"): "c °c degc celsius k kelvin °f degf f degreescelsius",
        Unit("deg", "angle"): "deg ° rad degree degrees radian radians grad",
        Unit("Hz", "frequency"): "hz khz mhz sps hertz",
        Unit("m", "displacement"): "m mm um cm nm meter meters metre metres inch ft km",
        Unit("m/s", "velocity"): "m/s mm/s um/s cm/s km/h in/s ft/s ms-1 mms-1 kmh mph m/sec"
        " mm/sec",
        Unit("m/s3", "jerk"): "m/s3 g/s ms-3",
        Unit("%", "percentage"): "% percent",
        Unit("strain", "strain"): "um/m ustrain strain ue microstrain",
        Unit("A", "current"): "a ma amp ampere",
        Unit("lux", "light"): "lux lx",
    }
    return {word: unit for unit, words in spellings.items() for word in words.split()}


_SPELLINGS = _table()
_SPECTRAL = re.compile(r"(/|per|/√|/sqrt\(?)hz\)?(-?1)?$|hz-1$|2/hz")


def plain(text: str) -> str:
    """A unit's spelling without what does not matter: case, blanks, dots, carets, superscripts."""
    text = unicodedata.normalize("NFKC", text).strip().strip("[](){}<>\"'").strip()
    text = text.replace("−", "-").replace("–", "-").replace("µ", "u").replace("μ", "u")
    text = text.replace("**", "").replace("squared", "2").replace("square", "2")
    text = re.sub(r"[\s·⋅∙•*^_.'’()]+", "", text.casefold())
    return re.sub(r"per(?=s|sec|m)", "/", text) if "per" in text else text


def parse_unit(text: str) -> Unit | None:
    """The unit that ``text`` spells, or None; a density per Hz is its own quantity, "spectrum"."""
    word = plain(text)
    if not word:
        return None
    if _SPECTRAL.search(word):
        return Unit(text.strip(), "spectrum")
    unit = _SPELLINGS.get(word)
    if unit is not None and unit.name == "mgal" and text.strip().startswith("M"):
        return None
    return unit
