"""Which column plays which part: told by its name, its unit, and how its values behave."""

from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from ._clock import Clock, is_clock
from ._names import ColumnName

__all__ = ["Guess", "guess_columns"]

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
_AGAINST = set(_OF_NO_PART.split())
# A chamber's thermometer is no gyro's.
_OF_ANOTHER = "start set setpoint target chamber oven ambient amb room min max board"
_LESS = dict.fromkeys(_OF_ANOTHER.split(), 3.0)
_LABELS = {
    "run": {"run", "cycle", "session", "powerup"},
    "device": {"device", "serial", "sn", "unit"},
}
_OF_LABELS = {"id", "no", "nr", "number", "name", "label"}
_QUANTITIES = {
    "time": ("time",),
    "temperature": ("temperature",),
    "output": ("rate", "signal"),
    "rate": ("rate",),
}
_STRANGER = 0.5  # what a word that says nothing takes off
# No log is above it throughout in degrees, and every log is in kelvin.
_COLDEST_IN_KELVIN = 150.0
# Numbers that large count from 1970, in these units.
_EPOCHS = ((1e17, "ns"), (1e14, "us"), (1e11, "ms"), (1e8, "s"))
# The output follows the rate with a correlation near one, for all its errors.
_FOLLOWS = 0.9
_LARGEST_RATE = 1000  # of whole numbers, beyond which they are taken for counts


@dataclass
class Guess:
    """Places of the parts, the units of those columns, and in words why."""

    places: dict = field(default_factory=dict)
    units: dict = field(default_factory=dict)
    reasons: dict = field(default_factory=dict)
    date: int | None = None
    axes: dict = field(default_factory=dict)


def guess_columns(header, unit_line, sample, known):
    """The part of every column that can be told.

    Parameters
    ----------
    header, unit_line : list of str
    sample : DataFrame
        First rows, columns by their places, as text or typed.
    known : dict of str to int
        Places of parts that are settled already.
    """
    names = [ColumnName.read(*pair) for pair in zip(header, unit_line, strict=True)]
    columns = _Columns(sample)
    guess = Guess(dict(known))
    for part in _WORDS:
        if part not in known:
            _by_name(part, names, columns, guess)
    for part, words in _LABELS.items():
        for place, name in enumerate(names):
            said = set(name.words)
            if part not in guess.places and said & words and not said - words - _OF_LABELS:
                _take(guess, part, place, "by its name")
    _lone_rate(names, guess)
    _by_unit(names, columns, guess)
    _by_behaviour(names, columns, guess)
    _units(names, columns, guess)
    _date(names, columns, guess)
    _axes(names, header, columns, guess, known)
    return guess


class _Columns:
    """The columns of a sample as numbers; empty where they are none."""

    def __init__(self, sample):
        self._sample = sample
        self._numbers: dict = {}

    def texts(self, place):
        return self._sample[place].dropna().astype(str)

    def numbers(self, place):
        if place not in self._numbers:
            column = self._sample[place]
            if column.dtype.kind not in "fiub":
                text = column.astype("string").str.strip().str.replace(",", ".", regex=False)
                column = pd.to_numeric(text, errors="coerce")
            values = column.to_numpy(dtype=float, na_value=np.nan)
            enough = np.isfinite(values).mean() > 0.5 if values.size else False
            self._numbers[place] = values if enough else np.empty(0)
        return self._numbers[place]

    def places(self):
        return list(self._sample)

    def holds_moments(self, place):
        """Whether the values are texts that tell times, and not one date alone."""
        if self.numbers(place).size:
            return False
        texts = self.texts(place)
        return texts.nunique() > 1 and Clock(texts).form != ""

    def can_be(self, part, place):
        """Whether the values do not speak against a part."""
        values = self.numbers(place)
        if part == "time" and values.size == 0:
            return Clock(self.texts(place)).form != ""
        values = values[np.isfinite(values)]
        if values.size == 0:
            return False
        if part == "time":
            return np.mean(np.diff(values) >= 0.0) > 0.9 if values.size > 1 else True
        # A flag or a trend takes a few whole values.
        return part != "temperature" or not np.isin(values, (-1.0, 0.0, 1.0)).all()


def _score(part, name):
    """How much a name speaks for a part; zero where it does not."""
    if name.quantity is not None and name.quantity not in _QUANTITIES[part]:
        return 0.0
    scores = _SCORES[part]
    found = sum(scores.get(word, 0.0) for word in name.words)
    if found == 0.0 or _AGAINST & set(name.words):
        return 0.0
    if part == "output" and any(_SCORES["rate"].get(word, 0) > 2 for word in name.words):
        return 0.0
    if part == "rate" and any(_SCORES["output"].get(word, 0) > 2 for word in name.words):
        found -= 4.0
    if part == "temperature":
        found -= sum(_LESS.get(word, 0.0) for word in name.words)
    strangers = sum(word not in scores for word in name.words)
    return found - _STRANGER * strangers + (0.25 if name.quantity else 0.0)


def _by_name(part, names, columns, guess):
    taken = set(guess.places.values())
    found = [
        (_score(part, name), place)
        for place, name in enumerate(names)
        if place not in taken and columns.can_be(part, place)
    ]
    found = sorted((pair for pair in found if pair[0] > 0.0), key=lambda pair: -pair[0])
    if not found:
        return
    best = [place for score, place in found if score == found[0][0]]
    # One truth in two units: that which needs no conversion.
    place = next((k for k in best if names[k].unit in ("deg/s", "degC", "s")), best[0])
    others = [k for k in best if k != place and names[k].axis == names[place].axis]
    _take(guess, part, place, "by its name", others)


def _take(guess, part, place, reason, others=()):
    guess.places[part] = place
    guess.reasons[part] = (reason, list(others))


def _lone_rate(names, guess):
    """A rate that is said to be none's, in a log without an output, is the gyro's own."""
    rate = guess.places.get("rate")
    if "output" in guess.places or "rate" not in guess.reasons:
        return
    if all(_SCORES["rate"].get(word, 0) <= 2 for word in names[rate].words):
        del guess.places["rate"], guess.reasons["rate"]
        _take(guess, "output", rate, "by its name, and because there is no other rate")


def _by_unit(names, columns, guess):
    for part in ("temperature", "time"):
        taken = set(guess.places.values())
        found = [
            place
            for place, name in enumerate(names)
            if name.quantity == part
            and place not in taken
            and not _AGAINST & set(name.words)
            and columns.can_be(part, place)
        ]
        if part not in guess.places and len(found) == 1:
            _take(guess, part, found[0], "by its unit")


def _by_behaviour(names, columns, guess):
    """What no name tells: a clock climbs, a temperature is smooth, an output follows the rate."""
    free = [
        place
        for place in columns.places()
        if place not in guess.places.values() and columns.numbers(place).size > 20
    ]
    if "time" not in guess.places:
        climbing = [
            place
            for place in free
            if _climbs(columns.numbers(place)) and not _AGAINST & set(names[place].words)
        ]
        moments = [place for place in columns.places() if columns.holds_moments(place)]
        if len(climbing) == 1:
            _take(guess, "time", climbing[0], "because it climbs evenly")
            free.remove(climbing[0])
        elif len(moments) == 1 and moments[0] not in guess.places.values():
            _take(guess, "time", moments[0], "because it holds times")
    lacking = [part for part in ("output", "rate") if part not in guess.places]
    if lacking:
        # What is smooth follows a bias that follows the temperature: it is no table's rate. Nor
        # is another axis.
        stepping = [
            place
            for place in free
            if not _is_smooth(columns.numbers(place)) and _score("output", names[place]) == 0.0
        ]
        _followers(names, columns, guess, stepping, lacking)
        free = [place for place in free if place not in guess.places.values()]
    angular = [k for k in free if names[k].quantity in _QUANTITIES["output"]]
    if (
        "output" not in guess.places
        and len(angular) == 1
        and not _AGAINST & set(names[angular[0]].words)
    ):
        _take(guess, "output", angular[0], "by its unit")
    if "temperature" not in guess.places:
        smooth = [place for place in free if _is_smooth(columns.numbers(place))]
        if len(smooth) == 1:
            _take(guess, "temperature", smooth[0], "because it is smooth, and spans what one does")


def _climbs(values):
    steps = np.diff(values)
    if (steps == 1.0).all():
        return False  # a counter of rows
    return bool((steps > 0.0).all() and np.ptp(steps) < 0.5 * np.median(steps))


def _is_smooth(values):
    values = values[np.isfinite(values)]
    spread = np.ptp(values) if values.size else 0.0
    plausible = values.size and values.min() >= -100.0 and values.max() <= 450.0
    return bool(
        plausible
        and spread > 3.0
        and np.unique(values).size > 10
        and np.quantile(np.abs(np.diff(values)), 0.99) < 0.1 * spread
    )


def _followers(names, columns, guess, free, lacking):
    """The pair, of the columns that are free or settled, that follow one another."""
    firsts = [guess.places[part] for part in ("output", "rate") if part in guess.places] or free
    pairs = {
        frozenset((first, second))
        for first in firsts
        for second in free
        if first != second and abs(_correlation(columns, first, second)) > _FOLLOWS
    }
    if len(pairs) != 1:
        return
    why = "because one follows the other"
    places = list(pairs.pop())
    if len(lacking) == 1:
        place = next(place for place in places if place in free)
        if lacking[0] == "rate" and names[place].quantity == "signal":
            # A raw signal is nobody's rate: what it follows is.
            _take(guess, "rate", guess.places["output"], why)
            _take(guess, "output", place, why)
            return
        _take(guess, lacking[0], place, why)
        return
    # The table stops at levels; the gyro has noise.
    levels = [np.unique(columns.numbers(place)).size for place in places]
    if levels[0] != levels[1]:
        rate, output = places if levels[0] < levels[1] else places[::-1]
        _take(guess, "rate", rate, why + ", and it has fewer levels")
        _take(guess, "output", output, why)


def _correlation(columns, first, second):
    a, b = columns.numbers(first), columns.numbers(second)
    known = np.isfinite(a) & np.isfinite(b)
    a, b = a[known], b[known]
    if a.size < 20 or np.ptp(a) == 0.0 or np.ptp(b) == 0.0:
        return 0.0
    return float(np.corrcoef(a, b)[0, 1])


def _units(names, columns, guess):
    """Units that the names say, or else the values."""
    for part, place in guess.places.items():
        name = names[place]
        if part in _QUANTITIES and name.quantity in _QUANTITIES[part]:
            guess.units[part] = (name.unit, "")
    for part, place in guess.places.items():
        if part in guess.units or part not in _QUANTITIES:
            continue
        values = columns.numbers(place)
        values = values[np.isfinite(values)]
        if values.size == 0:
            continue
        largest = np.abs(values).max()
        if part == "temperature" and values.min() > _COLDEST_IN_KELVIN:
            guess.units[part] = ("K", "by its values")
        elif part == "time":
            since = [unit for least, unit in _EPOCHS if values.min() > least]
            if since:
                guess.units[part] = (since[0], "since 1970, by its values")
        elif part == "output" and largest > _LARGEST_RATE and (values == values.round()).all():
            guess.units[part] = ("counts", "because they are whole numbers")


def _date(names, columns, guess):
    """A date beside a clock, in a column of its own."""
    time = guess.places.get("time")
    if time is None or not is_clock(columns.texts(time)):
        return
    for place, name in enumerate(names):
        if place != time and set(name.words) & {"date", "datum", "day", "日期"}:
            guess.date = place


def _axes(names, header, columns, guess, known):
    """Outputs of several axes, each with the rate of its own or the one that there is."""
    output, rate = guess.places.get("output"), guess.places.get("rate")
    if output is None or "output" in known or not names[output].axis:
        return
    alike = [
        place
        for place, name in enumerate(names)
        if name.axis
        and (name.words, name.unit) == (names[output].words, names[output].unit)
        and columns.can_be("output", place)
    ]
    if len(alike) < 2:
        return
    for place in alike:
        own = rate
        if rate is not None and names[rate].axis:
            own = next(
                (
                    k
                    for k, name in enumerate(names)
                    if name.axis == names[place].axis and name.words == names[rate].words
                ),
                None,
            )
        guess.axes[names[place].axis] = (header[place], None if own is None else header[own])
