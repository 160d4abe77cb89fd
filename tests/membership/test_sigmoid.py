"""Sums and products of sigmoids: how the two families are related, and their extremes."""

import numpy as np
import pytest

from skanfis.membership import SigmoidDifference, SigmoidProduct

X = np.linspace(-8.0, 8.0, 33)[None]


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
