"""Rules that do nothing are found, and can go."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis import ANFISRegressor
from skanfis.learning.firing import RuleFiring
from skanfis.membership import Gaussian
from skanfis.training.pruning import redundant_rules

from .. import oracles


def statistics(rows, antecedent):
    firing = RuleFiring.of(rows, antecedent, 0)
    return firing.overlap / rows.total_weight, firing.peak


def test_rules_far_away_and_rules_alike_are_found():
    rows = oracles.bumpy_rows(np.random.default_rng(0), 300, 2)
    centers = [[-1, 0], [1, 0], [1, 0], [40, 40]]
    antecedent = oracles.scattered_of_one_width(Gaussian, centers, 0.5)
    found = redundant_rules(*statistics(rows, antecedent))
    assert [entry["rule"] for entry in found] == [2, 3]
    assert [entry["reason"] for entry in found] == ["repeats rule 1", "never fires"]
    assert found[1]["weight"] < 1e-6
    assert found[0]["weight"] > 0.1


# Two clumps of rows on the diagonal: half of a grid's cells are empty.
G = np.random.default_rng(0)
CLUMP = G.integers(0, 2, 400)
X = np.column_stack([CLUMP, CLUMP]) * 40.0 + 0.3 * G.normal(size=(400, 2))
Y = np.where(CLUMP, X[:, 0], -X[:, 1]) + 0.05 * G.normal(size=400)


def test_empty_cells_are_reported_and_can_be_left_out():
    settings = {"solver": "lse", "alpha": 1e-8}
    whole = ANFISRegressor(n_mfs=4, **settings).fit(X, Y)
    # Terms 0 and 1 of one input never meet terms 2 and 3 of the other.
    empty = [4 * i + j for i in range(4) for j in range(4) if (i < 2) != (j < 2)]
    assert [r["rule"] for r in whole.redundant_rules_] == empty
    assert {r["reason"] for r in whole.redundant_rules_} == {"never fires"}
    left = whole.without_rules()
    kept = np.setdiff1d(np.arange(16), empty)
    before = whole.model_.strengths(X)[:, kept]
    assert_allclose(left.strengths(X), before / before.sum(axis=1, keepdims=True), atol=1e-12)
    assert_array_equal(left.consequents, whole.model_.consequents[kept])
    assert left.term_names == ("very low", "low", "high", "very high") * 2
    assert_allclose(left.rule_weights.sum(), 1.0)
    # Rules that never fire have no say, and those that are left speak for the same rows.
    assert_allclose(left.predict(X)[:, 0], whole.predict(X), atol=0.05)
    assert_allclose(left.coverage(X), whole.coverage(X), atol=0.01)
    pruned = ANFISRegressor(partition=left, **settings).fit(X, Y)
    assert pruned.n_rules_ == 8
    assert_allclose(pruned.loss_curve_[-1], whole.loss_curve_[-1], rtol=1e-2)


def test_rules_that_are_not_there_are_refused():
    two_rules = ANFISRegressor(n_mfs=[2, 1], max_iter=0).fit(X, Y)
    assert two_rules.redundant_rules_ == []
    assert two_rules.without_rules() is two_rules.without_rules([]) is two_rules.model_
    with pytest.raises(ValueError, match="rules has 2, but the model has 2 rules"):
        two_rules.without_rules([2])
    with pytest.raises(ValueError, match="names all 2 rules, but at least one must be left"):
        two_rules.without_rules([0, 1])
    for no_numbers in ([True, False], [1.9], "1", [1, None]):
        with pytest.raises(TypeError, match=r"rules=.* must be whole numbers: the numbers"):
            two_rules.without_rules(no_numbers)


def test_what_is_left_has_no_posterior_until_it_is_fitted():
    model = ANFISRegressor(n_mfs=2, solver="lse").fit(X, Y)
    left = model.without_rules([1])
    given = ANFISRegressor(partition=left, max_iter=0).fit(X, Y)
    assert_array_equal(given.predict(X), left.predict(X)[:, 0])
    with pytest.raises(ValueError, match=r"has no posterior, .* it lost rules"):
        given.predict(X, return_std=True)
    assert given.readability_.line in str(given.readability_)
    assert ANFISRegressor(partition=left).fit(X, Y).predict(X, return_std=True)[1].min() > 0.0


def test_parameters_are_counted_by_the_inputs_that_have_slopes(rng):
    """Of 36 rules with slopes by one of 60 inputs 72; the model keeps zeros by all others."""
    X = rng.normal(size=(300, 60))
    counts = [6, 6] + [1] * 58
    model = ANFISRegressor(n_mfs=counts, consequent_features=[0], max_iter=0).fit(X, X[:, 0])
    with pytest.raises(ValueError, match="it lost rules"):
        model.without_rules([0]).standard_deviation(X)
