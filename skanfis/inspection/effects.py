"""The effects of every input, and every pair of inputs: their shares of the output's variance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, compress
from operator import itemgetter
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from .._validation import checked_position
from ..digits import counted
from ..export import fold_with_rows
from ..export.columns import categories
from ..model import TSKModel
from .anova import N_DRAWS, N_VALUES, Block, DrawnAnova, ProductAnova, blocks_of_rows, draw
from .labels import MOST_NAMED, in_one_line

# A note tells of shares that differ by more, and of outputs held on a larger part of combinations.
_DIFFERENT, _HELD = 0.1, 0.01
_N_HELD = 10_000  # combinations drawn to find this part
_DIGITS = 3  # of printed shares


@dataclass(frozen=True, eq=False, repr=False)
class Effects:
    """The result of :func:`effects`; it prints as the table and the notes on it."""

    table: pd.DataFrame
    held: float
    notes: list[str]
    _printed: pd.DataFrame

    def __repr__(self):
        # As a notebook shows it.
        table = self._printed.round(_DIGITS) + 0.0
        table = table.to_string(float_format=f"{{:.{_DIGITS}f}}".format)
        return "\n".join([table, *map(in_one_line, self.notes)])


def effects(
    estimator: Any,
    X: ArrayLike | None = None,
    *,
    groups: Mapping[str, Sequence[int | str]] | None = None,
    output: int | str = 0,
) -> Effects:
    r"""Find the part of the output's variance that is due to each input, and to each pair of them.

    This is the functional ANOVA of the sum of rules, before it is held, in the range of training,
    under the product of the inputs' distributions. It is exact for grids and trees, whose strengths
    are products of one function per input. For other rules it uses 20,000 draws; a note says so.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        As for :func:`skanfis.export.fold`. Columns that a OneHotEncoder makes of one category enter
        as one.
    X : array-like of shape (n_samples, n_features), default=None
        Rows whose distributions are taken, input by input. None: those of the training rows, which
        ``fit`` keeps (JSON, ``partial_fit`` and ``merge`` do not).
    groups : dict of str to sequence of str or int, default=None
        Columns or categories that enter as one, by a name for them. Needs X, for their joint
        distribution.
    output : int or str, default=0
        Which output.

    Returns
    -------
    effects : object with attributes
        ``table``: DataFrame with a row per input, category or group, then one per pair, strongest
        first, and with more than two inputs "three or more". Pairs that can have no effect, for
        want of terms, are left out. Column "sobol" has shares of the variance for independent
        inputs; with X, "rows" has Cov(component, output) / Var(output) over its rows [1]_, which
        may be negative. Each column sums to one, or zero if the output is constant. ``held``: part
        of the combinations of independent inputs on which the output would be held within its
        limits, from 10,000 draws. ``notes``: sentences. When printed, many rows without an effect,
        or with one below the error of draws, become one.

    Raises
    ------
    ValueError, TypeError
        As :func:`skanfis.export.fold`; if distributions are not known and X is not given; if a
        column is not there, or in two groups.

    References
    ----------
    .. [1] G. Li and H. Rabitz, "Global sensitivity analysis for systems with independent and/or
       correlated inputs", Journal of Physical Chemistry A 114 (2010) 6022-6032.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import effects
    >>> X, y = make_jang_sinc()
    >>> print(effects(ANFISRegressor(n_mfs=4).fit(X, y), X))
               sobol  rows
    x0         0.129 0.129
    x1         0.129 0.129
    x0 and x1  0.742 0.742
    """
    study = Study.of(estimator, X, output, groups)
    anova, labels = study.anova, study.labels
    ones = [(g,) for g in range(len(labels))]
    subsets = [*ones, *study.pairs()]
    columns = {"sobol": study.sobol(subsets)}
    if study.rows is not None:
        found, variance = anova.covariances(subsets, study.rows)
        # An output that is the same on all combinations is so on the rows, but for rounding.
        columns["rows"] = _shares(subsets, found, variance if anova.variance > 0.0 else 0.0)
    table = pd.DataFrame(columns, index=[" and ".join(labels[g] for g in v) for v in subsets])
    # Rounded, so that rounding errors do not change the order of inputs with equal shares.
    shares = table["sobol"].round(9).tolist()
    order = sorted(range(len(subsets)), key=lambda i: (len(subsets[i]), -shares[i]))
    table = table.iloc[order]
    printed = _as_printed(table, [subsets[i] for i in order], anova.error)
    if len(ones) > 2:
        left = (float(anova.variance > 0.0) - table.sum()).to_frame("three or more").T
        # Append it by position: an input may have the same label.
        table, printed = pd.concat([table, left]), pd.concat([printed, left])
    held = study.held
    notes = _notes(table, held, isinstance(anova, DrawnAnova))
    return Effects(table, held, notes, printed)


def _as_printed(table, subsets, error):
    """The table with one row for all inputs and pairs whose printed shares are zero.

    Shares below ``error`` count as zero. An input stays if a pair with it does, and a few rows stay
    in any case.
    """
    is_seen = (table.round(_DIGITS).abs() > error).any(axis=1).to_numpy()
    seen = {g for v in compress(subsets, is_seen) for g in v}
    is_seen = is_seen | [len(v) == 1 and v[0] in seen for v in subsets]
    if sum(~is_seen) <= MOST_NAMED:
        return table
    n_pairs = sum(len(v) > 1 for v in compress(subsets, ~is_seen))
    counts = {"input": sum(~is_seen) - n_pairs, "pair": n_pairs}
    name = " and ".join(counted(n, what) for what, n in counts.items() if n)
    return pd.concat([table[is_seen], table[~is_seen].sum().to_frame(f"{name} more").T])


def _shares(subsets, closed, variance):
    """Shares of components: those of pairs are without the shares of their inputs."""
    if variance <= 0.0:
        return np.zeros(len(subsets))
    found = dict(zip(subsets, closed, strict=True))
    return [(found[v] - sum(found[(g,)] for g in v if len(v) > 1)) / variance for v in subsets]


def _notes(table, held, is_by_draws):
    notes = []
    if "rows" in table:
        apart = table[(table["sobol"] - table["rows"]).abs() > _DIFFERENT]
        found = [f"{name} {rows:.2f} (else {own:.2f})" for name, own, rows in apart.itertuples()]
        if told := "; ".join(found):
            notes.append(f"Inputs go together in the rows, which changes shares: {told}.")
    if held > _HELD:
        notes.append(
            f"In {100.0 * held:.1f} % of the combinations of inputs, taken as independent, "
            "the output is held within its limits: shares are of the sum of rules before that."
        )
    if is_by_draws:
        notes.append(
            "The strengths of these rules are no products of functions of one input: shares are "
            f"from {N_DRAWS:,} draws, that of an input or a pair good to about {DrawnAnova.error}."
        )
        if "rows" not in table:
            notes[-1] += f" Inputs are drawn from {N_VALUES} quantiles each; for long tails give X."
    return notes


def importances(model: TSKModel) -> np.ndarray:
    """Sobol's total share of every input, over the sum of all, (n_outputs, n_inputs)."""
    blocks = _known(model, [(j,) for j in range(model.n_inputs)], None)
    anovas = [_anova(model, k, blocks) for k in range(model.n_outputs)]
    found = np.array([anova.totals() * (anova.variance > 0.0) for anova in anovas])
    total = found.sum(axis=1, keepdims=True)
    return found / np.where(total > 0.0, total, 1.0)


def _anova(model, output, blocks):
    is_product = blocks[0].moments is not None
    return (ProductAnova if is_product else DrawnAnova)(model, output, blocks)


def _known(model, blocks, rows):
    """Blocks of inputs with their distributions: over the rows, or if None those in training."""
    if rows is not None:
        return blocks_of_rows(model, blocks, rows)
    if model.support is None or not model.support.marginals:
        raise ValueError(
            "The model does not know how its inputs are distributed: it was not trained by fit, or "
            "it was read from a file. Give rows of its inputs as X to skanfis.inspection.effects."
        )
    found, two_valued = [], model.two_valued
    for inputs in blocks:
        own = list(inputs)
        if len(own) > 1 or two_valued[own[0]]:
            # Indicators of levels, at most one of which is 1: their means are the distribution.
            share = np.clip(model.reference[own], 0.0, 1.0)
            share = np.append(share, max(1.0 - share.sum(), 0.0))
            X = np.tile(model.reference, (share.size, 1))
            X[:, own] = np.eye(share.size)[:, :-1]
            found += blocks_of_rows(model, [inputs], X, share / share.sum())
        else:
            moments, values, _ = model.support.marginals[own[0]]
            values = model.reference[own] + model.spread[own] * values[:, None]
            values = np.clip(values, model.minimum[own], model.maximum[own])
            found.append(Block(inputs, values, None, moments))
    return found


@dataclass(frozen=True, eq=False)
class Study:
    """A model, the blocks of inputs that enter as one, and the ANOVA of one output over them."""

    model: TSKModel
    output: int
    labels: list[str]
    blocks: list[Block]
    levels: dict[str, list[str]]  # by category; the last joins all levels without an indicator
    rows: np.ndarray | None
    anova: ProductAnova | DrawnAnova

    @classmethod
    def of(cls, estimator, X, output, groups=None):
        """From an estimator; ValueError as of :func:`effects`."""
        model, rows = fold_with_rows(estimator, X)
        k = checked_position(output, model.output_names, "output")
        rows = None if rows is None else np.clip(rows, model.minimum, model.maximum)
        if groups and rows is None:
            raise ValueError("groups needs X: fit does not store how the inputs vary together.")
        if not isinstance(groups, Mapping | None):
            raise ValueError(f"groups={groups!r} must be a dict from names to lists of columns.")
        found, levels, lists = {}, {}, categories(model)
        for name, one in lists.items():
            found[name] = tuple(one.inputs)
            levels[name] = one.levels + ([" or ".join(one.others)] if one.others else [])
        for label, columns in (groups or {}).items():
            if isinstance(columns, str) or not len(columns):
                raise ValueError(f"groups[{label!r}]={columns!r} must list one or more columns.")
            own = set()
            for column in columns:
                if isinstance(column, str) and column in lists:
                    own.update(lists[column].inputs)
                else:
                    own.add(checked_position(column, model.input_names))
            for other in [name for name, inputs in found.items() if own & set(inputs)]:
                if other not in lists or not own >= set(found.pop(other)):
                    raise ValueError(
                        f"groups[{label!r}] shares columns with {other!r}: give it all columns of "
                        "a category, and none of another group."
                    )
            outside = [name for j, name in enumerate(model.input_names) if j not in own]
            if label in (*found, *outside):
                raise ValueError(
                    f"groups[{label!r}] has the same name as a column that is not in it: give it "
                    "another name."
                )
            found[label] = tuple(sorted(own))
        taken = {j for inputs in found.values() for j in inputs}
        found |= {name: (j,) for j, name in enumerate(model.input_names) if j not in taken}
        labels, inputs = map(list, zip(*sorted(found.items(), key=itemgetter(1)), strict=True))
        blocks = _known(model, inputs, rows)
        return cls(model, k, labels, blocks, levels, rows, _anova(model, k, blocks))

    def pairs(self):
        """Pairs of blocks by their positions, without those that are zero for want of terms."""
        terms = set(self.model.antecedent.term_inputs.tolist())
        active = [bool(terms & set(block.inputs)) for block in self.blocks]
        least = 1 if self.model.order else 2
        every = combinations(range(len(active)), 2)
        return [(g, h) for g, h in every if active[g] + active[h] >= least]

    def sobol(self, subsets):
        """Shares of inputs and pairs in the variance, if inputs are independent."""
        return _shares(subsets, [self.anova.closed(v) for v in subsets], self.anova.variance)

    @property
    def held(self):
        """Part of the combinations of independent inputs on which the output would be held."""
        rows = draw(self.blocks, _N_HELD, np.random.default_rng(0))
        y = replace(self.model, target=None).predict(rows)[:, self.output]
        low, high = self.model.output_limits[:, self.output]
        # What never changes leaves its limits by rounding errors alone.
        return float(np.mean((y < low) | (y > high))) if self.anova.variance > 0.0 else 0.0
