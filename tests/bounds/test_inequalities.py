"""What holds the consequents back, by brute force: rows and groups left out and solved for anew."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis import ANFISRegressor
from skanfis.bounds import FixedPoint
from skanfis.training import fit as training
from skanfis.training.left_out import leave_group_out_error

from .. import oracles

pytestmark = pytest.mark.filterwarnings("ignore::skanfis.exceptions.ConstraintWarning")


@pytest.mark.parametrize("points", [[], [FixedPoint([0.3, 0.2], [0.5, 0.0])]])
def test_rows_left_out_under_what_is_held(points, rng, monkeypatch):
    """Of the smaller problem that is left at the constraints met, two outputs and repeated rows.

    Then groups, of fewer rows than there are coefficients and of more.
    """
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

    def squares(left):
        """Of the rows, by a fit to what is left of their weight."""
        found = np.empty((40, 2))
        for k, held in enumerate(solved.rows):
            matrix = (local.T * left) @ local / total + normal.penalty
            corner = np.zeros((len(held), len(held)))
            right = [local.T @ (left * targets[:, k]) / total, held @ solved.local[:, k]]
            # Karush, Kuhn and Tucker; of rows that say the same, the least multipliers.
            whole = np.block([[matrix, held.T], [held, corner]])
            u = np.linalg.lstsq(whole, np.concatenate(right), rcond=None)[0][: len(matrix)]
            found[:, k] = (targets[:, k] - local @ u) ** 2
        return found.sum(axis=1)

    every, held = np.arange(40), solved.held(normal.factor)
    expected = sum(weight[i] * squares(weight - (every == i))[i] for i in every) / total
    found = problem.leave_one_out_error(ended, total, held)
    assert_allclose(found, expected, rtol=1e-7)
    groups = rng.permutation(np.repeat([3, 1, 7, 2], [21, 12, 6, 1]))
    expected = sum(
        (weight * squares(weight * (groups != own)))[groups == own].sum() for own in set(groups)
    )
    monkeypatch.setattr(problem, "rows", replace(rows, groups=groups))
    monkeypatch.setattr("skanfis.training.left_out.fitting_rows", lambda _: 8)
    grouped = leave_group_out_error(problem, ended, held)
    assert_allclose(grouped, expected / total, rtol=1e-7)
    free = problem.leave_one_out_error(ended, total)
    assert abs(found - free) > 0.01 * free
