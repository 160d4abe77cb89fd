"""What holds the consequents back, by brute force: every row left out and solved for anew."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis import ANFISRegressor
from skanfis.constraints import FixedPoint
from skanfis.training import fit as training

from .. import oracles

pytestmark = pytest.mark.filterwarnings("ignore::skanfis.exceptions.ConstraintWarning")


@pytest.mark.parametrize("points", [[], [FixedPoint([0.3, 0.2], [0.5, 0.0])]])
def test_rows_left_out_under_what_is_held(points, rng, monkeypatch):
    """Of the smaller problem that is left at the constraints met, two outputs and repeated rows."""
    X, weight = rng.uniform(-1.0, 1.0, (40, 2)), rng.integers(1, 4, 40)
    y = np.column_stack([np.tanh(3.0 * X[:, 0]), X[:, 1] ** 2]) + 0.3 * rng.normal(size=(40, 2))
    seen = []

    def spied(model, evaluation, problem, *args):
        ended, report, solved = constrained(model, evaluation, problem, *args)
        seen.append((problem, ended, solved))
        return ended, report, solved

    constrained = training.constrained
    monkeypatch.setattr(training, "constrained", spied)
    known = {"monotonic_cst": [[1, 0], [-1, 1]], "constraints": points}
    fixed = {"n_mfs": [3, 2], "solver": "lse", "agreement": 0.01, "alpha": 1e-2}
    ANFISRegressor(**fixed, **known).fit(X, y, sample_weight=weight)
    [(problem, ended, solved)] = seen
    normal, rows, total = ended.normal, problem.rows, weight.sum()
    theta = ended.antecedent.parameters
    Z, targets, _ = rows.read(slice(None))
    design = oracles.dense_design(problem.antecedent, theta, Z, 1)
    local, targets = problem.local.transform_rows(design.T.copy()).T, targets.T
    assert min(map(len, solved.rows)) > len(points)
    expected = 0.0
    for k, held in enumerate(solved.rows):
        for i in range(40):
            left = weight - (np.arange(40) == i)
            matrix = (local.T * left) @ local / total + normal.penalty
            corner = np.zeros((len(held), len(held)))
            right = [local.T @ (left * targets[:, k]) / total, held @ solved.local[:, k]]
            # Karush, Kuhn and Tucker; of rows that say the same, the least multipliers.
            whole = np.block([[matrix, held.T], [held, corner]])
            u = np.linalg.lstsq(whole, np.concatenate(right), rcond=None)[0][: len(matrix)]
            expected += weight[i] / total * (targets[i, k] - local[i] @ u) ** 2
    found = problem.leave_one_out_error(ended, total, solved.held(normal.factor))
    assert_allclose(found, expected, rtol=1e-7)
    free = problem.leave_one_out_error(ended, total)
    assert abs(found - free) > 0.01 * free
