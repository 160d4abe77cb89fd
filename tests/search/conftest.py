"""What the tests of more than one module begin with."""

import numpy as np
import pytest

from skanfis.learning.data import StandardisedData
from skanfis.learning.objective import SeparableProblem
from skanfis.learning.premise import Premise
from skanfis.membership import Gaussian
from skanfis.search import Spacing, grid_antecedent, tuning


@pytest.fixture
def two_rules(rng):
    """A problem of 100 rows, and its premise."""
    x = rng.uniform(-1.0, 1.0, (100, 1))
    rows = StandardisedData.of(x, np.sin(3.0 * x) + 0.1 * rng.normal(size=(100, 1)))
    antecedent = grid_antecedent([Gaussian], [2], Spacing(rows))
    problem = SeparableProblem(rows, antecedent, 1, tuning.FIRST_PENALTY)
    return problem, Premise.of(antecedent, *rows.inputs.box)
