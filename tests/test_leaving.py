"""Rows out of the range by the faces that they lie on: against a search of every row by itself."""

import numpy as np
import pytest

from skanfis.antecedent import GridAntecedent
from skanfis.leaving import on_faces, sorted_by_face
from skanfis.membership import Gaussian


@pytest.mark.parametrize("with_terms", [[0, 2], [1]])
def test_every_row_is_on_its_own_face_and_sorting_brings_faces_together(with_terms):
    rng, n_inputs = np.random.default_rng(0), 4
    thetas = [Gaussian.start(np.array([-1.0, 1.0]), np.full(2, 2.0), 0.5) for _ in with_terms]
    antecedent = GridAntecedent.build([Gaussian] * len(with_terms), with_terms, thetas)
    low, high = np.full(n_inputs, -1.0), np.full(n_inputs, 1.0)
    X = np.where(rng.random((12000, n_inputs)) < 0.5, 0.0, rng.choice([-2.0, 2.0], (12000, 4)))
    X = X[X.any(axis=1)]
    order = sorted_by_face(X, antecedent, low, high)
    assert (np.sort(order) == np.arange(len(X))).all()
    sides = np.sign(X[order][:, with_terms])
    changes = np.count_nonzero((np.diff(sides, axis=0) != 0).any(axis=1))
    assert changes == len(np.unique(sides, axis=0)) - 1
    way = (X - np.clip(X, low, high)).T
    found = np.zeros(len(X), dtype=int)
    for away, rows, others in on_faces(way, antecedent, 10):
        found[rows] += 1
        for row in X[rows]:
            own = tuple((j, int(np.sign(row[j]))) for j in with_terms if row[j])
            assert (away or ()) == own
            if away:
                assert others == np.delete(row, with_terms).any()
    assert (found == 1).all()
