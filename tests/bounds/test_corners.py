"""Slopes bounded by the corners of a box: against slopes in it, and how the excess falls."""

import numpy as np
import pytest

from skanfis.bounds.corners import slope_by_corners
from skanfis.bounds.enclosure import Enclosure

from ..export.every_model import CASES

GRIDS = [case for case in CASES if "grid" in case.partition and case.model.order == 1]
SMOOTH = ("gaussian", "two_sided_gaussian", "sigmoid_difference", "sigmoid_product")
N_BOXES = 60


def some_boxes(rng, model, part=None):
    """In the range, of all sizes or of one."""
    width = model.maximum - model.minimum
    size = 10.0 ** rng.uniform(-3.0, 0.0, (N_BOXES, 1)) if part is None else part
    size = np.broadcast_to(size * width, (N_BOXES, width.size))
    low = model.minimum + rng.uniform(size=size.shape) * (width - size)
    return low.T, (low + size).T


def by_corners(model, sign, low, high, j):
    enclosure = Enclosure(model, 0, sign)
    with np.errstate(all="ignore"):
        return slope_by_corners(enclosure, enclosure._parts(low, high), low, high, j)


@pytest.mark.theory
@pytest.mark.parametrize("case", GRIDS, ids=lambda case: case.label)
def test_no_slope_in_a_box_is_beyond(case, rng):
    model = case.model.with_out_of_bounds("clip")
    low, high = some_boxes(rng, model)
    for j in range(3):
        above = by_corners(model, 1.0, low, high, j)
        below = by_corners(model, -1.0, low, high, j)
        if case.family == "gaussian":
            assert np.isfinite(above[0]).all()
        if case.family in SMOOTH:
            assert np.isfinite(above[0]).mean() > 0.2
        at = model.gradient(above[1].T)[:, j, 0]
        assert (above[2] <= at).all()
        assert (at <= above[0]).all()
        for _ in range(12):
            x = np.clip(low + rng.uniform(size=low.shape) * (high - low), low, high)
            slope = model.gradient(x.T)[:, j, 0]
            assert (slope <= above[0]).all()
            assert (-below[0] <= slope).all()


def test_excess_falls_with_the_square(rng):
    """Along one input alone the excess is w^2 / 8 times the second derivative, to first order."""
    model = next(case.model for case in GRIDS if case.family == "gaussian")
    model = model.with_out_of_bounds("clip")
    for i in range(3):
        low, high = some_boxes(rng, model, 1e-4)
        middle = 0.5 * (low + high)
        low, high = (np.where(np.arange(3)[:, None] == i, end, middle) for end in (low, high))
        bound, _, attained, gain = by_corners(model, 1.0, low, high, 0)
        slopes = [model.gradient(x.T)[:, 0, 0] for x in (low, middle, high)]
        chord = np.maximum(slopes[1] - 0.5 * (slopes[0] + slopes[2]), 0.0)
        steep = chord > 0.1 * chord.max()
        assert steep.any()
        assert (gain[i] >= chord * (1.0 - 1e-3)).all()
        assert (gain[i] <= 1.1 * chord)[steep].all()
        assert (bound - attained <= gain[i] + 1e-6 * np.abs(attained).max()).all()
