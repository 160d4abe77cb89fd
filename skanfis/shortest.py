"""Which tables of a posterior are quick: in fewer digits, and in fewer products, where those do.

What a deviation is asked for nobody knows to five digits: of n rows that leave n - k degrees of
freedom the noise itself is known to one part in the root of 2 (n - k), of 2,000 rows to 1.6 %.
``DIGITS`` is a thirtieth of that. Tables are taken for right where they are so at points all over
the range; where none of single precision are, they are in double.
"""

from dataclasses import replace
from itertools import chain

import numpy as np

__all__ = [
    "DIGITS",
    "SINGLE_DIGITS",
    "points_of_range",
    "shortest_tables",
    "single_tables",
]

# What part of a deviation may be wrong: by tables for rows in the range, and by those for rows out
# of it, where small parts grow; and at how many points they are compared.
DIGITS, SINGLE_DIGITS, _N_COMPARED = 5e-4, 1e-5, 1024
# Points of the range at which products are found that others make up for.
_N_EVEN = 512
# What a form in fewer products may leave out, in squares of the noise.
_SHORTENED = 4e-6
# Of ``DIGITS`` what every factor of the form may leave out, root mean square, and what halves of
# the premises may at any point; less where other points show that to be too much.
_PARTS = ((0.12, 0.8), (0.12, 0.5), (0.12, 0.25), (0.03, 0.25))
# Of a term its middle and so many widths to either side, in so many points.
_WIDTHS, _POINTS_PER_TERM = 4.0, 65


def points_of_range(model, n_points, rng):
    """Points all over the box, and as many where terms change, (n_inputs, n_points).

    Of every input alone they are spread evenly; inputs go together at random. Where the box is much
    wider than the terms, which outliers make it, the even ones say next to nothing of these.
    """
    half, points = n_points // 2, []
    for j, (low, high) in enumerate(zip(model.minimum, model.maximum, strict=True)):
        even = np.linspace(low, high, n_points)
        near = _about_terms(model.antecedent, j)
        if near.size:
            near = np.sort(np.clip(near, low, high))
            even[::2] = near[np.linspace(0, near.size - 1, n_points - half).astype(int)]
        points.append(rng.permutation(even))
    return np.stack(points)


def _about_terms(antecedent, j):
    """Points about all terms of an input, within ``_WIDTHS`` of their widths."""
    found = [np.empty(0)]
    for group in antecedent.groups:
        natural = group.family.natural(group.theta[:, group.inputs == j])
        kinds = np.array([parameter.kind for parameter in group.family.parameters])
        width = _WIDTHS * natural[kinds == "log_width"].sum(axis=0)
        found.append(np.linspace(natural[0] - width, natural[0] + width, _POINTS_PER_TERM).ravel())
    return np.concatenate(found)


def single_tables(model, double, row_of, deviations):
    """Tables in single precision that are right to ``SINGLE_DIGITS``, or ``double``.

    Parameters
    ----------
    model : TSKModel
    double : DeviationTables
    row_of : callable
        The derivative rows (``DerivativeRows``) at points (n_inputs, n_points).
    deviations : callable
        Of points and tables the deviations in the range, (n_outputs, n_points).
    """
    if not np.isfinite(model.maximum - model.minimum).all():
        return double
    rng = np.random.default_rng(0)
    with np.errstate(all="ignore"):
        row = row_of(points_of_range(model, _N_EVEN, rng))
        short = _shortened(double, row)
        return _first_right(model, rng, deviations, double, [short, double], SINGLE_DIGITS)


def shortest_tables(noise, model, double, row_of, deviations):
    """The same in as few products as leave deviations in the range right to ``DIGITS``.

    ``noise`` (n_outputs,) is that of every output.
    """
    if not np.isfinite(model.maximum - model.minimum).all():
        return double
    rng = np.random.default_rng(0)
    with np.errstate(all="ignore"):
        Z = points_of_range(model, _N_EVEN, rng)
        row = row_of(Z)
        short = _shortened(double, row)
        # Of a square in the noise's units twice the part that its error is of the deviation.
        weights = 0.5 * (double.unit / deviations(Z, double)) ** 2
        if not np.isfinite(weights).all():
            return double
        of_form = ((noise[:, None] / double.unit) ** 2 * weights).max(axis=0)
        turned = (
            replace(
                short, form=short.form.turned(row.shares, row.basis, of_form, form * DIGITS)
            ).without_weak_halves(row, weights, halves * DIGITS)
            for form, halves in _PARTS
        )
        # Where an output is very much larger than its noise, sums want all digits.
        either = (
            replace(one, is_narrow=is_narrow) for one in turned for is_narrow in (True, False)
        )
        candidates = chain(either, [short, double])
        return _first_right(model, rng, deviations, double, candidates, DIGITS)


def _shortened(double, row):
    return replace(double, form=double.form.shortened(row.shares, row.basis, _SHORTENED))


def _first_right(model, rng, deviations, double, candidates, digits):
    """The first of some tables that are right in single precision, or ``double``."""
    Z = points_of_range(model, _N_COMPARED, rng)
    right = deviations(Z, double)
    for tables in candidates:
        single = tables.astype(np.float32)
        if (np.abs(deviations(Z, single) - right) <= digits * right).all():
            return single
    return double
