"""Corners, kinks and what becomes of rows that lie on no term."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.antecedent import GridAntecedent
from skanfis.membership.flanked import PiShaped, Trapezoidal, Triangular

WITH_FOOT = pytest.mark.parametrize("family", [Triangular, Trapezoidal, PiShaped])


def strengths_on_a_line(family, theta, x):
    """Normalised strengths of terms on one input."""
    antecedent = GridAntecedent.build([family], [0], [theta])
    return antecedent.strengths(np.array([x]))


@WITH_FOOT
def test_where_no_term_reaches_the_nearest_speaks(family):
    # Terms at 0, 10 and 30 that reach no further than 1.
    theta = family.start(np.array([0.0, 10.0, 30.0]), np.ones(3), 0.6)
    x = np.array([-1e9, -50.0, 4.0, 6.0, 18.0, 22.0, 80.0, 1e9])
    assert not family.value(x[None], theta).any()
    with np.errstate(all="raise", under="ignore"):
        strengths = strengths_on_a_line(family, theta, x)
    assert_allclose(strengths.sum(axis=0), 1.0, rtol=1e-14)
    assert_array_equal(strengths.argmax(axis=0), [0, 0, 0, 1, 1, 2, 2, 2])
    # Half-way the two neighbours share, and strengths pass from one to the other smoothly.
    between = strengths_on_a_line(family, theta, np.linspace(4.0, 6.0, 401))
    assert_allclose(between[:2, 200], 0.5, rtol=1e-10)
    assert (np.abs(np.diff(between, axis=1)) < 0.05).all()
