"""Spoilt .fis files: what transmission, editors and attackers do to one."""

import numpy as np

from skanfis.export import export_fis
from skanfis.membership import MEMBERSHIPS

from .. import oracles
from .fis_files import BY_HAND
from .rule_bases import MODELS, build

HOSTILE = [
    *(b"nan", b"inf", b"-Infinity", b"1e999", b"-1e-999", b"1e50", b"-9.9e49", b"0", b"-0", b"1_0"),
    *(b"99999999999", b"9" * 5000, b"0x1F", b"1e", b".", b"--1", b"1,,2", b"\xd9\xa1", b"", b" "),
    *(b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"\r", b"\n", b"\n\n", b"\t", b"'", b"''", b"[", b"]"),
    *(b"=", b":", b"(", b")", b"%", b"#", b"[System]", b"[Rules]", b"[Input1]", b"[Output99]"),
    *(b"NumRules=100000", b"NumMFs=10000", b"NumInputs=1000", b"MF1='x':'trimf',[0 0 0]"),
    *(b"__import__('os').system('true')", b"eval('1')", b"${IFS}", b"';!ls;'", b"../../etc/passwd"),
    *(b"'sigmf'", b"'trimf'", b"'pimf'", b"'constant'", b"'mamdani'", b"'min'", b"1 1, 1 (1) : 1"),
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


def _flip(rng, data):
    place = _place(rng, data)
    return data[:place] + bytes([rng.integers(256)]) + data[place + 1 :]


def _digit(rng, data):
    """Another digit in place of one: the file stays sound, the system does not."""
    places = [k for k, byte in enumerate(data) if 48 <= byte <= 57]
    if not places:
        return data
    place = places[rng.integers(len(places))]
    return data[:place] + b"%d" % rng.integers(10) + data[place + 1 :]


def _cut(rng, data):
    start = _place(rng, data)
    return data[:start] + data[start + int(rng.geometric(0.05)) :]


def _end(rng, data):
    return data[: _place(rng, data)]


def _insert(rng, data):
    place = _place(rng, data)
    return data[:place] + HOSTILE[rng.integers(len(HOSTILE))] + data[place:]


def _repeat(rng, data):
    start, length = _place(rng, data), int(rng.geometric(0.02))
    return data[:start] + data[start : start + length] * int(rng.integers(2, 50)) + data[start:]


def _replace_token(rng, data):
    """A number or word between blanks or signs by something hostile."""
    start = _place(rng, data)
    while start > 0 and data[start - 1 : start] not in b" [],=:'\n":
        start -= 1
    end = start
    while end < len(data) and data[end : end + 1] not in b" [],=:'\n":
        end += 1
    return data[:start] + HOSTILE[rng.integers(len(HOSTILE))] + data[end:]


def _of_lines(change):
    def operation(rng, data):
        lines = data.split(b"\n")
        change(rng, lines, int(rng.integers(len(lines))), int(rng.integers(len(lines))))
        return b"\n".join(lines)

    return operation


def _swap(rng, lines, one, other):
    lines[one], lines[other] = lines[other], lines[one]


def _copy(rng, lines, one, other):
    lines.insert(other, lines[one])


def _drop(rng, lines, one, other):
    del lines[one]


def _mix(rng, lines, one, other):
    """The first half of one line and the second of another."""
    lines[one] = lines[one][: len(lines[one]) // 2] + lines[other][len(lines[other]) // 2 :]


_OPERATIONS = [
    *(_flip, _digit, _digit, _digit, _cut, _end, _insert, _repeat),
    *(_replace_token, _replace_token, _replace_token),
    *map(_of_lines, (_swap, _copy, _drop, _mix)),
]
