"""Rule bases against the product over every rule, divided by the sum over all rules."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.antecedent import GridAntecedent, RuleTableAntecedent
from skanfis.membership import MEMBERSHIPS, Bell, Gaussian

from .. import oracles, premises

# Terms without a foot, as the textbook's products need; some rules look at fewer inputs.
ANTECEDENTS = {name: one for name, one in premises.ANTECEDENTS.items() if name not in MEMBERSHIPS}
ANTECEDENTS |= {
    "one input": premises.grid([Gaussian], [3], [1]),
    "two rules": oracles.random_scattered(np.random.default_rng(2), Gaussian, 2, [0, 1, 2]),
    "one premise input": oracles.random_scattered(np.random.default_rng(2), Bell, 4, [2]),
    "rules listed one by one": oracles.random_table(np.random.default_rng(3)),
}
ALL = pytest.mark.parametrize("antecedent", ANTECEDENTS.values(), ids=list(ANTECEDENTS))


@pytest.fixture(name="Z")
def standardised_inputs(rng):
    return rng.normal(size=(3, 60))


@ALL
def test_strengths_are_products_over_the_sum_of_products(antecedent, Z, rng):
    """Of its own parameters, and of others, which it takes to the last bit."""
    own = antecedent.parameters
    for parameters in (own, own + 0.1 * rng.normal(size=own.size)):
        moved = antecedent.with_parameters(parameters)
        assert_array_equal(moved.parameters, parameters)
        expected = oracles.strengths(antecedent, parameters, Z)
        assert_allclose(moved.strengths(Z), expected, rtol=1e-11, atol=1e-300)
    assert_array_equal(moved.with_parameters(own).strengths(Z), antecedent.strengths(Z))
    told = [[t for t in rule if t >= 0] for rule in antecedent.rule_terms]
    assert told == [list(rule) for rule in oracles.rules_by_hand(antecedent)]
    assert antecedent.n_rules == len(antecedent.rule_terms)
    assert antecedent.n_terms == antecedent.rule_terms.max() + 1


@ALL
@pytest.mark.parametrize("distance", [1.0, 1e3, 1e6, 1e8])
def test_strengths_sum_to_one_wherever_a_row_lies(antecedent, rng, distance):
    Z = distance * rng.normal(size=(3, 200))
    strengths = antecedent.strengths(Z)
    assert (strengths >= 0.0).all()
    assert_allclose(strengths.sum(axis=0), 1.0, rtol=1e-13)


SMALL = premises.grid([Gaussian, Bell], [3, 2])


@pytest.mark.parametrize(
    ("antecedent", "removed", "counts", "terms"),
    [
        (ANTECEDENTS["families that alternate"], [0, 3], None, None),
        (ANTECEDENTS["scattered bells"], [0, 3], None, None),
        (ANTECEDENTS["rules listed one by one"], [0, 3], None, None),
        (oracles.random_tree(np.random.default_rng(1)), [0, 3], None, None),
        # The middle term of the first input: what is left is a grid.
        (SMALL, [2, 3], (2, 2), [0, 2, 3, 4]),
        # An input that is left with one term has none.
        (SMALL, [1, 3, 5], (3,), [0, 1, 2]),
    ],
)
def test_the_rest_fires_as_before_in_proportion(antecedent, removed, counts, terms, Z):
    left, kept_terms = antecedent.without_rules(removed)
    kept = np.setdiff1d(np.arange(antecedent.n_rules), removed)
    before = antecedent.strengths(Z)[kept]
    assert_allclose(left.strengths(Z), before / before.sum(axis=0), rtol=1e-9)
    assert type(left) is (GridAntecedent if counts else RuleTableAntecedent)
    assert left.grid_counts == counts
    assert kept_terms.size == left.n_terms
    if counts:
        assert_array_equal(kept_terms, terms)
