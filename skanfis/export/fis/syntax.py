"""The text of a .fis file: sections of entries, each with its line; nothing is ever evaluated.

Every pattern is anchored and passes over its line once, whatever the line holds.
"""

import re
from dataclasses import dataclass, field

from ..limits import LARGEST_NUMBER, shown

__all__ = ["Entry", "Section", "sections_of", "text_of"]

_HEAD = re.compile(r"\[(System|Rules|(?:Input|Output)[1-9][0-9]{0,5})\]")
_QUOTED = re.compile(r"'([^']*)'")
_WHOLE = re.compile(r"[0-9]{1,9}")
# fuzzylite writes them as 1.000.
_SIGNED_WHOLE = re.compile(r"(-?[0-9]{1,9})(?:\.0*)?")
_NUMBER = re.compile(r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_MEMBERSHIP = re.compile(r"'([^']*)'\s*:\s*'([^']*)'\s*,\s*\[([^\]]*)\]")
_RULE = re.compile(r"([^,]*),([^,(]*)\(([^()]*)\)\s*:(.*)")
_BETWEEN = re.compile(r"\s*,\s*|\s+")
# No number takes as many characters, and a longer text takes long to parse.
_LONGEST_NUMBER = 100
# Of sections in a file, and of entries or rules in a section: no sound file has more.
_MOST = 100_000


@dataclass(frozen=True)
class Entry:
    """What stands to the right of a key, or a rule; ``line`` is its number in the file."""

    line: int
    text: str

    def error(self, reason):
        """A ValueError that says where."""
        return ValueError(f"line {self.line}: {reason}")

    def name(self):
        """A name in single quotes, of printable characters."""
        match = _QUOTED.fullmatch(self.text)
        if match is None:
            raise self.error(f"expected a name in single quotes, found {shown(self.text)}.")
        return self._printable(match[1])

    def whole(self, lowest, highest):
        """A whole number within bounds."""
        if _WHOLE.fullmatch(self.text) is None:
            raise self.error(f"expected a whole number, found {shown(self.text)}.")
        number = int(self.text)
        if not lowest <= number <= highest:
            raise self.error(f"{number} is not between {lowest} and {highest}.")
        return number

    def interval(self):
        """Two numbers in square brackets, the first below the second."""
        if not (self.text.startswith("[") and self.text.endswith("]")):
            raise self.error(f"expected [low high], found {shown(self.text)}.")
        numbers = self._numbers(self.text[1:-1])
        if len(numbers) != 2 or not numbers[0] < numbers[1]:
            raise self.error(f"expected [low high] with low < high, found {shown(self.text)}.")
        return numbers

    def membership(self):
        """Name, function and parameters of a membership function."""
        match = _MEMBERSHIP.fullmatch(self.text)
        if match is None:
            raise self.error(f"expected 'name':'function',[parameters], found {shown(self.text)}.")
        return self._printable(match[1]), self._printable(match[2]), self._numbers(match[3])

    def rule(self):
        """Antecedent and consequent as lists of whole numbers; weight; 1 for AND, 2 for OR."""
        match = _RULE.fullmatch(self.text)
        if match is None:
            raise self.error(
                "expected a rule such as '1 2, 3 (1) : 1' (terms of the inputs, consequents, "
                f"weight, connection), found {shown(self.text)}."
            )
        antecedent, consequent = (self._signed_wholes(match[k]) for k in (1, 2))
        weights, connection = self._numbers(match[3]), match[4].strip()
        if len(weights) != 1 or connection not in ("1", "2"):
            raise self.error(
                f"expected '(weight) : connection', where the connection is 1 or 2, at the end of "
                f"{shown(self.text)}."
            )
        return antecedent, consequent, weights[0], int(connection)

    def _signed_wholes(self, text):
        numbers = []
        for token in text.split():
            match = _SIGNED_WHOLE.fullmatch(token)
            if match is None:
                raise self.error(
                    f"expected whole numbers of terms, found {shown(token)}; hedges, written as "
                    "fractions, are not supported."
                )
            numbers.append(int(match[1]))
        return numbers

    def _numbers(self, text):
        text = text.strip()
        return [self._number(token) for token in _BETWEEN.split(text)] if text else []

    def _number(self, token):
        if len(token) > _LONGEST_NUMBER or _NUMBER.fullmatch(token) is None:
            raise self.error(f"expected a finite number, found {shown(token)}.")
        number = float(token)
        if abs(number) > LARGEST_NUMBER:
            raise self.error(
                f"{token} is beyond {LARGEST_NUMBER:g}, the largest number that is read."
            )
        return number

    def _printable(self, text):
        if not text.isprintable():
            raise self.error(f"the name {shown(text)} has characters that cannot be printed.")
        return text


@dataclass(frozen=True)
class Section:
    """A section's entries by key, in order; those of [Rules] have none."""

    name: str
    line: int
    entries: dict = field(default_factory=dict)
    rules: list = field(default_factory=list)

    def take(self, key):
        """Remove and return the entry of a key; ValueError where there is none."""
        if key not in self.entries:
            raise ValueError(f"line {self.line}: [{self.name}] has no {key}.")
        return self.entries.pop(key)

    def check_empty(self):
        """Raise ValueError where a key is left that nothing has asked for."""
        for key, entry in self.entries.items():
            raise entry.error(f"[{self.name}] has the unknown key {shown(key)}.")


def text_of(data):
    """The text of a file's bytes: UTF-8, of which ASCII is a part."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = 1 + data.count(b"\n", 0, error.start)
        raise ValueError(
            f"line {line}: byte 0x{data[error.start]:02x} is not UTF-8 text; save the file in "
            "this encoding."
        ) from None


def sections_of(text):
    """Sections by name; comments, which begin with % or #, and empty lines are passed over."""
    sections: dict[str, Section] = {}
    current = None
    for number, line in enumerate(re.split(r"\r\n|\r|\n", text), start=1):
        line = line.strip()
        if not line or line[0] in "%#":
            continue
        entry = Entry(number, line)
        if line[0] == "[":
            match = _HEAD.fullmatch(line)
            if match is None:
                raise entry.error(
                    f"{shown(line)} is no section; [System], [Input1], [Output1], [Rules] are."
                )
            if match[1] in sections:
                raise entry.error(f"{line} stands here for the second time.")
            _check_number(entry, sections)
            current = sections[match[1]] = Section(match[1], number)
        elif current is None:
            raise entry.error(f"expected [System] before anything else, found {shown(line)}.")
        elif current.name == "Rules":
            _check_number(entry, current.rules)
            current.rules.append(entry)
        else:
            _add(current, entry)
    return sections


def _add(section, entry):
    key, separator, value = entry.text.partition("=")
    key = key.rstrip()
    if not separator:
        raise entry.error(f"expected key=value in [{section.name}], found {shown(entry.text)}.")
    if key in section.entries:
        raise entry.error(f"[{section.name}] has {shown(key)} for the second time.")
    _check_number(entry, section.entries)
    section.entries[key] = Entry(entry.line, value.lstrip())


def _check_number(entry, others):
    if len(others) == _MOST:
        raise entry.error(f"{_MOST:,} like this are the most that is read.")
