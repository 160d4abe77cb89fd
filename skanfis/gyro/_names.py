"""What the name of a column tells: its words, the unit that it ends in, the axis."""

import re
from dataclasses import dataclass

from ._columns import unit_in

__all__ = ["ColumnName"]

_BRACKETED = re.compile(r"[\[({<]([^\])}>]*)[\])}>]\s*$|[,/]\s*([^,/\s][^,]*)$")
# mV first: it is one word, for all its letters of two cases.
_WORD = re.compile(r"mV(?![A-Za-z])|[A-Z]?[a-zµäöüß°]+|[A-Z]+(?![a-z])|[0-9]+|[^\W\d_a-zA-Z]+")
# Names that hold two words without a sign between them.
_FUSED = re.compile(r"(gyro|gyr|omega|rate|imu|g|w|acc|accel|a|mag|m)([xyz])$")
_FULL = {"g": "gyro", "w": "omega", "gyr": "gyro", "a": "acc", "m": "mag"}


@dataclass(frozen=True)
class ColumnName:
    """A column's name, read: words in lower case, what its unit belongs to, the unit, the axis."""

    words: tuple[str, ...]
    quantity: str | None = None
    unit: str | None = None
    axis: str = ""

    @classmethod
    def read(cls, name, unit_line=""):
        """From the header's text, and what a line of units says of it."""
        meant, rest = unit_in(unit_line.strip("[](){} ")), name.strip()
        bracketed = _BRACKETED.search(rest)
        if bracketed and (found := unit_in(bracketed[1] or bracketed[2] or "")):
            meant, rest = meant or found, rest[: bracketed.start()]
        words = [part.casefold() for part in _WORD.findall(rest)]
        axis = ""
        split: list[str] = []
        for word in words:
            fused = _FUSED.match(word)
            split += [_FULL.get(fused[1], fused[1]), fused[2]] if fused else [word]
        for length in (3, 2, 1):
            # A name that is a unit and nothing else keeps it as its word too.
            found = unit_in("_".join(split[-length:])) if len(split) >= length else None
            if meant is None and found:
                meant, split = found, split[:-length] or split
        for letter in "xyz":
            if letter in split and len(split) > 1:
                axis = letter
        quantity, unit = meant or (None, None)
        return cls(tuple(word for word in split if word != axis), quantity, unit, axis)
