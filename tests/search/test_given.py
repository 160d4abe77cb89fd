"""Rules that are given: what finds their weights, and when they are freed."""

import numpy as np

from skanfis import ANFISRegressor
from skanfis.datasets import make_jang_three_input
from skanfis.learning.data import StandardisedData
from skanfis.learning.penalty import Penalty
from skanfis.learning.premise import Premise
from skanfis.membership import Gaussian
from skanfis.search import Spacing, given, grid_antecedent, tuning
from skanfis.search.readable_terms import has_idle_term


def test_nothing_is_computed_where_no_weight_is_to_be_found(monkeypatch, two_rules):
    # Premises that stay where they are have no stiffness.
    monkeypatch.setattr(given, "search_sample", None)
    antecedent, rows = two_rules[0].antecedent, two_rules[0].rows
    weights = {"agreement": 0.1, "alpha": 0.01, "slope": 0.02}
    start = given.tuned_start(antecedent, rows, 1, np.arange(1), weights, premises_move=False)
    assert start.antecedent is antecedent
    assert start.penalty == Penalty(**weights, stiffness=0.0)


def test_a_kink_that_was_taken_for_noise_is_found_with_the_premises_first(monkeypatch, rng):
    x = rng.uniform(-1.0, 1.0, (150, 1))
    rows = StandardisedData.of(x, np.abs(x) + 1e-3 * rng.normal(size=(150, 1)))
    antecedent = grid_antecedent([Gaussian], [3], Spacing(rows), 0.6)

    def found():
        return given.tuned_start(antecedent, rows, 1, np.arange(1), {}, premises_move=True)

    start = found()
    # Now there is nothing but the way in that finds the weights first.
    monkeypatch.setattr(given, "ROWS_EACH", np.inf)
    assert start.expected_error < 0.3 * found().expected_error


def test_where_data_are_exact_nothing_holds_the_rules_together(rng):
    x = rng.uniform(-1.0, 1.0, (120, 1))
    rows = StandardisedData.of(x, np.sin(6.0 * x))
    antecedent = grid_antecedent([Gaussian], [4], Spacing(rows), 0.6)
    start = given.tuned_start(antecedent, rows, 1, np.arange(1), {}, premises_move=True)
    # The least that rules would pay which are to be read: n_columns sigma^2 / n over two squared.
    assert start.penalty.agreement < 0.1 * 8 * start.expected_error / 120 / 2.0**2


def test_terms_are_freed_for_a_step_and_can_be_read(rng):
    x = rng.uniform(-1.0, 1.0, (300, 1))
    rows = StandardisedData.of(x, (x > 0.2) + 0.01 * rng.normal(size=x.shape))
    antecedent = grid_antecedent([Gaussian], [2], Spacing(rows), 0.6)
    start = given.tuned_start(antecedent, rows, 1, np.arange(1), {}, premises_move=True)
    assert start.is_free
    assert not start.is_apart
    premise = Premise.of(antecedent, *rows.inputs.box, is_free=True)
    low, high = antecedent.with_parameters(premise.parameters(start.displacement)).groups[0].theta.T
    # They cross where the step is, and the one gives way to the other within a twentieth.
    z = rows.inputs.apply(np.array([[0.15, 0.25]]), np.empty((1, 2)))[0]
    difference = [-0.5 * ((z - c) / np.exp(w)) ** 2 for c, w in (low, high)]
    assert (np.sign(difference[0] - difference[1]) == [1.0, -1.0]).all()
    # No more than what two rows next to the step come to, which may be taken for the other side's.
    assert start.expected_error < 2.0 / 300 / np.var(x > 0.2)


def test_rules_that_compensate_are_worth_a_fifth_of_the_error(monkeypatch, rng):
    """A product, of which the rules of a grid are hyperbolic: none holds without the others."""
    X = rng.uniform(-1.0, 1.0, (300, 2))
    rows = StandardisedData.of(X, X.prod(axis=1, keepdims=True) + 1e-4 * rng.normal(size=(300, 1)))
    antecedent = grid_antecedent(2 * [Gaussian], [2, 2], Spacing(rows), 0.6)

    def found():
        return given.tuned_start(antecedent, rows, 1, np.arange(2), {}, premises_move=True)

    start = found()
    # Without the way in that nothing holds together.
    monkeypatch.setattr(given, "ROWS_EACH", np.inf)
    held = found()
    assert start.is_apart
    assert start.expected_error < held.expected_error / tuning.HOLDING


def test_terms_that_are_freed_beyond_all_reading_stay_where_that_is_worth_it(monkeypatch):
    # A twentieth of the noise in a term that no row has to itself; training leaves it there.
    X, y = make_jang_three_input()
    check = make_jang_three_input("check")
    errors, idle = [], []
    for least in (0.0, given._LEAST_NOISE):
        monkeypatch.setattr(given, "_LEAST_NOISE", least)
        model = ANFISRegressor(n_mfs=2, mf="bell").fit(X, y)
        errors.append(np.mean(np.abs(model.predict(check[0]) / check[1] - 1.0)))
        rows = StandardisedData.of(X, y[:, None])
        offset, scale = -rows.inputs.offset / rows.inputs.scale, 1.0 / rows.inputs.scale
        antecedent = model.model_.antecedent.change_units(offset, scale)
        idle.append(bool(has_idle_term(rows, antecedent)))
    # Jang's own rule comes to 1.066 % (1993).
    assert errors[1] < 0.005 < 0.01 < errors[0]
    assert idle == [False, True]
