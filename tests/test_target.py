"""What outputs are held by, against its definition on rows, in any units."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis.target import TargetRange


@pytest.mark.parametrize("is_line", [False, True])
@pytest.mark.parametrize("max_extrapolation", [0.0, 0.5, 0.7, 2.0, np.inf])
@pytest.mark.parametrize(("offset", "scale"), [(0.0, 1.0), (10.0, 2.0), (-1e3, 1e-6)])
def test_limits_are_the_range_and_a_margin_in_deviations(max_extrapolation, is_line, offset, scale):
    y = np.random.default_rng(0).standard_normal((50, 2)) * [1.0, 5.0]
    own = TargetRange(y.min(axis=0), y.max(axis=0), y.std(axis=0))
    moved = offset + scale * y
    # As far as inputs are followed, but half a deviation at the least, and where there is an end
    # to it and rules that bend, a quarter of the range at most.
    margin = max(max_extrapolation, 0.5) * moved.std(axis=0)
    if not is_line and max_extrapolation < np.inf:
        margin = np.minimum(margin, 0.25 * np.ptp(moved, axis=0))
    found = own.change_units(offset, np.full(2, scale)).limits(max_extrapolation, is_line)
    assert_allclose(found, [moved.min(axis=0) - margin, moved.max(axis=0) + margin], rtol=1e-9)


def test_target_that_is_constant_is_left_half_of_its_unit():
    own = TargetRange(np.array([3.0]), np.array([3.0]), np.array([1.0]))
    assert_allclose(own.limits(2.0, is_line=False), [[2.5], [3.5]], rtol=1e-12)
