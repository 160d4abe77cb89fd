"""Structures grown under constraints: what is tried, what is taken, what is told of it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from skanfis import ANFISRegressor
from skanfis._validation import warn_user
from skanfis.antecedent import GridAntecedent, ScatteredAntecedent
from skanfis.bounds import gradient_bounds, monotonicity
from skanfis.bounds.wishes import Wishes
from skanfis.exceptions import InfeasibleConstraintsError
from skanfis.membership import Gaussian
from skanfis.search import Start
from skanfis.training.knowing import grown
from skanfis.training.result import Fitted

N_ROWS = 100


def rules(counts):
    """A grid, or, of a number, so many scattered rules."""
    if isinstance(counts, int):
        return ScatteredAntecedent.build(Gaussian, np.arange(2), np.zeros((2, counts, 2)))
    used = [j for j, count in enumerate(counts) if count > 1]
    thetas = [np.zeros((2, counts[j])) for j in used]
    return GridAntecedent.build([Gaussian] * len(used), used, thetas)


def grow(errors, found, n_units=N_ROWS, candidates=(), varies=1.0):
    """The terms that are chosen where fits of so many have these errors, and all that were tried.

    Logarithms of the expected error, times the number of rows.
    """
    tried = []

    def fit(counts=None, is_noisy=True):
        assert is_noisy
        counts = found if counts is None else tuple(counts)
        tried.append(counts)
        if counts not in errors:
            raise InfeasibleConstraintsError("cannot keep it")
        warn_user(f"{counts} told", UserWarning)
        known = {"loss_before": 0.9, "loss_after": np.exp(errors[counts] / N_ROWS)}
        start = Start(rules(counts), None, candidates=list(candidates))
        box = {"minimum": np.zeros(2), "maximum": np.array([1.0, varies])}
        shape = {"coefficients": np.zeros((len(start.antecedent.rule_terms), 3, 1))}
        model = SimpleNamespace(antecedent=rules(counts), n_inputs=2, **box, **shape)
        fitted = Fitted(model, None, start, [], constraints=known, n_units=n_units)

        def proven():
            warn_user(f"{counts} proven", UserWarning)
            return fitted

        # Rows left out tell more than the rows of training do: of the same order here.
        return replace(fitted, proven=proven, expected_error=lambda: 1.1 * known["loss_after"])

    wishes = Wishes(np.array([[1, 0]]), *np.full((2, 1), np.nan), np.empty((0, 2)), None)
    with pytest.warns(UserWarning, match="told|proven") as told:
        best = grown(wishes, np.arange(2), fit)
    assert best.start.candidates == list(candidates)
    chosen = best.model.antecedent
    text, proof = (str(one.message) for one in told)
    assert proof == text.replace("told", "proven")
    return text.removesuffix(" told"), chosen, tried


def test_a_grid_grows_while_a_term_gains_two():
    errors = {(2, 1): 0.0, (3, 1): -3.0, (2, 2): -1.0, (4, 1): -5.5, (5, 1): -7.4}
    chosen, _, tried = grow(errors, (2, 1))
    # (3, 2) and (4, 2) cannot keep it; of (5, 1) the gain is too small.
    assert chosen == "(4, 1)"
    assert tried == [(2, 1), (3, 1), (2, 2), (4, 1), (3, 2), (5, 1), (4, 2)]
    # Groups are what there is of observations: ten of them tell a tenth.
    assert grow(errors, (2, 1), n_units=10)[0] == "(2, 1)"


def test_scattered_rules_beside_their_best_grid_and_no_terms_where_nothing_varies():
    errors = {4: 0.0, (3, 1): -5.0, (4, 1): -6.0, (3, 2): -9.0}
    grids = [{"n_mfs": None}, {"n_mfs": [3, 1]}, {"n_mfs": [1, 1]}]
    chosen, _, tried = grow(errors, 4, candidates=grids, varies=0.0)
    assert chosen == "(3, 1)"
    assert tried == [4, (3, 1), (4, 1)]


def test_what_costs_nothing_is_left_alone():
    assert grow({(2, 2): N_ROWS * np.log(0.9) + 1.9}, (2, 2))[2] == [(2, 2)]


def flat_rising_flat(x, width):
    """Three rules that rise together: low, a line of slope one, high."""
    shares = np.exp(-0.5 * ((x[:, None] - [-0.75, 0.0, 0.75]) / width) ** 2)
    shares /= shares.sum(axis=1, keepdims=True)
    return np.sum(shares * np.column_stack([-np.ones(x.size), x, np.ones(x.size)]), axis=1)


@pytest.mark.theory
@pytest.mark.filterwarnings("ignore::skanfis.exceptions.ConstraintWarning")
@pytest.mark.parametrize(
    ("seed", "width", "noise", "n_rules"), [(3, 0.3, 0.4, 3), (1, 0.15, 0.2, 6)]
)
def test_rules_that_a_rising_truth_needs_are_found_and_proven_to_rise(seed, width, noise, n_rules):
    """Too few free rules compensate one another by slopes that fall: what is known adds rules.

    Of gentle steps three, as planted; of steep ones, to which no three terms reach down, more.
    """
    rng = np.random.default_rng(seed)
    X = rng.uniform(-1.0, 1.0, (100, 1))
    X[:2, 0] = -1.0, 1.0
    truth = flat_rising_flat(X[:, 0], width)
    y = truth + noise * truth.std() * rng.normal(size=100)
    new = np.linspace(-1.0, 1.0, 401)[:, None]
    exact = flat_rising_flat(new[:, 0], width)
    free = ANFISRegressor(partition="grid").fit(X, y)
    held = ANFISRegressor(partition="grid", monotonic_cst=[1]).fit(X, y)
    few = ANFISRegressor(n_mfs=free.n_rules_, monotonic_cst=[1]).fit(X, y)
    assert gradient_bounds(free, 0).lowest[0] < 0.0
    assert free.n_rules_ < held.n_rules_
    assert held.n_rules_ == n_rules
    assert held.constraints_["certified"]
    assert monotonicity(held, 0)[0] == 1
    assert held.structures_ == free.structures_
    errors = [np.mean((model.predict(new) - exact) ** 2) for model in (held, few)]
    assert errors[0] < 0.75 * errors[1]


@pytest.mark.filterwarnings("ignore::skanfis.exceptions.ConstraintWarning")
@pytest.mark.parametrize("settings", [{}, {"n_mfs": [4]}])
def test_a_weight_is_so_many_rows(settings):
    """In what growing costs, and in the rows at which a constraint is asked about."""
    rng = np.random.default_rng(3)
    X = np.sort(rng.uniform(-1.0, 1.0, (25, 1)), axis=0)
    y = np.floor(2.2 * X[:, 0]) + 0.1 * rng.standard_normal(25)
    known = settings | {"monotonic_cst": [1]}
    weighted = ANFISRegressor(**known).fit(X, y, sample_weight=np.full(25, 8.0))
    repeated = ANFISRegressor(**known).fit(np.repeat(X, 8, axis=0), np.repeat(y, 8))
    assert weighted.n_rules_ == repeated.n_rules_
    np.testing.assert_allclose(weighted.predict(X), repeated.predict(X), rtol=0, atol=1e-7)


def test_what_fails_for_another_reason_is_not_passed_over():
    """Nor are the filters of warnings, which all threads share, touched meanwhile."""

    def fit(counts=None, is_noisy=True):
        if counts is not None:
            raise ValueError("of another kind")
        known = {"loss_before": 0.5, "loss_after": 1.0}
        start = Start(rules((2, 1)), None)
        box = {"minimum": np.zeros(2), "maximum": np.ones(2), "coefficients": np.zeros((2, 3, 1))}
        model = SimpleNamespace(antecedent=rules((2, 1)), n_inputs=2, **box)
        return Fitted(
            model, None, start, [], constraints=known, n_units=9, expected_error=lambda: 1.0
        )

    wishes = Wishes(np.array([[1, 0]]), *np.full((2, 1), np.nan), np.empty((0, 2)), None)
    with pytest.raises(ValueError, match="of another kind"):
        grown(wishes, np.arange(2), fit)
