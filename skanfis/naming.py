r"""Names of terms: words such as "low" on a grid, places such as "near 21 ± 4" in other rules.

A Gaussian term with center c and width h is "near c ± h". One side of a cut at c with width h is
"> c ± h log 9": at this distance from the cut its membership is 0.9. A cut between the only two
values of an input needs no width: its side is "> c", or the value itself if these are 0 and 1.
"""

from collections import Counter
from collections.abc import Mapping

import numpy as np

from .antecedent.tree import CRISP
from .digits import counted, in_digits, plain, rounded, told_apart
from .membership import Gaussian, SigmoidFalling, SigmoidRising

# Six names as in the founding paper, negative large to positive large; seven add zero.
LINGUISTIC = {
    1: ("any",),
    2: ("low", "high"),
    3: ("low", "medium", "high"),
    4: ("very low", "low", "high", "very high"),
    5: ("very low", "low", "medium", "high", "very high"),
    6: ("NL", "NM", "NS", "PS", "PM", "PL"),
    7: ("NL", "NM", "NS", "ZE", "PS", "PM", "PL"),
}

# Families whose terms are named by place and length: the text before the place, and the length in
# widths of the term. At log 9 widths from its place, a side of a cut has the membership 0.9.
WRITTEN = {
    SigmoidRising: ("> ", np.log(9.0)),
    SigmoidFalling: ("< ", np.log(9.0)),
    Gaussian: ("near ", 1.0),
}
# Digits written of a length, and the most of them where terms would otherwise share a name.
_DIGITS_OF_LENGTH, _MOST_DIGITS_OF_LENGTH = 2, 9
# Relative to the range: rounding error of a cut between two values; distance of equal places.
_ROUNDING, _ALIKE = 1e-6, 1e-9
_MOST_LISTED = 10  # names in a line


def default_term_names(model, digits=_DIGITS_OF_LENGTH):
    """Names of all terms: on a grid by their order, or "0" and "1" of an input with only these.

    Other rules have "> 6.8 ± 0.3" and "near 21.3 ± 4.2", with ``digits`` digits of the length, or
    "near 21.3" for families without a length. Different terms of an input have different names.
    """
    antecedent, minimum, maximum = model.antecedent, model.minimum, model.maximum
    inputs, places = antecedent.term_inputs, antecedent.term_places
    names, two_valued = np.empty(inputs.size, dtype=object), model.two_valued
    for j in np.unique(inputs):
        own = np.flatnonzero(inputs == j)
        if antecedent.grid_counts is not None and own.size == 2 and two_valued[j]:
            names[own] = "0", "1"
        elif antecedent.grid_counts is not None:
            numbered = [f"level {k + 1}" for k in range(own.size)]
            names[own] = LINGUISTIC.get(own.size, numbered)
        else:
            names[own] = _near(places[own], maximum[j] - minimum[j])
    start = 0
    for group in antecedent.groups:
        is_written = antecedent.grid_counts is None and group.family in WRITTEN
        for j in np.unique(group.inputs) if is_written else ():
            own = np.flatnonzero(group.inputs == j)
            names[start + own] = _written(group, own, minimum[j], maximum[j], digits)
        start += group.n_terms
    return tuple(names)


def is_crisp(cut, width, low, high):
    """Whether a cut stands half-way between the ends of a range, too narrow to blur an end."""
    size = high - low
    is_between = abs(2.0 * cut - low - high) <= _ROUNDING * size
    return is_between & (2.0 * CRISP * width <= (1.0 + _ROUNDING) * size)


def _written(group, own, low, high, fewest):
    """Names of terms of one input and family; the length decides the digits of the place.

    Terms that would look alike get more digits. Equal terms of different rules share a name.
    """
    sign, per_width = WRITTEN[group.family]
    places, log_widths = group.theta[:, own]
    widths = np.exp(log_widths)
    alone = (group.family is not Gaussian) & is_crisp(places, widths, low, high)
    # A cut between two values stands in their exact middle: undo its rounding.
    places = np.where(alone, 0.5 * (low + high), places)
    lengths = np.where(alone, 0.5 * (high - low), widths * per_width)
    most = max(fewest, _MOST_DIGITS_OF_LENGTH)
    # Terms that no number of digits would tell apart are equal.
    places = rounded(places, lengths, most)
    lengths = np.array([float(in_digits(length, most)) for length in lengths])
    terms = list(zip(places, lengths, alone, strict=True))
    names: dict[tuple, str] = {}
    for digits in range(fewest, most + 1):
        written = {}
        ats = rounded(places, lengths, digits)
        for (place, length, is_alone), at in zip(terms, ats, strict=True):
            # Rounding must not move a cut between rows to where it is beyond all rows.
            if per_width > 1.0 and low < place < high and not low < at < high and digits < most:
                continue
            text = sign + plain(at)
            if not is_alone:
                text += f" ± {in_digits(length, digits)}"
            written[place, length, is_alone] = text
        taken = Counter(written.values())
        for term, text in written.items():
            if term not in names and (taken[text] == 1 or digits == most):
                names[term] = text
        if len(names) == len(set(terms)):
            break
    if max(abs(low), abs(high - 1.0)) <= _ROUNDING:
        names |= {term: "1" if sign == "> " else "0" for term in terms if term[2]}
    return [names[term] for term in terms]


def parameters_written(name, family, theta):
    """Place and log width as the name of a term states them; ``theta`` for those not stated."""
    _, *numbers = name.replace("±", "").split()
    if not numbers:
        return theta
    place, *length = map(float, numbers)
    log_width = np.log(length[0] / WRITTEN[family][1]) if length else theta[1]
    return np.array([place, log_width])


def default_output_names(n_outputs):
    """The name "y", or "y0", "y1", ... of several outputs."""
    return ("y",) if n_outputs == 1 else tuple(f"y{k}" for k in range(n_outputs))


def target_names(y, n_outputs):
    """The name of a Series or names of a frame's columns, if all are str; else the default ones."""
    names = list(getattr(y, "columns", [getattr(y, "name", None)]))
    is_named = len(names) == n_outputs and all(isinstance(name, str) and name for name in names)
    return tuple(names) if is_named else default_output_names(n_outputs)


def given_term_names(model, names):
    """Names of all terms, given for every input or by input; ValueError if they do not fit."""
    antecedent, input_names = model.antecedent, model.input_names
    found = list(default_term_names(model))
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
        is_list = np.iterable(given) and not isinstance(given, str)
        if not is_list or not all(isinstance(one, str) and one for one in given):
            raise TypeError(
                f"names for input {name!r} must be a sequence of non-empty str, got {given!r}."
            )
        if len(given) != own.size:
            raise ValueError(
                f"names for input {name!r}: {len(given)} given for {own.size} terms. Give one name "
                "per term, or a dict from input to names."
            )
        if len(set(given)) != len(given):
            raise ValueError(f"names for input {name!r} repeats a name: {list(given)!r}.")
        for t, one in zip(own, given, strict=True):
            found[t] = one
    return tuple(found)


def _near(places, size):
    """Names of places, in as few digits as tell them apart; equal places are numbered."""
    if 0.0 < size < np.inf:
        places = _ALIKE * size * np.round(places / (_ALIKE * size)) + 0.0
    return distinct(f"near {text}" for text in told_apart(places, 3))


def listed(names, what):
    """Say "'speed', 'load'" or, of more names than a line has room for, "60 inputs"."""
    return ", ".join(map(repr, names)) if len(names) <= _MOST_LISTED else counted(len(names), what)


def distinct(names, numbered="{} ({})"):
    """Make all names different: a name that is taken gets a number."""
    taken: dict[str, int] = {}
    found = []
    for name in names:
        while name in taken:
            taken[name] += 1
            name = numbered.format(name, taken[name])
        taken[name] = 1
        found.append(name)
    return tuple(found)
