"""The columns of a file that play parts: as they were told, as they are named, or as guessed."""

import difflib
from dataclasses import dataclass, field

from ._checks import LABELS, QUANTITIES
from ._columns import CANONICAL
from ._guess import guess_columns
from .errors import LogError

__all__ = ["COLUMNS", "Layout", "Request", "settle"]

COLUMNS = (*QUANTITIES, *LABELS)
# What columns are is told by their first rows: enough for a run's beginning, little to read.
_SAMPLE_ROWS = 5_000


@dataclass(frozen=True)
class Request:
    """What was asked of a reading; ``columns`` and ``units`` are those that were told."""

    columns: dict = field(default_factory=dict)
    units: dict = field(default_factory=dict)
    require: tuple[str, ...] = ("temperature", "output", "rate")
    separator: str | None = None
    decimal: str | None = None
    encoding: str | None = None
    guess: bool = False
    drop_missing: bool = False
    average: float | None = None


@dataclass(frozen=True)
class Layout:
    """Places of the parts in a file, in the order of ``COLUMNS``, and their units there.

    ``date`` is the place of a date beside a clock, ``axes`` the outputs of several axes by letter:
    the names of the output and of its rate.
    """

    header: list
    places: dict
    units: dict
    date: int | None = None
    axes: dict = field(default_factory=dict)
    said: tuple[str, ...] = ()

    def name(self, part):
        """The part's name in the file."""
        return self.header[self.places[part]]


def settle(source, request, first=None):
    """The layout of a file; ``first`` is that of the first file, whose names hold for all."""
    names = {part: part for part in COLUMNS} | request.columns
    places: dict = {}
    # Names that were told go first: what they have taken is not there for the others.
    for part in sorted(names, key=lambda part: part not in request.columns):
        told = {name for other, name in request.columns.items() if other != part}
        place = _place(source.path, source.header, names[part], told)
        if place is not None:
            places[part] = place
        elif part in request.columns:
            raise LogError(f"{source.path}: {_no_column(part, names[part], source.header)}")
    said = [
        f"{source.header[places[part]]!r} is taken for {name!r}"
        for part, name in request.columns.items()
        if source.header[places[part]] != name
    ]
    units, date, axes = {}, None, {}
    if request.guess:
        known = dict(places)
        if "rate" not in request.columns:
            known.pop("rate", None)
        if first is not None:
            known |= _same_names(source, first, request, said)
        guess = guess_columns(source.header, source.units, source.sample(_SAMPLE_ROWS), known)
        if "rate" in places and "rate" not in guess.places:
            own = places["rate"]
            # Its name holds, whatever its first values are, unless it plays the output's part.
            guess.places |= {} if own in guess.places.values() else {"rate": own}
        places, date, axes = guess.places, guess.date, guess.axes
        units = {part: unit for part, (unit, _) in guess.units.items()}
        said += _sentences(source.header, guess, request)
    for part in request.require:
        if part not in places:
            raise LogError(f"{source.path}: {_no_column(part, names[part], source.header)}")
    if len(set(places.values())) < len(places):
        raise LogError(f"{source.path}: two parts cannot be the same column of the file.")
    ordered = {part: places[part] for part in COLUMNS if part in places}
    units = CANONICAL | units | request.units
    return Layout(source.header, ordered, units, date, axes, tuple(said))


def _same_names(source, first, request, said):
    """Places of the parts by their names in the first file; of some columns, other spellings."""
    found = {}
    for part in first.places:
        if part in request.columns:
            continue
        name = first.name(part)
        place = _place(source.path, source.header, name, ())
        if place is None:
            continue
        found[part] = place
        if source.header[place] != name:
            said.append(
                f"{source.path}: {source.header[place]!r} is taken for {name!r} of the first file"
            )
    return found


def _sentences(header, guess, request):
    """What was guessed, in words; what is named as it should be is not worth a word."""
    told = []
    for part in COLUMNS:
        if part not in guess.places:
            continue
        name = header[guess.places[part]]
        unit, why_unit = guess.units.get(part, ("", ""))
        unit = request.units.get(part, unit)
        plain = part in request.columns or name.strip().casefold() == part
        if plain and (not why_unit or part in request.units):
            continue
        sentence = f"{part} = {name!r}" + (f" in {unit}" if unit else "")
        reason, others = guess.reasons.get(part, ("", []))
        notes = [reason] if reason not in ("", "by its name") else []
        notes += [f"{unit} {why_unit}"] if why_unit and part not in request.units else []
        if others:
            also = ", ".join(repr(header[place]) for place in others)
            notes.append(f"{also} would do too")
        told.append(sentence + (f" ({'; '.join(notes)})" if notes else ""))
    if guess.date is not None:
        told.append(f"the date of the time = {header[guess.date]!r}")
    if not told:
        return []
    return [f"columns, as guessed: {'; '.join(told)}. Say otherwise with --columns and --units"]


def _place(path, header, name, taken=()):
    """Position of a column by its name, or by that but for blanks around it and capitals."""
    if name in header:
        found = [place for place, other in enumerate(header) if other == name]
    else:
        plain = name.strip().casefold()
        found = [
            place
            for place, other in enumerate(header)
            if other.strip().casefold() == plain and other not in taken
        ]
    if len(found) > 1:
        names = " and ".join(repr(header[place]) for place in found)
        raise LogError(f"{path}: the header has {names}; which is meant? Rename one of them.")
    return found[0] if found else None


def _no_column(part, name, header):
    found = ", ".join(map(repr, header[:20])) + (", ..." if len(header) > 20 else "")
    # Columns that are called as another part are that.
    free = [other for other in header if other.strip().casefold() not in COLUMNS]
    close = [part] if part in header else difflib.get_close_matches(name, free, n=1, cutoff=0.4)
    advice = f"{part}={close[0]}" if close else f"{part}=NAME"
    return (
        f"there is no column {name!r} for the {part}; the file has {found}. Say which it is "
        f"(columns: {advice})."
    )
