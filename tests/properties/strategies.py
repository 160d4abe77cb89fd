"""What properties are tried on: nasty tables, settings of the estimator, and frozen models."""

from collections import namedtuple

import numpy as np
from hypothesis import strategies as st

from skanfis.membership import FAMILIES, MEMBERSHIPS

from .. import oracles
from ..export.rule_bases import build

Table = namedtuple("Table", "X y sample_weight")

_seeds = st.integers(0, 2**32 - 1)
_sizes = st.sampled_from([1.0, 1.0, 1e-3, 1e6, 1e-50, 1e50, 1e-90, 1e90])


def _column(rng, kind, n_rows):
    normal = rng.normal(size=n_rows)
    return {
        "normal": normal,
        "constant": np.full(n_rows, normal[0]),
        "two values": np.where(normal > 0.0, 1.0, -1.0),
        "rounded": np.round(normal),
        "far from zero": normal + 1e7,
        "heavy tails": np.exp(3.0 * normal),
        "an outlier": np.where(np.arange(n_rows) == 0, 1e6, normal),
        "steps": np.floor(np.linspace(0.0, 5.0, n_rows)),
    }[kind]


_kinds = st.sampled_from(
    [
        *("normal", "normal", "constant", "two values", "rounded"),
        *("far from zero", "heavy tails", "an outlier", "steps"),
    ]
)


@st.composite
def tables(draw):
    """A table of one to three nasty columns, a nasty target, and weights or none."""
    rng = np.random.default_rng(draw(_seeds))
    n_rows, n_inputs = draw(st.integers(2, 40)), draw(st.integers(1, 3))
    columns = [draw(_sizes) * _column(rng, draw(_kinds), n_rows) for _ in range(n_inputs)]
    target = draw(_sizes) * _column(rng, draw(_kinds), n_rows)
    if draw(st.booleans()):
        # Something to learn.
        size = np.abs(columns[0]).max() or 1.0
        target = draw(_sizes) * np.sin(3.0 * columns[0] / size)
    weight = None
    if draw(st.booleans()):
        weight = draw(st.sampled_from([5e-324, 1e-200, 1.0, 1e200, 1e307])) * rng.uniform(
            0.5, 1.5, n_rows
        )
        weight[rng.uniform(size=n_rows) < 0.2] = 0.0
    return Table(np.column_stack(columns), target, weight)


settings_of_fit = st.fixed_dictionaries(
    {
        "order": st.sampled_from([0, 1]),
        "out_of_bounds": st.sampled_from(["clip", "linear"]),
        "mf": st.sampled_from(list(MEMBERSHIPS)),
        "max_iter": st.sampled_from([0, 1, 5]),
        "solver": st.sampled_from(["varpro", "hybrid", "lse"]),
        "n_mfs": st.sampled_from(["auto", 1, 2, 3]),
    }
)


@st.composite
def frozen_models(draw):
    """A model of any family, rule base, order and number of outputs."""
    rng = np.random.default_rng(draw(_seeds))
    family = draw(st.sampled_from(list(FAMILIES.values())))
    kind = draw(st.sampled_from(["grid", "tree", "scattered"]))
    if kind == "grid":
        counts = draw(st.lists(st.integers(2, 3), min_size=1, max_size=3))
        inputs = sorted(draw(st.permutations(range(3)))[: len(counts)])
        antecedent = oracles.random_grid(rng, [family] * len(counts), counts, inputs)
    elif kind == "tree":
        # Of more, .fis files refuse those that cut an input three times on a path.
        antecedent = oracles.random_tree(rng, draw(st.integers(2, 3)))
    else:
        antecedent = oracles.random_scattered(rng, family, draw(st.integers(1, 5)), (0, 1, 2))
    return build(antecedent, draw(st.sampled_from([0, 1])), draw(st.integers(1, 2)))
