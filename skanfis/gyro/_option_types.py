"""What the values of options may be, and what is said of those that may not."""

import argparse
import codecs
import math

from .errors import shortened

__all__ = [
    "MOST_RULES",
    "axis",
    "box",
    "count",
    "encoding",
    "extent",
    "factor",
    "gap",
    "jobs",
    "positive",
    "rules",
    "seconds",
    "share",
    "sign",
    "terms",
]

# A grid that could neither be told nor learnt: the search takes 36.
MOST_RULES = 500
# Counts beyond are slips of the finger; floats count up to here exactly.
_MANY = 10**15
# More threads than any machine has cores for.
_MOST_JOBS = 1024
# It becomes part of file names.
_LONGEST_AXIS = 20


def terms(text):
    if text in ("search", "auto"):
        return text
    try:
        numbers = tuple(int(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if not numbers or min(numbers) < 1:
        raise argparse.ArgumentTypeError(
            f"{shortened(text)} must be search, auto, or numbers such as 2,3,3"
        )
    n_rules = math.prod(numbers)
    if n_rules > MOST_RULES:
        made = f"{n_rules:,}" if n_rules < _MANY else "too many"
        raise argparse.ArgumentTypeError(
            f"{shortened(text, str)} makes {made} rules; at most {MOST_RULES} are learnt. Use "
            "fewer terms"
        )
    return numbers


def sign(text):
    found = "\t" if text == r"\t" else text
    if (
        len(found) != 1
        or found.isalnum()
        or not ((found.isprintable() and found.isascii()) or found == "\t")
        or found in "\"'+- "
    ):
        raise argparse.ArgumentTypeError(
            f"{shortened(text)} must be one character, such as a comma, and neither letter, digit, "
            "blank, quote, + nor -"
        )
    return found


def positive(text):
    return _number(text, float, lambda value: 0 < value < math.inf, "a positive number")


def extent(text):
    if text == "auto":
        return text
    what = "a number, zero or positive, or inf, or auto"
    return _number(text, float, lambda value: value >= 0, what)


def seconds(text):
    return _number(text, float, lambda value: 1e-9 <= value <= 1e9, "a number from 1e-9 to 1e9")


def rules(text):
    what = f"a whole number from 1 to {MOST_RULES}"
    return _number(text, int, lambda value: 1 <= value <= MOST_RULES, what)


def jobs(text):
    what = f"a whole number, 1 or more, or -1 for one per core; at most {_MOST_JOBS}"
    return _number(text, int, lambda value: 1 <= value <= _MOST_JOBS or value == -1, what)


def count(text):
    what = f"a whole number from 1 to {_MANY}"
    return _number(text, int, lambda value: 1 <= value <= _MANY, what)


def factor(text):
    what = "a number from 1e-30 to 1e30, or such a negative one"
    return _number(text, float, lambda value: 1e-30 <= abs(value) <= 1e30, what)


def gap(text):
    if text == "auto":
        return text
    return _number(text, float, lambda value: value > 0, "auto, a positive number, or inf")


def encoding(text):
    try:
        is_text = isinstance(codecs.lookup(text).incrementaldecoder().decode(b""), str)
    except (LookupError, ValueError, TypeError):
        is_text = False
    if not is_text:
        raise argparse.ArgumentTypeError(f"{shortened(text)} is no encoding of text that is known")
    return text


def axis(text):
    letter, equals, name = text.partition("=")
    # It becomes a folder's name.
    plain = letter.isascii() and letter.isalnum() and len(letter) <= _LONGEST_AXIS
    if not plain or bool(equals) != bool(name):
        raise argparse.ArgumentTypeError(f"{shortened(text)} must be such as x or x=NAME")
    return text


def box(text):
    name, _, ends = text.partition("=")
    try:
        low, high = map(float, ends.split(":"))
    except ValueError:
        low = high = math.nan
    if not (name and -math.inf < low <= high < math.inf):
        raise argparse.ArgumentTypeError(
            f"{shortened(text)} must be INPUT=LOW:HIGH, two numbers, such as temperature=-40:85"
        )
    return name, low, high


def share(text):
    return _number(text, float, lambda value: 0 <= value <= 1, "a number from 0 to 1")


def _number(text, kind, is_valid, what):
    try:
        value = kind(text)
    except ValueError:
        value = None
    if value is None or not is_valid(value):
        raise argparse.ArgumentTypeError(f"{shortened(text)} must be {what}")
    return value
