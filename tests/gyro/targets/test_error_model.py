"""Errors of every kind of compensator, and ranges that hold of all that is met in a box."""

import numpy as np
import pytest

from skanfis.gyro.targets.error_model import polynomial_ranges

from .models import ENDS, error_of

KINDS = ["rules", "polynomial", "constant", "law and line"]


@pytest.mark.parametrize("kind", KINDS)
def test_values_and_slopes_in_a_box_are_in_their_ranges(kind):
    error, rng = error_of(kind), np.random.default_rng(2)
    widths = np.diff(ENDS).ravel()
    for part in (0.3, 0.02, 1e-4):
        low = rng.uniform(ENDS[:, 0], ENDS[:, 1] - part * widths, (40, 2))
        high = low + part * widths
        value, slopes = error.ranges(low.T, high.T)
        inside = low + (high - low) * rng.uniform(size=(50, 40, 2))
        met = error(inside.reshape(-1, 2)).reshape(50, 40)
        assert (met >= value[0]).all()
        assert (met <= value[1]).all()
        for axis in (0, 1):
            step = np.zeros(2)
            step[axis] = 1e-4 * widths[axis]
            by_difference = (error((inside + step).reshape(-1, 2)) - met.ravel()) / step[axis]
            by_difference = by_difference.reshape(50, 40)
            # Of points that a step does not take out of the box.
            stays = (inside + step <= high).all(axis=-1)
            slack = 1e-9 * np.abs(by_difference).max()
            assert (by_difference >= slopes[0, axis] - slack)[stays].all()
            assert (by_difference <= slopes[1, axis] + slack)[stays].all()
    # Of a small box the slopes are next to known.
    assert (slopes[1] - slopes[0]).max() <= 0.01 * np.abs(slopes).max()


def test_nothing_is_known_beyond_the_largest_phase():
    error = error_of("law and line")
    law = error._estimator.base_
    output = 1.5 * law.amplitude_[0]
    value, _ = error.ranges(np.array([[20.0], [output]]), np.array([[21.0], [output + 1.0]]))
    assert np.isnan(value).all()


def test_polynomials_by_numpy():
    powers, coefficients = np.array([[0, 0], [1, 2], [3, 0]]), np.array([0.5, -2.0, 1.5])
    point = np.array([[0.3, -1.2], [0.7, 0.4]])
    value, slopes = polynomial_ranges(powers, coefficients, point, point)
    x, y = point
    for side in (0, 1):
        np.testing.assert_allclose(value[side], 0.5 - 2.0 * x * y**2 + 1.5 * x**3)
        np.testing.assert_allclose(slopes[side], [-2.0 * y**2 + 4.5 * x**2, -4.0 * x * y])
