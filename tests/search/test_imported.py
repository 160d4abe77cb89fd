"""Rules of a model as a start: the same strengths, in a form whose terms can be moved."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis.antecedent import GridAntecedent, RuleTableAntecedent
from skanfis.membership import Gaussian
from skanfis.search import imported_antecedent

from .. import oracles


@pytest.mark.parametrize(
    ("centers", "kind"),
    [([1.0, 3.0, 6.0], GridAntecedent), ([1.0, 6.0, 3.0], RuleTableAntecedent)],
)
@pytest.mark.parametrize("widths", [[3.0, 2.0, 1.0], [1.0, 2.0, 3.0]])
def test_terms_move_by_their_distances_where_they_are_in_order(centers, kind, widths, rng):
    rows = oracles.bumpy_rows(rng, 100)
    theta = np.array([centers, np.log(widths)])
    own = GridAntecedent.build([Gaussian] * 2, [0, 1], [theta, theta])
    found = imported_antecedent(SimpleNamespace(antecedent=own), rows)
    assert type(found) is kind
    Z, _, _ = rows.read(slice(None))
    expected = oracles.strengths(own, own.parameters, rows.X.T)
    assert_allclose(found.strengths(Z), expected, rtol=1e-8, atol=1e-12)
