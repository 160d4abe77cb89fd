"""The numbers of a model as other languages compute with them: rounded, shifted, checked.

Consequents are about the model's reference point, rounded to the type: z = x - reference is then
exact for inputs near it, and an offset (a time stamp, a raw count) costs no digits. They are about
one value per output as well: strengths sum to one, so that the value may be added at the end, and
what is summed is no larger than it must be. Memberships take the inputs themselves; ``_constants``
says how an offset costs them nothing either.
"""

from dataclasses import dataclass, replace
from math import fsum

import numpy as np

from ..antecedent import RuleTableAntecedent
from ..membership import Membership
from ._constants import CONSTANTS_OF

__all__ = ["Numbers", "TermTable", "as_held", "rounded_within"]


@dataclass(frozen=True, eq=False)
class TermTable:
    """Consecutive terms of one family.

    Attributes
    ----------
    start : int
        Position of the first term.
    constants : ndarray of shape (n_terms, k)
        Locations, the rests of locations if they are held in two parts, other constants.
    n_locations : int
    is_in_two : bool
    """

    family: type[Membership]
    start: int
    constants: np.ndarray
    n_locations: int
    is_in_two: bool

    @property
    def locations(self):
        """First parts, (n_terms, n_locations)."""
        return self.constants[:, : self.n_locations]

    @property
    def rests(self):
        """Second parts, (n_terms, n_locations); no columns where there are none."""
        return self.constants[:, self.n_locations : self.n_locations * (1 + self.is_in_two)]

    @property
    def others(self):
        """Other constants, (n_terms, n_others)."""
        return self.constants[:, self.n_locations * (1 + self.is_in_two) :]


@dataclass(frozen=True, eq=False)
class Numbers:
    """What is written: floating-point arrays of one type, and integers.

    Attributes
    ----------
    low, high, reference : ndarray of shape (n_inputs,)
        The box, and the point that consequents are about.
    inverse_spread : ndarray of shape (n_inputs,)
    terms : tuple of TermTable
    term_inputs : ndarray of int of shape (n_terms,)
    counts : tuple of int or None
        Terms per input of a grid; None for other rule bases.
    rule_terms : ndarray of int of shape (n_rules, n_terms_per_rule) or None
        Positions of terms, ``n_terms`` for none; None where they follow from the order of rules.
    terms_per_rule : int
    offset : ndarray of shape (n_outputs,)
        What all consequents are about.
    coefficients : ndarray of shape (n_rules, n_outputs, 1 + n_slopes)
    slope_inputs : ndarray of int of shape (n_slopes,)
        The inputs that take part in the consequents.
    reach : ndarray of shape (n_inputs,) or None
        How far the tangent is followed; None where it is without end.
    output_low, output_high : ndarray of shape (n_outputs,) or None
        What outputs are held within; None where they are not.
    support : ndarray of shape (n_rules, 2 + n_inputs + n_inputs (n_inputs + 1) / 2) or None
        Of each rule in coverage: its share, its radius, its centre, and its factor row by row up to
        the diagonal, for inputs about the reference in standard deviations. None where the model
        knows of no data.
    """

    dtype: np.dtype
    low: np.ndarray
    high: np.ndarray
    reference: np.ndarray
    inverse_spread: np.ndarray
    terms: tuple[TermTable, ...]
    term_inputs: np.ndarray
    counts: tuple[int, ...] | None
    rule_terms: np.ndarray | None
    terms_per_rule: int
    offset: np.ndarray
    coefficients: np.ndarray
    slope_inputs: np.ndarray
    reach: np.ndarray | None
    output_low: np.ndarray | None
    output_high: np.ndarray | None
    support: np.ndarray | None

    @classmethod
    def of(cls, model, dtype):
        """Numbers of a TSKModel in a floating-point type; ValueError where it cannot hold them."""
        dtype = np.dtype(dtype)
        antecedent = model.antecedent
        low, high, reference = (
            _rounded(values, dtype, f"{what} of an input")
            for values, what in [
                (model.minimum, "the minimum"),
                (model.maximum, "the maximum"),
                (model.reference, "the mean"),
            ]
        )
        rule_terms = None
        if isinstance(antecedent, RuleTableAntecedent):
            rule_terms = np.where(antecedent.rule_terms < 0, model.antecedent.n_terms, 0)
            rule_terms += np.maximum(antecedent.rule_terms, 0)
        offset, coefficients, slope_inputs = _consequents(model, reference)
        output_low, output_high = _output_limits(model, dtype)
        return cls(
            dtype=dtype,
            low=low,
            high=high,
            reference=reference,
            inverse_spread=_rounded(1.0 / model.spread, dtype, "the inverse spread of an input"),
            terms=tuple(_term_tables(model, low, high)),
            term_inputs=antecedent.term_inputs,
            counts=antecedent.grid_counts,
            rule_terms=rule_terms,
            terms_per_rule=antecedent.rule_terms.shape[1],
            offset=_rounded(offset, dtype, "a typical output"),
            coefficients=_rounded(coefficients, dtype, "a consequent"),
            slope_inputs=slope_inputs,
            reach=_reach(model, dtype),
            output_low=output_low,
            output_high=output_high,
            support=None if model.support is None else _support(model, reference),
        )

    @property
    def n_inputs(self):
        return self.low.size

    @property
    def n_outputs(self):
        return self.offset.size

    @property
    def n_rules(self):
        return self.coefficients.shape[0]

    @property
    def n_terms(self):
        return self.term_inputs.size

    @property
    def block_starts(self):
        """Where the terms of each input of a grid start."""
        return np.cumsum([0, *(self.counts or ())])[:-1]


def _reach(model, dtype):
    """How far the tangent is followed in a type, or None; its ends stand for what is beyond."""
    if np.isinf(model.max_extrapolation):
        return None
    limits = np.finfo(dtype)
    reach = model.max_extrapolation * model.spread
    held = np.minimum(reach, float(limits.max)).astype(dtype)
    return np.where(held < limits.tiny, dtype.type(0.0), held)


def _output_limits(model, dtype):
    """What outputs are held within, in a type, its ends standing for what is beyond; or None."""
    if not np.isfinite(model.output_limits).any():
        return None, None
    end = float(np.finfo(dtype).max)
    return rounded_within(np.clip(model.output_limits, -end, end), dtype)


def rounded_within(limits, dtype):
    """Limits, low and high (2, n_outputs), in a type; none is beyond what is given."""
    low, high = limits.astype(dtype)
    inf = dtype.type(np.inf)
    low = np.where(low < limits[0], np.nextafter(low, inf), low)
    high = np.where(high > limits[1], np.nextafter(high, -inf), high)
    return np.stack([low, high])


def _support(model, reference):
    """What coverage takes of each rule, about the reference as it is rounded."""
    support, dtype = model.support, reference.dtype
    center = (support.center - reference.astype(float)) / model.spread
    rows, columns = np.tril_indices(model.n_inputs)
    factor = (support.factor * model.spread)[:, rows, columns]
    table = np.column_stack([support.share, support.radius, center, factor])
    table[support.share == 0.0] = 0.0
    return _rounded(table, dtype, "where the training data of a rule lie")


def as_held(model, numbers):
    """The model with its box as the numbers round it, and with the terms that lie on its edges.

    What is left between it and a function on the numbers is the function's own rounding.
    """
    low, high = numbers.low, numbers.high
    groups = []
    for group in model.antecedent.groups:
        theta = group.theta.copy()
        location, rest = _on_rounded_edge(theta[0], group.inputs, model, low, high)
        theta[0] = location + rest
        groups.append(replace(group, theta=theta))
    return replace(
        model,
        antecedent=replace(model.antecedent, groups=tuple(groups)),
        minimum=low.astype(float),
        maximum=high.astype(float),
    )


def _rounded(values, dtype, what):
    """Values in a type; what it has only with fewer digits (subnormal numbers) becomes zero."""
    values = np.asarray(values, dtype=float)
    limits = np.finfo(dtype)
    largest = np.abs(values).max(initial=0.0)
    if not largest <= float(limits.max):
        raise ValueError(
            f"{_type_name(dtype)} cannot hold {what}, {largest:g}: it goes to "
            f"{float(limits.max):.2g}. Scale the data, or export in double precision."
        )
    if 0.0 < largest < float(limits.tiny):
        raise ValueError(
            f"{_type_name(dtype)} cannot hold {what}, {largest:g}, with all its digits: they "
            f"end below {float(limits.tiny):.2g}. Scale the data, or export in double precision."
        )
    return np.where(np.abs(values) < float(limits.tiny), 0.0, values).astype(dtype)


def _type_name(dtype):
    return "Single precision" if np.dtype(dtype) == np.float32 else "Double precision"


def _term_tables(model, low, high):
    groups = model.antecedent.groups
    for group in groups:
        if group.family not in CONSTANTS_OF:
            raise ValueError(
                f"Memberships {group.family.name!r} cannot be exported; "
                f"{', '.join(family.name for family in CONSTANTS_OF)} can."
            )
    dtype = low.dtype
    tables, start = [], 0
    for group in groups:
        what = f"a constant of a {group.family.name} membership"
        theta = group.theta.copy()
        theta[0], beyond = _on_rounded_edge(theta[0], group.inputs, model, low, high)
        locations, others = CONSTANTS_OF[group.family](theta)
        locations = [(*parts, beyond) for parts in locations]
        exact = np.array([[fsum(parts) for parts in zip(*loc, strict=True)] for loc in locations])
        near = _rounded(exact, dtype, what)
        parts_left = [
            [fsum([*parts, -float(first)]) for *parts, first in zip(*loc, row, strict=True)]
            for loc, row in zip(locations, near, strict=True)
        ]
        rest = np.array(parts_left).reshape(near.shape).astype(dtype)
        others = np.array([_rounded(other, dtype, what) for other in others])
        tables.append((group, start, near, rest, others))
        start += group.n_terms
    # One function per family: it adds a second part to locations if any of its terms needs it. In
    # single precision nearly all do.
    is_single = dtype == np.float32
    in_two = {group.family for group, _, _, rest, _ in tables if is_single or rest.any()}
    for group, start, near, rest, others in tables:
        is_in_two = group.family in in_two
        columns = [near, rest, others] if is_in_two else [near, others]
        constants = np.ascontiguousarray(np.vstack(columns).T)
        yield TermTable(group.family, start, constants, len(near), is_in_two)


def _on_rounded_edge(location, inputs, model, low, high):
    """Locations, where those on an edge of the box are on the edge as it is rounded; and the rest.

    A triangle that training has not moved has its corner on the edge, to a bit, and an input is
    held at the edge as it is rounded: it must lie on the same side of the corner as in the model.
    """
    rest = np.zeros_like(location)
    for edge, rounded in [(model.minimum, low), (model.maximum, high)]:
        exact, nearest = edge[inputs], rounded[inputs].astype(float)
        reach = np.maximum(np.abs(exact), (model.maximum - model.minimum)[inputs])
        is_on_edge = np.abs(location - exact) <= 16.0 * np.spacing(reach)
        rest = np.where(is_on_edge, location - exact, rest)
        location = np.where(is_on_edge, nearest, location)
    return location, rest


def _consequents(model, reference):
    """Offset, coefficients (n_rules, n_outputs, 1 + n_slopes) about it, and inputs with slopes."""
    coefficients = model.coefficients.transpose(0, 2, 1).copy()
    shift = reference.astype(float) - model.reference
    coefficients[:, :, 0] += coefficients[:, :, 1:] @ shift[: coefficients.shape[2] - 1]
    slope_inputs = np.flatnonzero((coefficients[:, :, 1:] != 0.0).any(axis=(0, 1)))
    offset = model.rule_weights @ coefficients[:, :, 0] / model.rule_weights.sum()
    coefficients[:, :, 0] -= offset
    return offset, coefficients[:, :, np.r_[0, 1 + slope_inputs]], slope_inputs
