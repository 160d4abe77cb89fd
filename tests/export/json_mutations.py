"""Every number of a JSON document in turn by what an editor, a bug or an attacker puts there."""

import copy

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


def mutated_numbers(document, part=0, parts=1):
    """Pairs of a number's path and a hostile value: all, or one of so many equal parts of them.

    A prime number of parts gives every path values of its own, and each part every value.
    """
    pairs = [(path, value) for path in number_paths(document) for value in HOSTILE_NUMBERS]
    return pairs[part::parts]


def with_number(document, path, value):
    """The document with another value at a path."""
    changed = inner = copy.deepcopy(document)
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    return changed
