"""The certain largest difference: a closed form, and no point beyond it."""

import numpy as np
import pandas as pd
import pytest

from skanfis.gyro import GyroCompensator
from skanfis.gyro.targets.error_model import ErrorModel
from skanfis.gyro.targets.piecewise import Piecewise, difference
from skanfis.gyro.targets.tables import Table

from .models import error_of, error_over_temperature, polynomial, rows

BEND = 3e-5  # deg/s/degC^2


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
    assert low == pytest.approx(-largest, rel=0.03)
    assert low <= -largest
    assert 0.0 <= high <= 0.03 * largest
    low, high = difference(parabola, line_through(parabola, edges, shift=-2.0 * largest))
    assert high == pytest.approx(2.0 * largest, rel=0.03)
    assert low >= 0.9 * largest


@pytest.mark.parametrize(
    ("kind", "type_name"),
    [
        *((kind, "double") for kind in ("rules", "polynomial", "law and line")),
        *(("over the temperature", name) for name in ("double", "float", "q31", "q15")),
    ],
)
def test_no_point_is_beyond_and_some_is_near(kind, type_name):
    error = error_over_temperature() if kind == "over the temperature" else error_of(kind)
    target = Table(error, type_name, 8).piecewise
    low, high = difference(error, target)
    points = rows(100_000, seed=3)[:, : len(target.ends)]
    # A table of whole numbers may begin a step within the range.
    points = points[points[:, 0] >= target.ends[0, 0]]
    off = error(points) - target(points)
    assert low <= off.min() < 0.0 < off.max() <= high
    assert max(-low, high) < 1.1 * np.abs(off).max() + target.slack
