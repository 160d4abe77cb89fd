"""The models of a calibration: the law, and rules with terms chosen by groups held out."""

from collections import Counter
from typing import Any

import numpy as np
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from .. import ANFISRegressor
from .compose import ResidualRegressor
from .physics import OpenLoopArcsineRegressor

# Of law and rules by turns: what dies away after power-on would bend the law that is fitted first.
ROUNDS = 2
# Of the law beside rules, in temperature: of degree 1 rules would have to bend for it.
_DEGREE = 2
# Terms are looked for among so many rows, and fitted to all. More rules than three terms of three
# inputs make were taken on no log that was tried, and looking at them takes half of the time.
_ROWS_FOR_SEARCH, _MOST_RULES = 1_500, 27
_FEWEST_GROUPS = 4  # whose range is that of the others when one is left out


def fit_model(X, target, groups, recipe):
    """The fitted estimator of a recipe, and its numbers of terms; groups tell what is not given."""
    terms, rules, rows = recipe.terms, None, np.arange(len(X))
    if isinstance(terms, str):
        rows = some_rows(_shared_rows(X, groups), _ROWS_FOR_SEARCH, X, np.random.default_rng(0))
        left = target
        if recipe.physics:
            left = target - make_law(recipe.inputs, _DEGREE, "linear").fit(X, target).predict(X)
        rules = _make_rules(recipe, terms)
        rules.fit(X.iloc[rows], left[rows], anfisregressor__groups=groups[rows])
        counts = Counter(term["input"] for term in rules[-1].memberships_)
        terms = tuple(max(counts[name], 1) for name in rules[-1].model_.input_names)
    if not recipe.physics:
        # What was found in all rows is fitted to them.
        is_done = rules is not None and rows.size == len(X)
        return rules if is_done else _make_rules(recipe, terms).fit(X, target), terms
    # In every round the same terms: looked for once, in what the law leaves.
    law, rules = make_law(recipe.inputs, _DEGREE, recipe.outside), _make_rules(recipe, terms)
    return ResidualRegressor(law, rules, n_rounds=ROUNDS).fit(X, target), terms


def _shared_rows(X, groups):
    """Rows in the range that two groups or more reach, of every input; all rows where few are.

    What a model makes of other rows while their group is held out is its tangent, and no figure of
    a calibration is of such rows: they shall not choose its terms.
    """
    by_group = X.groupby(groups)
    if by_group.ngroups < _FEWEST_GROUPS:
        return np.arange(len(X))
    low, high = np.sort(by_group.min(), axis=0)[1], np.sort(by_group.max(), axis=0)[-2]
    rows = np.flatnonzero(((low <= X) & (high >= X)).all(axis=1))
    return rows if 2 * rows.size >= len(X) else np.arange(len(X))


def _make_rules(recipe, terms):
    """A scaler and rules, of a grid of given numbers of terms or such as the recipe looks for."""
    structure: dict[str, Any] = {"partition": "grid", "max_rules": _MOST_RULES, "simplicity": 0.0}
    if isinstance(terms, tuple):
        structure = {"n_mfs": list(terms), "simplicity": 0.0}
    return make_pipeline(
        StandardScaler(), ANFISRegressor(**structure, out_of_bounds=recipe.outside)
    )


def some_rows(rows, n_rows, X, rng):
    """At most so many of the rows in their order, with those at the ends of every input's range."""
    if rows.size <= n_rows:
        return rows
    values = X.to_numpy()[rows]
    ends = np.concatenate([values.argmin(axis=0), values.argmax(axis=0)])
    chosen = rng.choice(rows.size, n_rows, replace=False)
    return rows[np.unique(np.concatenate([chosen, ends]))]


def make_law(inputs, degree, outside):
    """The arcsine law on the inputs that it can use."""
    knows_lag = {"temperature", "temperature_rate"} <= set(inputs)
    return OpenLoopArcsineRegressor(
        "output",
        "temperature" if "temperature" in inputs else None,
        # The lag of the thermometer is part of the law where it can be known.
        temperature_rate="temperature_rate" if knows_lag else None,
        amplitude_degree=degree,
        bias_degree=degree,
        out_of_bounds=outside,
    )
