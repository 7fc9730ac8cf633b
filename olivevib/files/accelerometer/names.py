"""What a column's name says: quantity, axis, unit; in the words of loggers and of people."""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass

from olivevib.files.accelerometer.units import ACCELERATION, RAW, TIME, Unit, parse_unit

_BRACKET = re.compile(r"^(.*?)\s*[\[({<]\s*(.*?)\s*[\])}>]?\s*$", re.DOTALL)
_IN = re.compile(r"^(.*\S)\s+(?:in|as|-|–)\s+(\S.*)$")
_PARTS = re.compile(r"[^\W_]+|[/°²³^*⁻\-]+")
_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")
_FUSED = re.compile(
    r"^(a|acc|accel|acceleration|accelerometer|g|gf|gforce|gyr|gyro|gyroscope|w|m|mag|lin|lacc|"
    r"linacc|q|roll|v|vel|d|e|b|ch|axis|achse|asse|axe|eje|)(x|y|z)(\d*)(axis|achse)?$"
)
_REVERSED = re.compile(r"^(x|y|z)(acc|accel|acceleration|gyr|gyro|mag|axis|achse|acel)(\d*)$")

# The first word list that matches decides, so the more special ones stand first.
_WORDS: tuple[tuple[str, str], ...] = (
    ("spectrum", r"psd|asd|spectr\w*|fft|frf|transferfunction"),
    ("frequency", r"freq\w*|frequenz|frequenza"),
    (
        "magnitude",
        r"magnitude|abs|absolute|absolut|total|norm|modulus|modulo|resultant\w*|risultante|betrag|vm|svm|"
        r"vectorsum|vector|sum|rms|peak|amag|accmag|accelmag|enmo",
    ),
    ("gyroscope", r"gyr\w*|giro\w*|rotation\w*|angular|omega|turnrate|dreh\w*"),
    ("magnetometer", r"magnet\w*|magfield|compass|mfield|bfield"),
    (
        "orientation",
        r"quat\w*|euler|orientation|azimuth|pitch|roll|yaw|attitude|angle|tilt|incl\w*",
    ),
    ("gravity", r"gravity|gravita\w*|gravit|grav|schwerkraft"),
    ("linear acceleration", r"lin|linear\w*|useracc\w*|user|lineare|lacc|linacc"),
    ("force", r"force|forza|kraft|fuerza|load|hammer|impulse|newton\w*|hamm\w*"),
    ("sound pressure", r"mic|microphone|pressure|sound\w*|druck|schalldruck|pressione|noise"),
    ("velocity", r"vel|velocity|velocita|speed|geschwindigkeit|velocidad"),
    ("displacement", r"disp|displ|displacement|spostamento|weg|position|pos|laser"),
    ("strain", r"strain|dehnung"),
    ("temperature", r"temp|temperature|temperatura|temperatur|tmp"),
    ("voltage", r"volt\w*|vbat|vcc|batt\w*|batteria|supply|soc"),
    ("acceleration", r"acc\w*|accel\w*|beschl\w*|acel\w*|vib|vibration\w*|gforce|gf"),
)
_QUANTITIES = tuple((name, re.compile(rf"^(?:{words})\d*$")) for name, words in _WORDS)
_TIME_WORDS = re.compile(
    r"^(time|timestamp\w*|times|tempo|zeit\w*|temps|tiempo|t|elapsed|datetime|date|datum|data|clock|"
    r"epoch|uhrzeit|stamp|ora|hora|heure|millis|micros|seconds|secs|sec|rtc|utc|ts)\d*$"
)
_INDEX_WORDS = re.compile(
    r"^(count|counter|index|idx|sample|samples|n|no|nr|num|number|row|id|seq|sequence|i|line|"
    r"packet|frame|step|loop)$"
)


@dataclass(frozen=True)
class Meaning:
    """What a column is: quantity ("acceleration", "time", "gyroscope", "unknown", …), axis
    ("x", "y", "z" or ""), unit, and the group of columns it belongs to (its name without the axis).
    """

    name: str
    quantity: str
    axis: str
    unit: Unit | None
    unit_text: str
    group: str
    says_acceleration: bool  # the name or unit itself says so; else it is only an axis letter


def split_unit(name: str) -> tuple[str, str]:
    """A header cell as (name, unit): ``X (g)``, ``Acc X [m/s²]``, ``time_us``, ``ax in mg``."""
    name = name.strip().strip("\"'").strip()
    match = _BRACKET.match(name)
    if match and match[2] and (parse_unit(match[2]) or not _worded(match[2])):
        return match[1].strip(" _,;:"), match[2]
    match = _IN.match(name)
    if match and parse_unit(match[2]):
        return match[1], match[2]
    return _split_suffix(name)


def _worded(text: str) -> bool:
    """True where a bracket holds words, as in ``Acceleration (Trigger)``, and not a unit."""
    return bool(re.fullmatch(r"[\w\s.\-]*", text)) and not re.search(r"\d$|[²³]", text)


def _split_suffix(name: str) -> tuple[str, str]:
    """The unit at the end of ``acc_x_m_s2``, ``X, g``, ``time/s``; the longest spelling wins."""
    starts = [m.start() for m in re.finditer(r"(?<=[\s_,;/:.\-])[^\s_,;:]", name)]
    for start in starts:
        head, tail = name[:start].rstrip(" _,;/:.-"), name[start:]
        unit = parse_unit(tail)
        if head and unit and (len(tail.strip()) > 1 or tail in "gGs"):
            return head, tail
    return name, ""


def meaning(name: str, unit_text: str = "") -> Meaning:
    """What a column called ``name`` (unit given apart, or within the name) holds."""
    stem, own_unit = split_unit(name)
    unit_text = own_unit or unit_text.strip()
    if _is_time_itself(stem):
        stem, unit_text = "time", unit_text or (stem if parse_unit(stem) else "")
    unit = parse_unit(unit_text)
    words = _words(stem)
    axis, words = _axis(words)
    quantity = _quantity(words, axis)
    if unit is None and not unit_text and _is_g_force(stem):
        unit_text, unit, quantity = "g", parse_unit("g"), quantity or ACCELERATION
    said = quantity == ACCELERATION or (unit is not None and unit.quantity == ACCELERATION)
    return Meaning(
        name=name.strip(),
        quantity=_settle(quantity, unit, unit_text, words, axis),
        axis=axis,
        unit=unit,
        unit_text=unit_text,
        group=" ".join(words),
        says_acceleration=said or quantity == "linear acceleration",
    )


def _is_time_itself(stem: str) -> bool:
    """True for ``ms``, ``millis`` and for LabVIEW's ``X_Value``, which is the abscissa."""
    unit = parse_unit(stem)
    return (unit is not None and unit.quantity == TIME) or bool(
        re.fullmatch(r"(?i)x[_ ]?values?", stem)
    )


def _words(stem: str) -> list[str]:
    text = unicodedata.normalize("NFKD", stem)
    text = "".join(c for c in text if not unicodedata.combining(c))
    text = re.sub(r"(?i)without\s+gravity|w/o\s+gravity|ohne\s+g\b", "linear", text)
    text = re.sub(r"(?i)\b(including|with|incl\.?|mit)\s+(gravity|g)\b", "", text)
    if _is_g_force(text):
        text = re.sub(r"(?i)^g[\s_-]?f(?:orce)?", "gforce ", text)
    parts = (piece for part in re.findall(r"[^\W_]+", text) for piece in _CAMEL.split(part))
    return [part.casefold() for part in parts]


def _is_g_force(stem: str) -> bool:
    return bool(re.match(r"(?i)^g[\s_-]?f(orce)?[\s_-]?(x|y|z|total)?$", stem.strip()))


def _axis(words: list[str]) -> tuple[str, list[str]]:
    """The axis letter and the words without it; "" where there is none, or more than one."""
    found: list[tuple[str, str]] = []
    rest: list[str] = []
    for word in words:
        fused = _FUSED.match(word)
        turned = _REVERSED.match(word)
        if fused:
            found.append((fused[2], fused[1] + fused[3]))
        elif turned:
            found.append((turned[1], turned[2] + turned[3]))
        else:
            match = re.fullmatch(r"(\d+)([xyz])|([xyz])(\d+)", word)
            if match:
                found.append((match[2] or match[3], match[1] or match[4]))
            else:
                rest.append(word)
    if len(found) != 1:
        return "", words
    axis, remainder = found[0]
    return axis, ([remainder] if remainder else []) + rest


_LETTERS = {"a": "acceleration", "w": "gyroscope", "m": "magnetometer", "q": "orientation"}
_LETTERS |= {"v": "velocity", "d": "displacement", "b": "magnetometer", "e": "orientation"}


def _quantity(words: list[str], axis: str) -> str:
    """The quantity that the words name; "" where they name none."""
    if words and _TIME_WORDS.match(words[0]) and not axis:
        return TIME
    if any(word.rstrip("0123456789") == "mag" for word in words):
        return "magnetometer" if axis else "magnitude"
    for quantity, pattern in _QUANTITIES:
        if any(pattern.match(word) for word in words):
            return quantity
    if axis and words and (letter := words[0].rstrip("0123456789")) in _LETTERS:
        return _LETTERS[letter]
    if words == ["a"]:
        return ACCELERATION
    if any(_TIME_WORDS.match(word) for word in words) and not axis:
        return TIME
    return "index" if any(_INDEX_WORDS.match(word) for word in words) else ""


def _settle(quantity: str, unit: Unit | None, unit_text: str, words: list[str], axis: str) -> str:
    """The quantity after its unit was heard: a unit that contradicts the name wins a refusal."""
    if unit is None:
        if unit_text and quantity in (ACCELERATION, "linear acceleration", ""):
            return "unknown unit"
        return quantity or "unknown"
    if unit.quantity == ACCELERATION:
        return quantity or ACCELERATION
    if unit.quantity == RAW:
        return quantity or ("unknown" if not axis and unit.name != "counts" else ACCELERATION)
    if unit.quantity == TIME:
        return quantity if quantity not in ("", ACCELERATION) else _time_or_other(words)
    if quantity in ("", ACCELERATION, "linear acceleration", "gravity"):
        return unit.quantity
    return quantity


def _time_or_other(words: list[str]) -> str:
    """A duration in s is a time only where its name is one: ``loop_us`` is not."""
    return "unknown" if words and not any(_TIME_WORDS.match(w) for w in words) else TIME
