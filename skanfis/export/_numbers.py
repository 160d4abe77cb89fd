"""The numbers of a model as exported code computes with them: rounded, shifted, checked.

Inputs are relative to the model's reference, rounded to the type. z = x - reference is exact for
inputs near it, so that an offset (a time stamp, a raw count) costs no digits. Consequents are
relative to one value per output, so that sums stay small. It is added at the end, which is allowed
because strengths sum to one.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..antecedent import TreeAntecedent
from ..membership import Membership
from ._families import FORMULAS, check_own


class TermTable(NamedTuple):
    """Consecutive terms of one family: where they start, and their constants (n_terms, k)."""

    family: type[Membership]
    start: int
    constants: np.ndarray


class Numbers:
    """The numbers of a TSKModel to export: floating-point arrays of one type, and integers.

    ValueError if the type cannot hold them.
    """

    def __init__(self, model, dtype):
        self.dtype = dtype = np.dtype(dtype)
        names = model.input_names
        self.low = _rounded(model.minimum, dtype, "the minimum of", names=names)
        self.high = _rounded(model.maximum, dtype, "the maximum of", names=names)
        _check_apart(self.low, self.high, model)
        self.reference = reference = _rounded(model.reference, dtype, "the mean of", names=names)
        what = "the inverse spread of"
        self.inverse_spread = _rounded(1.0 / model.spread, dtype, what, True, names)
        # The model gets the rounded box: so exported code differs from it by rounding alone.
        box = {"minimum": self.low.astype(float), "maximum": self.high.astype(float)}
        self.model = model = replace(model, **box)
        self.terms = tuple(_term_tables(model, reference))
        self.term_input = model.antecedent.term_inputs
        # For a grid, terms per input, and where those of each input start; else None.
        self.counts = model.antecedent.grid_counts
        self.block_starts = np.cumsum([0, *(self.counts or ())])[:-1]
        # Positions of terms (n_rules, n_terms_per_rule); the number of all terms stands for none.
        # If no rule has a term, there is one column.
        rule_terms, n_terms = model.antecedent.rule_terms, model.antecedent.n_terms
        rule_terms = rule_terms if rule_terms.size else np.full((model.n_rules, 1), -1)
        self.rule_terms = np.where(rule_terms < 0, n_terms, rule_terms)
        # For a tree, its nodes from the root on: their constants, inputs, and what is below each.
        self.nodes = None
        if isinstance(model.antecedent, TreeAntecedent):
            order, self.node_ends = model.antecedent.walk
            self.nodes, self.node_input = self.terms[0].constants[order], self.term_input[order]
        # Coefficients (n_rules, n_outputs, 1 + n_slopes) minus an offset, and inputs with slopes.
        offset, coefficients, slopes = _consequents(model, reference)
        self.slope_input = slopes
        self.offset = _rounded(offset, dtype, "a typical value of", names=model.output_names)
        # A slope matters by what it adds to an output over the box, not by its size.
        adds = np.abs(coefficients) * np.append(1.0, (model.maximum - model.minimum)[slopes])
        matters = adds > np.finfo(dtype).eps * adds.max(axis=(0, 2), keepdims=True)
        self.consequents = _rounded(coefficients, dtype, "a consequent", matters)
        # How far the tangent is followed in each input; limited so that the sum stays finite.
        end = float(np.finfo(dtype).max)
        with np.errstate(over="ignore"):
            reach = min(model.max_extrapolation, 0.25 * end / model.n_inputs) * model.spread
        self.reach = _rounded(np.minimum(reach, end), dtype, "a reach", matters=False)
        # The tangent of group g is found with inputs of groups 0 and g at the row, all others at
        # ``tangent_at``, relative to the reference. None if no input is held at ``tangent_at``.
        self.tangent_group = None
        if model.tangent_at is not None and model.antecedent.n_terms:
            is_held = np.isfinite(model.tangent_at)
            self.tangent_group = np.where(is_held, np.cumsum(is_held), 0)
            at = np.where(is_held, model.tangent_at - reference, 0.0)
            self.tangent_at = _rounded(at, dtype, "the median of", names=names)
        # (2, n_outputs); None if outputs are not limited.
        self.output_limits = None
        if model.out_of_bounds == "linear" or np.isfinite(model.output_limits).any():
            # An output without limit gets the largest number as limit.
            self.output_limits = rounded_within(np.clip(model.output_limits, -end, end), dtype)
        # A row per rule: share, radius, centre, and the factor row by row up to the diagonal.
        self.support = None if model.support is None else _support(model, reference)


def rounded_within(limits, dtype):
    """Limits, low and high (2, n_outputs), in a type, rounded inwards."""
    low, high = limits.astype(dtype)
    inf = dtype.type(np.inf)
    low = np.where(low < limits[0], np.nextafter(low, inf), low)
    high = np.where(high > limits[1], np.nextafter(high, -inf), high)
    return np.stack([low, high])


def _check_apart(low, high, model):
    is_lost = (low == high) & (model.minimum < model.maximum)
    if is_lost.any():
        j = np.argmax(is_lost)
        raise ValueError(
            f"Single precision holds all values of {model.input_names[j]!r} in the training data "
            f"as one number, {low[j]:.9g}. Subtract an offset before training and before the call, "
            "or export in double precision."
        )


def _rounded(values, dtype, what, matters=None, names=()):
    """Values in a type; numbers that would be subnormal, with fewer digits, become zero.

    ValueError if this happens to a value that ``matters`` (default: the largest), or if one is
    too large for the type. ``names`` are those of the columns that the values are of, if any.
    """
    values, sizes = np.asarray(values, dtype=float), np.abs(values)
    least, most = float(np.finfo(dtype).tiny), float(np.finfo(dtype).max)
    matters = sizes == sizes.max(initial=0.0) if matters is None else matters
    lost = (sizes > most) | (matters & (sizes > 0.0) & (sizes < least))
    if lost.any():
        name, way_out = "Double precision", "Scale the data."
        if dtype == np.float32:
            name, way_out = "Single precision", "Scale the data, or export in double precision."
        what = f"{what} {names[np.argmax(lost)]!r}" if names else what
        raise ValueError(
            f"{name} cannot hold {what}, {sizes[lost][0]:g}, with all its digits: it goes from "
            f"{least:.2g} to {most:.2g}. {way_out}"
        )
    return np.where(sizes < least, 0.0, values).astype(dtype)


def _term_tables(model, reference):
    start = 0
    for group in model.antecedent.groups:
        family, inputs = group.family, group.inputs
        check_own(family)
        theta = group.theta.copy()
        theta[0] -= reference[inputs]
        constants = np.column_stack(FORMULAS[family].constants(theta))
        what = f"a constant of a {family.name} membership"
        yield TermTable(family, start, _rounded(constants, reference.dtype, what))
        start += group.n_terms


def _consequents(model, reference):
    """Offset, coefficients (n_rules, n_outputs, 1 + n_slopes) minus it, and inputs with slopes."""
    coefficients = model.coefficients.transpose(0, 2, 1).copy()
    shift = reference.astype(float) - model.reference
    coefficients[:, :, 0] += coefficients[:, :, 1:] @ shift[: coefficients.shape[2] - 1]
    slope_inputs = np.flatnonzero((coefficients[:, :, 1:] != 0.0).any(axis=(0, 1)))
    offset = model.rule_weights @ coefficients[:, :, 0] / model.rule_weights.sum()
    coefficients[:, :, 0] -= offset
    return offset, coefficients[:, :, np.r_[0, 1 + slope_inputs]], slope_inputs


def _support(model, reference):
    """The numbers of each rule for coverage, relative to the rounded reference."""
    support, dtype = model.support, reference.dtype
    rows, columns = np.tril_indices(model.n_inputs)
    center, factor = support.center - reference.astype(float), support.factor[:, rows, columns]
    table = np.column_stack([support.share, support.radius, center, factor])
    table[support.share == 0.0] = 0.0
    return _rounded(table, dtype, "where the training data of a rule lie")
