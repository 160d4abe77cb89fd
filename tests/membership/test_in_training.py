"""Every family inside the training problem and the estimator."""

import numpy as np
import pytest

from skanfis.membership import MEMBERSHIPS

from ..quick import quick

FAMILIES = pytest.mark.parametrize("family", MEMBERSHIPS.values(), ids=list(MEMBERSHIPS))


@pytest.mark.theory
@FAMILIES
def test_every_family_learns_a_smooth_surface(family, rng):
    def surface(X):
        return np.sin(2.5 * X[:, 0]) * np.exp(X[:, 1]) + 0.5 * X[:, 1] ** 2

    X, unseen = rng.uniform(-1.0, 1.0, (600, 2)), rng.uniform(-0.95, 0.95, (500, 2))
    y = surface(X) + 0.1 * rng.normal(size=600)
    model = quick(n_mfs=3, mf=family.name, agreement=1e-5).fit(X, y)
    error = np.sqrt(np.mean((model.predict(unseen) - surface(unseen)) ** 2))
    # A linear model: 0.5; the noise: 0.1; 27 coefficients from 600 rows cannot do better than 0.02.
    assert error < 0.05
    assert {term["function"] for term in model.memberships_} == {family.name}
