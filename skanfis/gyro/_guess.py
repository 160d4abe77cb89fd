"""Find the column of each quantity in a log: as the user says, by its name, words or units."""

import difflib
import re
import shlex
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from ._checks import PARTS
from ._columns import CANONICAL, convert, declared_units, unit_in
from ._numbers import CLOCK, as_numbers, clock_form, dated
from ._units import settle_units
from .errors import LogError

_SAMPLE_ROWS = 100_000
_HEAT = "temp temperature temperatur température tmp therm thermistor ntc rtd celsius 温度"
_WARM = f"{_HEAT} chamber oven"
_RATE = "rate omega w angular velocity speed drehrate"
_OUTPUT = (
    "gyro gyr gyroscope fog output out signal raw counts count adc measured meas indicated sensor "
    "imu dut uut kreisel"
)
_TRUTH = "true truth table turntable drehtisch ref reference stage encoder enc"
# Words for a commanded rate: a measured one is better, since the table follows a little later.
_WISH = "commanded command cmd demand setpoint soll consigne"
# Scores: how much a word in a column's name speaks for a part. A chamber's thermometer is not the
# gyro's; a rate of a temperature is no rotation.
_WORDS = {
    "time": {
        5.0: "time timestamp zeit uhrzeit zeitstempel zeitpunkt datetime temps 时间",
        4.0: "clock elapsed",
        3.0: "t sec secs seconds epoch utc tow ms millis us",
    },
    "temperature": {
        5.0: _HEAT,
        3.0: "t",
        0.0: "gyro gyr gyroscope fog sensor imu dut uut kreisel",
        -3.5: "start set setpoint target chamber oven ambient amb room min max board",
    },
    "output": {5.0: _OUTPUT, 2.0: _RATE, -99.0: f"{_TRUTH} {_WISH} {_HEAT}"},
    "rate": {6.0: f"{_TRUTH} ist actual", 5.0: _WISH, 2.0: _RATE, -4.5: _OUTPUT, -99.0: _WARM},
}
_SCORES = {
    part: {word: score for score, words in table.items() for word in words.split()}
    for part, table in _WORDS.items()
}
_STRANGER = -0.5  # score of any other word
_SIGNAL, _UNIT = 3.0, 0.25  # scores of a raw signal's unit, for the output; of any unit
# The axis that the table turns: least correlation with the rate, and least share of all turning.
_FOLLOWS = 0.9
_OF_NO_PART = (
    "residual fit fitted error err noise random walk std sigma var variance status flag valid crc "
    "checksum seq sequence index trend delta diff acc accel accelerometer mag pressure humidity "
    "supply vdd current heater bias corrected compensated filtered direction"
)
_LABVIEW = {"X_Value": ("time", "s")}  # its name for the time
_LABELS = {
    "run": {"run", "cycle", "session", "powerup", "lauf"},
    "device": {"device", "serial", "sn", "unit", "gerät"},
}
_OF_LABELS = {"id", "no", "nr", "number", "name", "label"}
_QUANTITIES = {
    "time": ("time",),
    "temperature": ("temperature",),
    "output": ("rate", "signal"),
    "rate": ("rate",),
}

_BRACKETED = re.compile(r"[\[({<]([^\])}>]*)[\])}>]\s*$|[,/]\s*([^,/\s][^,]*)$")
# mV first: it is one word in spite of its two cases.
_WORD = re.compile(r"mV(?![A-Za-z])|[A-Z]?[a-zµäöüß°]+|[A-Z]+(?![a-z])|[0-9]+|[^\W\d_a-zA-Z]+")

_AXIS = re.compile("(?:gyro|gyr|omega|rate|imu|g|w)([xyz])(?![a-z])", re.IGNORECASE)  # in a word


@dataclass(frozen=True)
class Request:
    """What to read from a log; ValueError for a part or unit that is unknown.

    With ``guess``, as for the command, columns are guessed, the clock tells runs apart, every row
    is checked, and rows that lack a value are left out, unless it is of an ``optional`` part.
    """

    columns: dict = field(default_factory=dict)
    units: dict = field(default_factory=dict)
    require: tuple[str, ...] = ("temperature", "output", "rate")
    guess: bool = False
    assumed: dict | None = None  # units of columns that name none; None: by the values
    optional: tuple[str, ...] = ()

    def __post_init__(self):
        for name, parts in (("columns", self.columns), ("require", self.require)):
            for part in parts:
                if part not in PARTS:
                    known = ", ".join(PARTS)
                    raise ValueError(f"{name}: there is no {part!r}; it may be one of {known}.")
        object.__setattr__(self, "units", declared_units(self.units))


@dataclass
class Layout:
    """Places of the parts in a file, and their units there.

    ``others`` are columns that would do as well; ``assumed`` are parts whose units nobody named.
    """

    header: list
    places: dict
    units: dict
    notes: list = field(default_factory=list)
    others: dict = field(default_factory=dict)
    assumed: list = field(default_factory=list)
    dates: list = field(default_factory=list)  # places of the dates, if the time has none
    axis: str = ""  # of the output, by its name: "x", "y" or "z"

    def name(self, part):
        return self.header[self.places[part]] if part in self.places else part


def settle(source, request, first=None):
    """The layout of a file; ``first`` is that of the first file, whose names hold for all."""
    names = {part: part for part in PARTS}
    if first is not None:
        names |= {part: first.name(part) for part in first.places}
    names |= request.columns
    layout = Layout(source.header, {}, dict(request.units))
    # Names that the user gave go first: their columns are not free for other parts.
    for part in sorted(names, key=lambda part: part not in request.columns):
        told = {name for other, name in request.columns.items() if other != part}
        place = _place(source, names[part], told)
        if place is not None:
            layout.places[part] = place
        elif part in request.columns:
            raise LogError(f"{source.path}: {_no_column(part, names[part], source.header)}")
    if request.guess:
        _guess(source, request, layout, first)
    for part in request.require:
        if part not in layout.places:
            told = _no_column(part, names[part], source.header, layout.places.values())
            raise LogError(f"{source.path}: {told}")
    taken = list(layout.places.values())
    if shared := [part for part in layout.places if taken.count(layout.places[part]) > 1]:
        raise LogError(
            f"{source.path}: column {layout.name(shared[0])!r} cannot be both "
            f"{' and '.join(shared)}. Name another for one of them (--columns PART=NAME)."
        )
    layout.places = {part: layout.places[part] for part in PARTS if part in layout.places}
    layout.units = CANONICAL | layout.units
    return layout


def _guess(source, request, layout, first):
    """Add to the layout the parts found by names and units, and the units."""
    # In the first file, a column called rate may be the gyro's own output.
    is_told = "rate" in request.columns or first is not None
    called_rate = None if is_told else layout.places.pop("rate", None)
    places = range(len(source.header))
    sample = source.table(places, n_rows=_SAMPLE_ROWS)
    if first is None and sample.empty:  # nothing to guess from
        raise LogError(f"{source.path}: has no rows with values.")
    columns = [
        _Column(place, name, sample[place], source.decimal)
        for place, name in enumerate(source.header)
    ]
    for choose in (_by_name, _by_unit):
        for part in _QUANTITIES:
            if part not in layout.places:
                choose(part, columns, layout)
    for part, words in _LABELS.items():
        for column in columns:
            if column.words & words and not column.words - words - _OF_LABELS:
                layout.places.setdefault(part, column.place)
    if called_rate is not None and called_rate not in layout.places.values():
        layout.places.setdefault("rate", called_rate)
    of_first = request.assumed if first is None else first.units
    _settle_axis(columns, layout)
    if "output" in layout.places:
        layout.axis = columns[layout.places["output"]].axis
    place, taken = layout.places.get("time"), set(layout.places.values())
    if place is not None and columns[place].is_time and clock_form(sample[place]) == CLOCK:
        texts = [each.place for each in columns if each.numbers.size == 0]
        forms = {k: clock_form(dated(sample[k], sample[place])) for k in texts if k not in taken}
        layout.dates = [k for k, form in forms.items() if form][:1]
    _settle_units(columns, layout, of_first)
    if first is not None:
        layout.others = first.others
    layout.notes.append(_sentence(layout))
    if "time" not in layout.places:
        others = [one for one in columns if one.place not in taken and one.numbers.size]
        named = [one.name for one in others if one.score("time") > 0.0]
        layout.notes += [f"{name!r} is not used: no time goes up and down" for name in named[:1]]


class _Column:
    """A column: what its name says (words, unit, quantity of the unit), and its first values."""

    def __init__(self, place, name, values, decimal):
        self.place, self.name = place, name
        meant, rest = _LABVIEW.get(name.strip()), name.strip()
        bracketed = _BRACKETED.search(rest)
        if bracketed and (found := unit_in(bracketed[1] or bracketed[2] or "")):
            meant, rest = found, rest[: bracketed.start()]
        words = [word.casefold() for word in _WORD.findall(_AXIS.sub(r"gyro \1", rest))]
        for length in (3, 2, 1):
            found = unit_in("_".join(words[-length:])) if len(words) >= length else None
            if meant is None and found:
                # A name that is a unit and nothing else keeps it as its word too.
                meant, words = found, words[:-length] or words
        axes = [letter for letter in "xyz" if letter in words and len(words) > 1]
        self.axis = "".join(axes[-1:])
        self.words = set(words) - {self.axis}
        numbers = as_numbers(values, decimal)
        self.aligned = np.where(np.isfinite(numbers), numbers, np.nan)
        self.numbers = numbers[np.isfinite(numbers)]
        self.is_time, self.text = values.dtype.kind in "mM", ""
        if self.numbers.size <= 0.5 * len(values):
            self.numbers = np.empty(0)
            self.is_time = clock_form(values) != ""
            self.text = "".join(values[np.isnan(self.aligned)].dropna().head(1).astype(str))
        self.quantity: str | None
        self.unit: str | None
        self.quantity, self.unit = meant or ("time" if self.is_time else None, None)

    def can_be(self, part):
        """Whether neither unit nor values exclude this part, and no word excludes all parts."""
        if self.words & set(_OF_NO_PART.split()) or self.quantity not in (None, *_QUANTITIES[part]):
            return False
        if part == "time":
            steps = np.diff(self.numbers)
            against = min(np.sum(steps < 0.0), np.sum(steps > 0.0))  # rows may be in reverse order
            return self.is_time or (self.numbers.size > 0 and against <= 0.1 * steps.size)
        if self.numbers.size == 0:
            # Texts that begin like numbers are taken: reading them will say what is wrong.
            is_label = self.words & _OF_LABELS.union(*_LABELS.values())
            return self.text.lstrip("+-.,\u2212")[:1].isdigit() and not (self.is_time or is_label)
        # A flag or a trend takes a few whole values.
        return part != "temperature" or not np.isin(self.numbers, (-1.0, 0.0, 1.0)).all()

    def score(self, part):
        """How much the name speaks for a part; zero or less if it does not."""
        score = sum(_SCORES[part].get(word, _STRANGER) for word in self.words)
        # A signal that never changes is no output, but a supply voltage.
        if part == "output" and self.quantity == "signal" and np.unique(self.numbers).size > 1:
            score += _SIGNAL
        return score + (_UNIT if self.unit else 0.0)


def _free(part, columns, layout):
    taken = layout.places.values()
    return [column for column in columns if column.place not in taken and column.can_be(part)]


def _by_name(part, columns, layout):
    scores = {column.place: column.score(part) for column in _free(part, columns, layout)}
    most = max(scores.values(), default=0.0)
    if most <= 0.0:
        return
    best = [columns[place] for place, score in scores.items() if score == most]
    # Numbers before texts; of one quantity in two units, the one that needs no conversion.
    best.sort(key=lambda c: (c.numbers.size == 0, c.unit not in CANONICAL.values()))
    chosen = best[0]
    layout.places[part] = chosen.place
    layout.others[part] = [layout.header[c.place] for c in best if c is not chosen]


def _by_unit(part, columns, layout):
    """Take the only free column that has a unit of the part, or times."""
    found = [column for column in _free(part, columns, layout) if column.quantity]
    if part != "rate" and len(found) == 1:
        layout.places[part] = found[0].place


def _settle_axis(columns, layout):
    """Among outputs with equally good names, take the axis that the table turns."""
    others = [column for column in columns if column.name in layout.others.get("output", [])]
    if not others or "rate" not in layout.places:
        return
    rate = columns[layout.places["rate"]].aligned
    own = [columns[layout.places["output"]], *others]
    table = pd.DataFrame({c.place: convert(c.aligned, c.unit or CANONICAL["output"]) for c in own})
    correlation = table.corrwith(pd.Series(rate)).abs()
    # How much each turns: slightly misaligned axes sense the table too.
    turned = ((correlation * table.std()) ** 2)[correlation > _FOLLOWS]
    if turned.max() > _FOLLOWS * turned.sum():
        layout.places["output"] = int(turned.idxmax())
        layout.others.pop("output")


def _settle_units(columns, layout, of_first):
    """Set the units: by the names; else as in the first file, or from the values."""
    values, own = {}, {}
    for part in _QUANTITIES.keys() & layout.places.keys():
        column = columns[layout.places[part]]
        if column.unit and column.quantity in _QUANTITIES[part]:
            own[part] = column.unit
        if not column.is_time:
            values[part] = column.aligned
    for part in sorted(own.keys() & layout.units.keys()):
        if (unit := layout.units[part]) != own[part]:
            name = layout.name(part)
            layout.notes.append(f"{name!r} is read in {unit} as told, not in {own[part]}")
    layout.units = own | layout.units
    if of_first is None:
        found = settle_units(values, layout.units, is_all=False)
    else:
        lacking = values.keys() - layout.units.keys()
        found = {part: of_first.get(part, CANONICAL[part]) for part in lacking}
    layout.units |= found
    layout.assumed = [part for part in PARTS if part in found]


def _sentence(layout):
    """Which columns were taken in which units, in words."""
    told = []
    for part in (part for part in PARTS if part in layout.places):
        name, unit = layout.name(part), layout.units.get(part, "")
        others = ", ".join(map(repr, layout.others.get(part, [])))
        told.append(
            f"{part} = {name!r}"
            + (f" in {unit}" if unit else "")
            + "".join(f" on {layout.header[k]!r}" for k in layout.dates if part == "time")
            + (f" ({others} would do too)" if others else "")
        )
    return f"columns: {'; '.join(told)}. Say otherwise with --columns and --units"


def _place(source, name, taken):
    """Position of a column by its name; if there is none, ignoring outer blanks and case."""
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


def _no_column(part, name, header, taken=()):
    found = ", ".join(map(repr, header[:20])) + (", ..." if len(header) > 20 else "")
    # A column named after another part is not suggested for this one.
    left = [other for place, other in enumerate(header) if place not in taken]
    free = [other for other in left if other.strip().casefold() not in PARTS]
    close = [part] if part in header else difflib.get_close_matches(name, free, n=1, cutoff=0.4)
    advice = f"{part}={close[0]}" if close else f"{part}={free[0] if free else 'NAME'}"
    return (
        f"there is no column {name!r} for the {part}; the file has {found}. Say which it is "
        f"(such as --columns {shlex.quote(advice)}; columns= in Python)."
    )
