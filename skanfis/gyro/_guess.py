"""Which column of a file plays which part: as told, as it is called, or by words and units."""

import difflib
import re
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from ._checks import PARTS
from ._columns import CANONICAL, unit_in
from ._values import Clock, as_numbers
from .errors import LogError

__all__ = ["Layout", "Request", "settle"]

_SAMPLE_ROWS = 5_000
# How much a word in a column's name speaks for a part.
_WORDS = {
    "time": {
        5: "time timestamp zeit uhrzeit zeitstempel zeitpunkt datetime 时间",
        4: "clock elapsed",
        3: "t sec secs seconds epoch utc tow ms millis us",
    },
    "temperature": {
        5: "temp temperature temperatur tmp therm thermometer thermistor ntc rtd celsius 温度",
        3: "t",
    },
    "output": {
        5: "gyro gyroscope fog output out signal raw counts count adc measured meas indicated "
        "sensor imu dut uut kreisel",
        2: "rate omega angular velocity speed",
    },
    "rate": {
        6: "true truth table turntable drehtisch ref reference stage commanded command cmd "
        "setpoint encoder",
        2: "rate omega angular velocity speed",
    },
}
_SCORES = {
    part: {word: score for score, words in table.items() for word in words.split()}
    for part, table in _WORDS.items()
}
_OF_NO_PART = (
    "residual fit fitted error err std sigma var variance status flag valid crc checksum seq "
    "sequence index trend delta diff acc accel accelerometer mag pressure humidity supply vdd "
    "current heater bias corrected compensated filtered direction"
)
# A chamber's thermometer is no gyro's.
_OF_ANOTHER = "start set setpoint target chamber oven ambient amb room min max board"
_LABELS = {"run": "run cycle session powerup", "device": "device serial sn unit"}
_OF_LABELS = "id no nr number name label"
_QUANTITIES = {
    "time": ("time",),
    "temperature": ("temperature",),
    "output": ("rate", "signal"),
    "rate": ("rate",),
}
_STRANGER = 0.5  # what a word that says nothing takes off
_COLDEST_IN_KELVIN = 150.0  # no log is above it throughout in degrees
# Numbers that large count from 1970, in these units.
_EPOCHS = ((1e17, "ns"), (1e14, "us"), (1e11, "ms"), (1e8, "s"))
_LARGEST_RATE = 1000  # of whole numbers, beyond which they are taken for counts

_BRACKETED = re.compile(r"[\[({<]([^\])}>]*)[\])}>]\s*$|[,/]\s*([^,/\s][^,]*)$")
# mV first: it is one word, for all its letters of two cases.
_WORD = re.compile(r"mV(?![A-Za-z])|[A-Z]?[a-zµäöüß°]+|[A-Z]+(?![a-z])|[0-9]+|[^\W\d_a-zA-Z]+")
# Names that hold two words without a sign between them.
_FUSED = re.compile(r"(gyro|gyr|omega|rate|imu|g|w|acc|accel|a|mag|m)([xyz])$")
_FULL = {"g": "gyro", "w": "omega", "gyr": "gyro", "a": "acc", "m": "mag"}


@dataclass(frozen=True)
class Request:
    """What is asked of a reading.

    With ``guess``, columns are guessed and rows that lack a value left out, as the command does.
    """

    columns: dict = field(default_factory=dict)
    units: dict = field(default_factory=dict)
    require: tuple[str, ...] = ("temperature", "output", "rate")
    separator: str | None = None
    decimal: str | None = None
    encoding: str | None = None
    guess: bool = False


@dataclass
class Layout:
    """Places of the parts in a file and their units there; ``reasons`` are those of guesses."""

    header: list
    places: dict
    units: dict
    notes: list = field(default_factory=list)
    reasons: dict = field(default_factory=dict)

    def name(self, part):
        """The part's name in the file."""
        return self.header[self.places[part]] if part in self.places else part


def settle(source, request, first=None):
    """The layout of a file; ``first`` is that of the first file, whose names hold for all."""
    names = {part: part for part in PARTS}
    if first is not None:
        names |= {part: first.name(part) for part in first.places}
    names |= request.columns
    layout = Layout(source.header, {}, {})
    # Names that were told go first: what they have taken is not there for the others.
    for part in sorted(names, key=lambda part: part not in request.columns):
        told = {name for other, name in request.columns.items() if other != part}
        place = _place(source, names[part], told)
        if place is not None:
            layout.places[part] = place
            if names[part] not in (part, layout.name(part)):
                layout.notes.append(f"{layout.name(part)!r} is taken for {names[part]!r}")
        elif part in request.columns:
            raise LogError(f"{source.path}: {_no_column(part, names[part], source.header)}")
    if request.guess:
        _guess(source, request, layout, is_first=first is None)
    for part in request.require:
        if part not in layout.places:
            raise LogError(f"{source.path}: {_no_column(part, names[part], source.header)}")
    if len(set(layout.places.values())) < len(layout.places):
        raise LogError(f"{source.path}: two parts cannot be the same column of the file.")
    layout.places = {part: layout.places[part] for part in PARTS if part in layout.places}
    layout.units = CANONICAL | layout.units | request.units
    return layout


def _guess(source, request, layout, is_first):
    """Add the parts that names and units tell, and the units."""
    # Of the first file, a column that is called rate may be the gyro's own.
    is_told = "rate" in request.columns or not is_first
    own_rate = None if is_told else layout.places.pop("rate", None)
    places = range(len(source.header))
    sample = next(source.pieces(places, _SAMPLE_ROWS), pd.DataFrame(columns=places, dtype=float))
    columns = [
        _Column(place, name, sample[place], source.decimal)
        for place, name in enumerate(source.header)
    ]
    for part in _WORDS:
        if part == "output" and not any(column.is_named("output") for column in columns):
            _alone_in("output", ("signal",), columns, layout)
        if part not in layout.places:
            _by_name(part, columns, layout)
    for part, words in _LABELS.items():
        for column in columns:
            said = column.words & set(words.split())
            if said and not column.words - said - set(_OF_LABELS.split()):
                layout.places.setdefault(part, column.place)
    _by_unit(columns, layout)
    if own_rate is not None and own_rate not in layout.places.values():
        layout.places.setdefault("rate", own_rate)
    _settle_units(columns, layout, request)
    layout.notes += _sentences(layout, request)


class _Column:
    """A column's name, read (its words, unit, what that is a unit of), and its first values."""

    def __init__(self, place, name, values, decimal):
        self.place = place
        meant, rest = None, name.strip()
        bracketed = _BRACKETED.search(rest)
        if bracketed and (found := unit_in(bracketed[1] or bracketed[2] or "")):
            meant, rest = found, rest[: bracketed.start()]
        words: list[str] = []
        for word in map(str.casefold, _WORD.findall(rest)):
            fused = _FUSED.match(word)
            words += [_FULL.get(fused[1], fused[1]), fused[2]] if fused else [word]
        for length in (3, 2, 1):
            found = unit_in("_".join(words[-length:])) if len(words) >= length else None
            if meant is None and found:
                # A name that is a unit and nothing else keeps it as its word too.
                meant, words = found, words[:-length] or words
        axes = [letter for letter in "xyz" if letter in words and len(words) > 1]
        self.words = set(words) - set(axes[-1:])
        self.quantity: str | None
        self.unit: str | None
        self.quantity, self.unit = meant or (None, None)
        numbers = as_numbers(values, decimal)
        self.numbers = numbers[np.isfinite(numbers)]
        self.is_time = False
        if self.numbers.size <= 0.5 * len(values):
            self.numbers = np.empty(0)
            self.is_time = Clock(values).form != ""

    def can_be(self, part):
        """Whether the values do not speak against a part."""
        if part == "time" and self.numbers.size == 0:
            return self.is_time
        if part == "time":
            return self.numbers.size == 1 or np.mean(np.diff(self.numbers) >= 0.0) > 0.9
        # A flag or a trend takes a few whole values.
        is_flag = part == "temperature" and np.isin(self.numbers, (-1.0, 0.0, 1.0)).all()
        return self.numbers.size > 0 and not is_flag

    def score(self, part):
        """How much the name speaks for a part; zero where it does not."""
        if self.words & set(_OF_NO_PART.split()) or self.quantity not in (None, *_QUANTITIES[part]):
            return 0.0
        scores = _SCORES[part]
        found = sum(scores.get(word, 0.0) for word in self.words)
        if found == 0.0 or (part == "output" and self.is_named("rate")):
            return 0.0
        if part == "rate" and self.is_named("output"):
            found -= 4.0
        if part == "temperature":
            found -= 3.0 * len(self.words & set(_OF_ANOTHER.split()))
        strangers = len(self.words - set(scores))
        return found - _STRANGER * strangers + (0.25 if self.quantity else 0.0)

    def is_named(self, part):
        """Whether a word is the part's own."""
        return any(_SCORES[part].get(word, 0) > 2 for word in self.words)


def _by_name(part, columns, layout):
    taken = set(layout.places.values())
    scores = {
        column.place: column.score(part)
        for column in columns
        if column.place not in taken and column.can_be(part)
    }
    most = max(scores.values(), default=0.0)
    if most <= 0.0:
        return
    best = [columns[place] for place, score in scores.items() if score == most]
    # One truth in two units: that which needs no conversion.
    chosen = next((c for c in best if c.unit in CANONICAL.values()), best[0])
    layout.places[part] = chosen.place
    others = ", ".join(repr(layout.header[c.place]) for c in best if c is not chosen)
    layout.reasons[part] = [f"{others} would do too"] if others else []


def _by_unit(columns, layout):
    """What no name tells, and one unit does."""
    _alone_in("temperature", ("temperature",), columns, layout)
    _alone_in("time", ("time",), columns, layout)
    _alone_in("output", ("signal",), columns, layout)
    moments = [column.place for column in columns if column.is_time]
    if "time" not in layout.places and len(moments) == 1:
        layout.places["time"] = moments[0]
        layout.reasons["time"] = ["because it holds times"]
    rate = layout.places.get("rate")
    is_lone = "output" not in layout.places and "rate" in layout.reasons
    if is_lone and not columns[rate].is_named("rate"):
        # A rate that is said to be none's, in a log without an output, is the gyro's own.
        layout.places["output"] = layout.places.pop("rate")
        layout.reasons["output"] = ["by its name, and because there is no other rate"]
    _alone_in("output", ("rate",), columns, layout)


def _alone_in(part, quantities, columns, layout):
    taken = set(layout.places.values())
    found = [
        column.place
        for column in columns
        if column.quantity in quantities
        and column.place not in taken
        and not column.words & set(_OF_NO_PART.split())
        and column.can_be(part)
    ]
    if part not in layout.places and len(found) == 1:
        layout.places[part] = found[0]
        layout.reasons[part] = ["by its unit"]


def _settle_units(columns, layout, request):
    """Units that the names say, or else the values."""
    for part in _QUANTITIES.keys() & layout.places.keys():
        column = columns[layout.places[part]]
        values, reason = column.numbers, ""
        if part in request.units:
            layout.units[part] = request.units[part]
        elif column.quantity in _QUANTITIES[part]:
            layout.units[part] = column.unit
        elif values.size == 0:
            continue
        elif part == "temperature" and values.min() > _COLDEST_IN_KELVIN:
            layout.units[part], reason = "K", "by its values"
        elif part == "time" and values.min() > _EPOCHS[-1][0]:
            layout.units[part] = next(unit for least, unit in _EPOCHS if values.min() > least)
            reason = "since 1970, by its values"
        elif part == "output" and _are_counts(values):
            layout.units[part], reason = "counts", "because they are whole numbers"
        if reason:
            layout.reasons.setdefault(part, []).append(f"{layout.units[part]} {reason}")


def _are_counts(values):
    return np.abs(values).max() > _LARGEST_RATE and (values == values.round()).all()


def _sentences(layout, request):
    """What was guessed, in words; what is named as it should be is not worth a word."""
    told = []
    for part in (part for part in PARTS if part in layout.places):
        name, reasons = layout.name(part), layout.reasons.get(part, [])
        if (part in request.columns or name.strip().casefold() == part) and not reasons:
            continue
        unit = f" in {layout.units[part]}" if part in layout.units else ""
        told.append(f"{part} = {name!r}{unit}" + (f" ({'; '.join(reasons)})" if reasons else ""))
    say = "columns, as guessed: {}. Say otherwise with --columns and --units"
    return [say.format("; ".join(told))] if told else []


def _place(source, name, taken):
    """Position of a column by its name, or by that but for blanks around it and capitals."""
    header, plain = source.header, name.strip().casefold()
    found = [place for place, other in enumerate(header) if other == name] or [
        place
        for place, other in enumerate(header)
        if other.strip().casefold() == plain and other not in taken
    ]
    if len(found) > 1:
        names = " and ".join(repr(header[place]) for place in found)
        raise LogError(f"{source.path}: the header has {names}; which is meant? Rename one.")
    return found[0] if found else None


def _no_column(part, name, header):
    found = ", ".join(map(repr, header[:20])) + (", ..." if len(header) > 20 else "")
    # Columns that are called as another part are that.
    free = [other for other in header if other.strip().casefold() not in PARTS]
    close = [part] if part in header else difflib.get_close_matches(name, free, n=1, cutoff=0.4)
    advice = f"{part}={close[0]}" if close else f"{part}=NAME"
    return (
        f"there is no column {name!r} for the {part}; the file has {found}. Say which it is "
        f"(--columns {advice}; columns= in Python)."
    )
