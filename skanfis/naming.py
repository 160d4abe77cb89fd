"""What terms are called: linguistic names for a grid, places for rules with terms of their own."""

from collections import Counter
from collections.abc import Mapping

import numpy as np

__all__ = ["LINGUISTIC", "default_output_names", "default_term_names", "given_term_names"]

# Six as in the founding paper, negative large to positive large; seven with zero between them.
LINGUISTIC = {
    1: ("any",),
    2: ("low", "high"),
    3: ("low", "medium", "high"),
    4: ("very low", "low", "high", "very high"),
    5: ("very low", "low", "medium", "high", "very high"),
    6: ("NL", "NM", "NS", "PS", "PM", "PL"),
    7: ("NL", "NM", "NS", "ZE", "PS", "PM", "PL"),
}
# More than these tell no two doubles apart.
_MOST_DIGITS = 17


def default_term_names(antecedent):
    """Names, unique on each input: of a grid by the order of its terms, else "near 21.3"."""
    inputs, places = antecedent.term_inputs, antecedent.term_places
    names = np.empty(inputs.size, dtype=object)
    for j in np.unique(inputs):
        own = np.flatnonzero(inputs == j)
        if antecedent.grid_counts is not None:
            numbered = [f"level {k + 1}" for k in range(own.size)]
            names[own] = LINGUISTIC.get(own.size, numbered)
        else:
            names[own] = _near(places[own])
    return tuple(names)


def default_output_names(n_outputs):
    """The name "y", or "y0", "y1", ... of several outputs."""
    return ("y",) if n_outputs == 1 else tuple(f"y{k}" for k in range(n_outputs))


def given_term_names(antecedent, input_names, names):
    """The user's names, one per term, of every input or by input; ValueError if they do not fit."""
    found = list(default_term_names(antecedent))
    if isinstance(names, Mapping):
        unknown = [key for key in names if key not in input_names]
        if unknown:
            raise ValueError(
                f"names has the key {unknown[0]!r}, which is no input; the inputs are "
                f"{', '.join(map(repr, input_names))}."
            )
    for j in np.unique(antecedent.term_inputs):
        own, name = np.flatnonzero(antecedent.term_inputs == j), input_names[j]
        given = names.get(name) if isinstance(names, Mapping) else names
        if given is None:
            continue
        if isinstance(given, str) or not all(isinstance(one, str) and one for one in given):
            raise TypeError(
                f"names for input {name!r} must be a sequence of non-empty str, got {given!r}."
            )
        if len(given) != own.size:
            raise ValueError(
                f"names: there are {len(given)} names for input {name!r}, which has {own.size} "
                "terms. Give one name per term, or a dict from input to names."
            )
        if len(set(given)) != len(given):
            raise ValueError(f"names for input {name!r} repeats a name: {list(given)!r}.")
        for t, one in zip(own, given, strict=True):
            found[t] = one
    return tuple(found)


def _near(places):
    """Places in as few digits as tell them apart; equal ones are numbered."""
    for digits in range(3, _MOST_DIGITS + 1):
        written = [_plain(place, digits) for place in places]
        if len(set(written)) == len(set(places)):
            break
    counts: Counter = Counter()
    names = []
    for text in written:
        counts[text] += 1
        names.append(f"near {text}" + (f" ({counts[text]})" if counts[text] > 1 else ""))
    return names


def _plain(number, digits):
    """So many significant digits, without an exponent where a person would write none."""
    if 1e-4 <= abs(number) < 1e9:
        shown = {"precision": digits, "unique": False, "fractional": False, "trim": "-"}
        return np.format_float_positional(number, **shown)
    return f"{number:.{digits}g}"
