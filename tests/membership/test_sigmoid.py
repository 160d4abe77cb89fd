"""Sums and products of sigmoids: how the two families are related, and their extremes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis.membership import SigmoidDifference, SigmoidProduct

X = np.linspace(-8.0, 8.0, 33)[None]


@pytest.mark.parametrize("ratio", [0.01, 0.3, 1.0, 4.0, 100.0])
def test_with_equal_flanks_difference_and_product_differ_by_a_factor(ratio):
    flank = 0.7
    lengths = np.log([[ratio * flank], [flank], [flank]])
    product = SigmoidProduct.log_value(X, np.vstack([[[0.5]], lengths]))
    difference = SigmoidDifference.log_value(X, np.vstack([[[0.5]], lengths[:2]]))
    assert_allclose(difference - product, np.log(-np.expm1(-2.0 * ratio)), rtol=1e-10, atol=1e-14)


@pytest.mark.parametrize("family", [SigmoidDifference, SigmoidProduct])
@pytest.mark.parametrize("log_ratio", [-12.0, 6.0, 12.0])
def test_flanks_much_longer_or_shorter_than_the_width(family, log_ratio):
    theta = np.zeros((len(family.parameters), 1))
    theta[1] = log_ratio
    with np.errstate(all="raise", under="ignore"):
        log_mu, gradient = family.log_value_and_gradient(np.append(X, [[1e8]], axis=1), theta)
    assert np.isfinite(log_mu).all()
    assert np.isfinite(gradient).all()
    assert (log_mu <= 0.0).all()
