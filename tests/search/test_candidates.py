"""Which input the residual of a model asks terms for."""

from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis.antecedent import GridAntecedent
from skanfis.learning.data import StandardisedData
from skanfis.learning.evidence import FREE
from skanfis.learning.objective import SeparableProblem
from skanfis.learning.premise import Premise
from skanfis.membership import Gaussian
from skanfis.search import tuning
from skanfis.search.candidates import Candidate, TermScores, rule_base
from skanfis.search.grid import Spacing
from skanfis.search.sample import search_sample

pytestmark = pytest.mark.theory


def sample_of(X, y, weight=None):
    return search_sample(StandardisedData.of(X, y.reshape(len(X), -1), weight), 20_000)


def tuned_on(rows, antecedent, penalty=tuning.FIRST_PENALTY, free=FREE, turns=tuning.MOST_TURNS):
    """Rules with their weights, after so many turns."""
    problem = SeparableProblem(rows, antecedent, penalty)
    premise = Premise.of(antecedent, *rows.inputs.box)
    return tuning.tune(problem, premise, free, turns)


def solved(rows, antecedent):
    """Rules with their consequents, before their premises move."""
    return tuned_on(rows, antecedent, free=["slope"], turns=0)


@pytest.mark.parametrize("told", [[], [(0, 2)], [(0, 3), (2, 2)]])
@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("n_outputs", [1, 2])
def test_scores_of_terms_are_the_formula_term_by_term(rng, count, n_outputs, told):
    """Beside what is told: of the residuals of all functions on those that tell it."""
    X = rng.uniform(-1.0, 1.0, (150, 4))
    y = np.sin(3.0 * X[:, [0]]) + X[:, [2]] * X[:, [3]] + 0.3 * rng.normal(size=(150, n_outputs))
    # Weights that go with the inputs: the mean of a share is far from its plain mean.
    rows = sample_of(X, y, np.ceil(np.exp(X.sum(axis=1))))
    tuned, spacing = solved(rows, GridAntecedent((), counts=())), Spacing(rows)
    s, basis = rows.sample_weight, np.column_stack([np.ones(len(rows.X)), rows.X])
    residual = rows.y - basis @ tuned.evaluation.coefficients

    def functions(j, count):
        centers = spacing.centers(j, count)
        # Of neighbours that cross at 0.6 where they are equally far apart.
        width = 0.5 * np.mean(np.diff(centers)) / np.sqrt(-2.0 * np.log(0.6))
        mu = np.exp(-0.5 * ((rows.X[:, [j]] - centers) / width) ** 2)
        share = mu / mu.sum(axis=1, keepdims=True)
        share -= np.average(share, axis=0, weights=s)
        return [share[:, k] * basis[:, b] for k in range(count) for b in range(5)]

    known = [function for one in told for function in functions(*one)]
    known = np.transpose(known or [[0.0] * 150])
    root = np.sqrt(s)

    def left(function):
        return function - known @ np.linalg.lstsq(root[:, None] * known, root * function)[0]

    n_told = sum(5 * (count - 1) for _, count in told)
    asking = [j for j in range(4) if j not in dict(told)]
    expected = []
    for j in asking:
        total = 0.0
        for function, o in product(functions(j, count), range(n_outputs)):
            r = left(residual[:, o] - np.average(residual[:, o], weights=s))
            variance = np.average(r**2, weights=s) * 150 / (150 - n_told)
            total += (s @ (function * r)) ** 2 / (s @ left(function) ** 2) / variance
        n_free = (count - 1) * 5 * n_outputs
        expected.append((total * (count - 1) / count - n_free) / np.sqrt(2 * n_free))
    pairs = [(j, count) for j in asking]
    scores = TermScores(tuned, spacing, np.arange(4))
    for one in told:
        scores.project_out(*one)
    assert_allclose(scores.of(pairs), expected, rtol=1e-5)


def test_clusters_of_the_first_scattered_rules_are_by_weight():
    """Of three spots, two weigh much: the light one joins its neighbour, far as it is."""
    X, weight = np.array([[0.0], [1.0], [3.0]]), np.array([100.0, 100.0, 1.0])
    rows = sample_of(X, X, weight)
    one_rule = solved(rows, GridAntecedent((), counts=()))
    candidate = Candidate((1,), n_clusters=2, inputs=(0,))
    found = rule_base(candidate, rows, [Gaussian], Spacing(rows), 0, one_rule)
    mean = np.average(X[:, 0], weights=weight)
    deviation = np.sqrt(np.average((X[:, 0] - mean) ** 2, weights=weight))
    centers = np.sort(found.term_places) * deviation + mean
    assert_allclose(centers, [0.0, 103.0 / 101.0], atol=1e-9)
