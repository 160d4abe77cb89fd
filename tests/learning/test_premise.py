"""Displacements: what they mean, what moves by itself, and the chain rule through them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.antecedent import RuleTableAntecedent, TermGroup
from skanfis.learning.premise import Premise
from skanfis.membership import Gaussian

from .. import oracles
from ..premises import ALL, FACTOR, HIGH, LOW, ON_ALONE, ORDERED, in_the_box, kind_of, terms


@ON_ALONE
def test_terms_that_share_a_place_move_by_themselves(antecedent, rng):
    premise, kinds = Premise.of(antecedent, LOW, HIGH), kind_of(antecedent)
    raw = antecedent.parameters
    unit = np.ones(raw.size)
    for own in terms(antecedent, np.arange(raw.size)).values():
        for _, _, t in own:
            location, width = int(t[0]), int(t[1])
            unit[location] = np.exp(raw[width])
    for displacement in in_the_box(premise, rng, 5):
        expected = raw + unit * displacement
        assert_allclose(premise.parameters(displacement), expected, rtol=1e-12, atol=1e-12)
    for edge, data, side in ((premise.lower, LOW, -1.0), (premise.upper, HIGH, 1.0)):
        assert_allclose(np.abs(edge[kinds != "location"]), FACTOR)
        for j, own in terms(antecedent, premise.parameters(edge)).items():
            # By one of its first width beyond the data.
            start = terms(antecedent, raw)[j]
            for (_, _, at_edge), (_, _, at_start) in zip(own, start, strict=True):
                assert_allclose(at_edge[0], data[j] + side * np.exp(at_start[1]), rtol=1e-12)


def test_term_beyond_the_data_may_stay_there():
    theta = Gaussian.from_center_and_width(np.array([9.0, 9.0]), np.ones(2))
    group = TermGroup(Gaussian, np.zeros(2, dtype=int), theta)
    premise = Premise.of(RuleTableAntecedent((group,), np.array([[0], [1]])), LOW, HIGH)
    assert_array_equal(premise.upper[:2], 0.0)
    assert_allclose(premise.parameters(premise.lower)[:2], LOW[0] - 1.0)


@ALL
def test_displacement_undoes_parameters_and_edges_come_back_to_the_last_bit(antecedent, rng):
    premise = Premise.of(antecedent, LOW, HIGH)
    assert (premise.lower < 0.0).all()
    assert (premise.upper >= 0.0).all()
    for displacement in in_the_box(premise, rng, 10):
        found = premise.displacement(premise.parameters(displacement))
        assert_allclose(found, displacement, rtol=1e-9, atol=1e-9)
    # One bit off, and what is held by its edge would count as free to move.
    is_gap = np.zeros(premise.size, dtype=bool)
    if antecedent in ORDERED.values():
        is_gap = kind_of(antecedent) == "location"
    for _ in range(20):
        inside = rng.uniform(0.5 * premise.lower, 0.5 * premise.upper)
        displacement = np.where(rng.random(premise.size) < 0.5, premise.upper, inside)
        displacement[is_gap] *= 0.5
        some = int(rng.integers(premise.size))
        displacement[some] = premise.lower[some]
        found = premise.displacement(premise.parameters(displacement))
        on_edge = (displacement == premise.lower) | (displacement == premise.upper)
        assert_array_equal(found[on_edge], displacement[on_edge])
        assert_allclose(found, displacement, rtol=1e-9, atol=1e-9)


@pytest.mark.theory
@ALL
def test_pull_back_is_the_chain_rule(antecedent, rng):
    premise = Premise.of(antecedent, LOW, HIGH)
    gradient = rng.normal(size=premise.size)
    root = rng.normal(size=(premise.size, premise.size))
    for displacement in in_the_box(premise, rng, 1):
        jacobian = oracles.central_difference(premise.parameters, displacement, 1e-4)
        slope, curvature = premise.pull_back(displacement, gradient, root.T @ root)
        assert_allclose(slope, jacobian.T @ gradient, rtol=1e-8, atol=1e-8)
        half = root @ jacobian
        assert_allclose(curvature, half.T @ half, rtol=1e-7, atol=1e-7)
