"""Where the terms of a grid start, and how they are spaced."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.learning.data import StandardisedData
from skanfis.membership import Gaussian
from skanfis.search.grid import _EDGE, OVERLAP, Spacing, grid_antecedent


def rows_of(*columns, weight=None):
    X = np.column_stack(columns)
    return StandardisedData.of(X, np.arange(len(X), dtype=float)[:, None], weight)


def test_even_values_give_even_terms_between_the_outer_quantiles(rng):
    """On two inputs, in orders of their own."""
    values = np.linspace(-1.0, 3.0, 1001)
    rows = rows_of(rng.permutation(values), rng.permutation(values))
    z = np.sort(rows.table(slice(None))[:, 0])
    low, high = (z[int(np.ceil(q * 1001)) - 1] for q in (_EDGE, 1.0 - _EDGE))
    antecedent = grid_antecedent([Gaussian] * 2, [3, 2], Spacing(rows))
    assert antecedent.counts == (3, 2)
    assert_array_equal(antecedent.term_inputs, [0, 0, 0, 1, 1])
    centers = [low, 0.5 * (low + high), high, low, high]
    assert_allclose(antecedent.term_places, centers, rtol=1e-9, atol=1e-9)
    # Neighbours cross half way.
    between = np.array([[0.75 * low + 0.25 * high], [0.5 * (low + high)]])
    mu = np.exp(antecedent.log_memberships(between))
    assert_allclose(mu[[0, 1, 3, 4], 0], OVERLAP, rtol=1e-8)


def places(rows, count, j=0):
    """Where terms stand, in the units of the rows."""
    found = Spacing(rows).centers(j, count)
    return found * rows.inputs.scale[j] + rows.inputs.offset[j]


class TestSpacing:
    def test_terms_stand_at_even_steps_of_the_gaps_to_the_power_of_two_thirds(self):
        # No outer quantile falls away from so few rows: G is 1, 8^(2/3), 27^(2/3) and so on.
        values = np.cumsum([0.0, 1.0, 8.0, 27.0, 1.0, 64.0])
        rows = rows_of(values)
        levels = np.cumsum([0.0, 1.0, 4.0, 9.0, 1.0, 16.0])
        expected = np.interp(np.linspace(0.0, 31.0, 4), levels, values)
        assert_allclose(places(rows, 4), expected, rtol=1e-9, atol=1e-8)

    def test_a_single_far_row_draws_no_term_to_it(self, rng):
        x = np.append(rng.uniform(size=500), 1000.0)
        assert places(rows_of(x), 3)[-1] < 1.0

    def test_values_are_counted_between_the_quantiles_and_an_input_of_two_keeps_both(self):
        rows = rows_of(np.arange(1000) % 5, np.arange(1000) < 3)
        spacing = Spacing(rows)
        assert [spacing.n_values(j) for j in range(2)] == [5, 2]
        assert_allclose(places(rows, 2, 1), [0.0, 1.0], atol=1e-9)

    @pytest.mark.parametrize("flip", [False, True])
    def test_of_an_input_of_two_a_value_of_a_single_row_is_kept(self, flip):
        x = np.arange(200) == 0
        assert_allclose(places(rows_of(x ^ flip), 2), [0.0, 1.0], atol=1e-9)

    def test_what_varies_on_no_row_of_a_sample_has_terms_at_the_ends_of_its_range(self):
        rows = rows_of(np.arange(200.0), np.arange(200) == 0)
        assert_allclose(places(rows.part(slice(1, None)), 2, 1), [0.0, 1.0], atol=1e-9)
