"""What terms are called: linguistic names for a grid, places for rules with terms of their own."""

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
    """A name for every term, unique on its input.

    Terms of a grid are in order and are called by it ("low", "medium", "high"); beyond seven they
    are numbered. Other terms are called by where they stand ("near 21.3").
    """
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


def given_term_names(antecedent, input_names, term_names):
    """The user's names, one per term; ValueError where they do not fit.

    ``term_names`` is a sequence of str for every input that has so many terms, or a mapping from
    input names to such sequences. Inputs that it does not speak of keep the default names.
    """
    names = list(default_term_names(antecedent))
    inputs = antecedent.term_inputs
    is_mapping = isinstance(term_names, Mapping)
    if is_mapping and (unknown := [key for key in term_names if key not in input_names]):
        raise ValueError(
            f"names has the key {unknown[0]!r}, which is no input; the inputs are "
            f"{', '.join(map(repr, input_names))}."
        )
    for j in np.unique(inputs):
        own = np.flatnonzero(inputs == j)
        if is_mapping and input_names[j] not in term_names:
            continue
        given = term_names[input_names[j]] if is_mapping else term_names
        _check_given(given, own.size, input_names[j])
        for t, name in zip(own, given, strict=True):
            names[t] = name
    return tuple(names)


def _near(places):
    """Places in as few digits as tell them apart; equal ones are numbered."""
    for digits in range(3, _MOST_DIGITS + 1):
        written = [_plain(place, digits) for place in places]
        if len(set(written)) == len(set(places)):
            break
    counts: dict[str, int] = {}
    names = []
    for text in written:
        counts[text] = counts.get(text, 0) + 1
        names.append(f"near {text}" + (f" ({counts[text]})" if counts[text] > 1 else ""))
    return names


def _plain(number, digits):
    """So many significant digits, without an exponent where a person would write none."""
    if 1e-4 <= abs(number) < 1e9:
        shown = {"precision": digits, "unique": False, "fractional": False, "trim": "-"}
        return np.format_float_positional(number, **shown)
    return f"{number:.{digits}g}"


def _check_given(given, n_terms, input_name):
    if isinstance(given, str) or not all(isinstance(name, str) and name for name in given):
        raise TypeError(
            f"names for input {input_name!r} must be a sequence of non-empty str, got {given!r}."
        )
    if len(given) != n_terms:
        raise ValueError(
            f"names: there are {len(given)} names for input {input_name!r}, which has {n_terms} "
            "terms. Give one name per term, or a dict from input to names."
        )
    if len(set(given)) != len(given):
        raise ValueError(f"names for input {input_name!r} repeats a name: {list(given)!r}.")
