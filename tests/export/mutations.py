"""Spoilt files: what transmission, editors, bugs and attackers do to .fis and to JSON."""

import copy

import numpy as np

from skanfis.export import export_fis
from skanfis.membership import MEMBERSHIPS

from .. import oracles
from .fis_files import BY_HAND
from .rule_bases import MODELS, build

HOSTILE = [
    *(b"nan", b"-Infinity", b"1e999", b"1e50", b"-9.9e49", b"0", b"1_0", b"9" * 5000, b"1,,2"),
    *(b"", b"\xff\xfe", b"\n\n", b"[Rules]"),
    *(bytes([one]) for one in b"\x00\r\t'[]=(%"),
    *(b"NumRules=100000", b"NumMFs=10000", b"NumInputs=1000", b"MF1='x':'trimf',[0 0 0]"),
    *(b"__import__('os').system('true')", b"'sigmf'", b"'trimf'", b"'mamdani'", b"1 1, 1 (1) : 1"),
]


def seeds():
    """Sound files: every family, every kind of rule base, and one by hand."""
    rng = np.random.default_rng(0)
    families = [
        build(oracles.random_grid(rng, [family, family], [2, 3], [0, 2]), order=0)
        for family in MEMBERSHIPS.values()
    ]
    texts = [export_fis(model) for model in [*families, *MODELS.values()]]
    return [text.encode() for text in [*texts, *[BY_HAND] * len(texts)]]


def mutated(rng, sound):
    """One of the files with one or a few things done to it."""
    data = sound[rng.integers(len(sound))]
    for _ in range(min(rng.geometric(0.6), 6)):
        data = _OPERATIONS[rng.integers(len(_OPERATIONS))](rng, data)
    return data


def _place(rng, data):
    return int(rng.integers(len(data) + 1))


def _cut(rng, data):
    start = _place(rng, data)
    return data[:start] + data[start + int(rng.geometric(0.05)) :]


def _insert(rng, data):
    place = _place(rng, data)
    return data[:place] + HOSTILE[rng.integers(len(HOSTILE))] + data[place:]


def _replace_token(rng, data):
    """A number or word between blanks or signs by something hostile."""
    start = _place(rng, data)
    while start > 0 and data[start - 1 : start] not in b" [],=:'\n":
        start -= 1
    end = start
    while end < len(data) and data[end : end + 1] not in b" [],=:'\n":
        end += 1
    return data[:start] + HOSTILE[rng.integers(len(HOSTILE))] + data[end:]


def _lines(rng, data):
    """A line less, another line in its place, or half of each."""
    lines = data.split(b"\n")
    one, other = rng.integers(len(lines), size=2)
    half = lines[one][: len(lines[one]) // 2] + lines[other][len(lines[other]) // 2 :]
    lines[one : one + 1] = [[], [lines[other]], [half], [lines[one], lines[other]]][rng.integers(4)]
    return b"\n".join(lines)


_OPERATIONS = [_cut, _insert, _replace_token, _replace_token, _lines, _lines]

# Of JSON every number in turn.
HOSTILE_NUMBERS = [
    *(0, 0.0, -0.0, 1, -1, 1.5, -0.5, 114, -114, 300, -300),
    *(5e-324, 1e-320, 1e-60, 1e-40, 1e40, 1e50, -1e50, 1e51, 1e308, -1e308),
    *(2**63, 2**64, 10**30, -(10**30), 10**400, True, None, "1", [], {}),
]


def number_paths(document, path=()):
    """Paths of numbers, the first of every list only: the others are of the same kind."""
    if isinstance(document, dict):
        for key, value in document.items():
            yield from number_paths(value, (*path, key))
    elif isinstance(document, list):
        for place, value in enumerate(document[:1]):
            yield from number_paths(value, (*path, place))
    elif isinstance(document, int | float):
        yield path


def with_number(document, path, value):
    """The document with another value at a path."""
    changed = inner = copy.deepcopy(document)
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    return changed
