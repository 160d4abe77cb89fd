"""Ranges that hold of all that is met in a box, and differences that no point is beyond."""

import numpy as np
import pandas as pd
import pytest

from skanfis.gyro import GyroCompensator
from skanfis.gyro.targets.error_model import ErrorModel, Piecewise, difference
from skanfis.gyro.targets.tables import Table

from .models import ENDS, error_of, polynomial, rows

BEND = 3e-5  # deg/s/degC^2


def values_at(function, points):
    return function(points.reshape(-1, 2)).reshape(points.shape[:-1])


@pytest.mark.parametrize("kind", ["rules", "polynomial", "constant", "law and line"])
def test_values_and_slopes_in_a_box_are_in_their_ranges(kind):
    error, rng = error_of(kind), np.random.default_rng(2)
    widths = np.diff(ENDS).ravel()
    for part in (0.3, 0.02, 1e-4):
        low = rng.uniform(ENDS[:, 0], ENDS[:, 1] - part * widths, (40, 2))
        high = low + part * widths
        value, slopes = error.ranges(low.T, high.T)
        inside = low + (high - low) * rng.uniform(size=(50, 40, 2))
        met = values_at(error, inside)
        assert ((value[0] <= met) & (met <= value[1])).all()
        for axis, step in enumerate(1e-4 * np.diag(widths)):
            by_difference = (values_at(error, inside + step) - met) / step[axis]
            # Of points that a step does not take out of the box.
            stays = (inside + step <= high).all(axis=-1)
            slack = 1e-9 * np.abs(by_difference).max()
            assert (by_difference >= slopes[0, axis] - slack)[stays].all()
            assert (by_difference <= slopes[1, axis] + slack)[stays].all()
    # Of a small box the slopes are next to known, and of a point the value.
    assert (slopes[1] - slopes[0]).max() <= 0.01 * np.abs(slopes).max()
    value, _ = error.ranges(low.T, low.T)
    np.testing.assert_allclose(value, [error(low)] * 2, rtol=1e-7, atol=1e-9)


def test_nothing_is_known_beyond_the_largest_phase():
    error = error_of("law and line")
    law = error._estimator.base_
    output = 1.5 * law.amplitude_[0]
    value, _ = error.ranges(np.array([[20.0], [output]]), np.array([[21.0], [output + 1.0]]))
    assert np.isnan(value).all()


def line_through(function, edges, shift=0.0):
    """Straight lines between the values at the edges."""
    values = function(edges[:, None])
    coefficients = np.stack([values[:-1] + shift, np.diff(values)])
    width = edges[1] - edges[0]
    return Piecewise([edges], [edges[:-1]], [width], np.arange(2)[:, None], coefficients, 0.0)


@pytest.fixture(scope="module")
def parabola():
    x = pd.DataFrame({"temperature": np.linspace(-20.0, 60.0, 50)})
    model = polynomial(x, (BEND * x["temperature"] ** 2).to_numpy())
    return ErrorModel(GyroCompensator(model, ("temperature",)), model, x)


@pytest.mark.parametrize("n_cells", [1, 7, 16])
def test_lines_through_a_parabola_by_the_closed_form(parabola, n_cells):
    # Between h apart, the chord is above a x^2 by a h^2 / 4 at most, and never below.
    edges = np.linspace(-20.0, 60.0, n_cells + 1)
    largest = BEND * (80.0 / n_cells) ** 2 / 4.0
    low, high = difference(parabola, line_through(parabola, edges))
    assert -1.03 * largest <= low <= -largest
    assert 0.0 <= high <= 0.03 * largest
    low, high = difference(parabola, line_through(parabola, edges, shift=-2.0 * largest))
    assert high == pytest.approx(2.0 * largest, rel=0.03)
    assert low >= 0.9 * largest


@pytest.mark.theory
@pytest.mark.parametrize("kind", ["rules", "polynomial", "law and line"])
def test_no_point_is_beyond_and_some_is_near(kind):
    """Tables of other types, and over the temperature: test_tables.py."""
    error = error_of(kind)
    target = Table(error, "double", 8).piecewise
    low, high = difference(error, target)
    points = rows(100_000, seed=3)
    off = error(points) - target(points)
    assert low <= off.min() < 0.0 < off.max() <= high
    assert max(-low, high) < 1.1 * np.abs(off).max() + target.slack
