"""The text of a .fis file: sections of entries, each with its line; nothing is ever evaluated.

Every pattern is anchored and passes over its line once, whatever the line holds.
"""

import re
from dataclasses import dataclass, field

from ..limits import LARGEST_NUMBER, shown

__all__ = ["Entry", "Section", "sections_of", "text_of"]

_HEAD = re.compile(r"\[(System|Rules|(?:Input|Output)[1-9][0-9]{0,5})\]")
_QUOTED = re.compile(r"'([^']*)'")
_BRACKETS = re.compile(r"\[(.*)\]")
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
        return self._printable(self._match(_QUOTED, "a name in single quotes")[1])

    def whole(self, lowest, highest):
        """A whole number within bounds."""
        number = int(self._match(_WHOLE, "a whole number")[0])
        if not lowest <= number <= highest:
            raise self.error(f"{number} is not between {lowest} and {highest}.")
        return number

    def interval(self):
        """Two numbers in square brackets, the first below the second."""
        numbers = self._numbers(self._match(_BRACKETS, "[low high]")[1])
        if len(numbers) != 2 or not numbers[0] < numbers[1]:
            raise self.error(f"expected [low high] with low < high, found {shown(self.text)}.")
        return numbers

    def membership(self):
        """Name, function and parameters of a membership function."""
        match = self._match(_MEMBERSHIP, "'name':'function',[parameters]")
        return self._printable(match[1]), self._printable(match[2]), self._numbers(match[3])

    def rule(self):
        """Antecedent and consequent as lists of whole numbers; weight; 1 for AND, 2 for OR."""
        match = self._match(
            _RULE,
            "a rule such as '1 2, 3 (1) : 1' (terms of the inputs, consequents, weight, "
            "connection)",
        )
        sides = []
        for tokens in (match[1].split(), match[2].split()):
            numbers = []
            for token in tokens:
                whole = _SIGNED_WHOLE.fullmatch(token)
                if whole is None:
                    raise self.error(
                        f"expected whole numbers of terms, found {shown(token)}; hedges, written "
                        "as fractions, are not supported."
                    )
                numbers.append(int(whole[1]))
            sides.append(numbers)
        weights, connection = self._numbers(match[3]), match[4].strip()
        if len(weights) != 1 or connection not in ("1", "2"):
            raise self.error(
                f"expected '(weight) : connection', where the connection is 1 or 2, at the end of "
                f"{shown(self.text)}."
            )
        return *sides, weights[0], int(connection)

    def _match(self, pattern, wanted):
        match = pattern.fullmatch(self.text)
        if match is None:
            raise self.error(f"expected {wanted}, found {shown(self.text)}.")
        return match

    def _numbers(self, text):
        text, numbers = text.strip(), []
        for token in _BETWEEN.split(text) if text else []:
            if len(token) > _LONGEST_NUMBER or _NUMBER.fullmatch(token) is None:
                raise self.error(f"expected a finite number, found {shown(token)}.")
            numbers.append(float(token))
            if abs(numbers[-1]) > LARGEST_NUMBER:
                raise self.error(
                    f"{token} is beyond {LARGEST_NUMBER:g}, the largest number that is read."
                )
        return numbers

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
            key, separator, value = (part.strip() for part in line.partition("="))
            if not separator:
                raise entry.error(f"expected key=value in [{current.name}], found {shown(line)}.")
            if key in current.entries:
                raise entry.error(f"[{current.name}] has {shown(key)} for the second time.")
            _check_number(entry, current.entries)
            current.entries[key] = Entry(number, value)
    return sections


def _check_number(entry, others):
    if len(others) == _MOST:
        raise entry.error(f"{_MOST:,} like this are the most that is read.")
