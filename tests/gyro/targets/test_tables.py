"""Tables in C, compiled and run: what they say, in every type, wherever the input lies."""

import re

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from skanfis.gyro.targets.error_model import difference
from skanfis.gyro.targets.tables import TYPES, Table

from ...export.c_compiler import UNTOUCHED, evaluate_all, needs_compiler, told
from .models import ENDS, error_of

UNITS = {"temperature": "degC", "output": "counts"}
REALS = {"float": np.float32, "double": np.float64, "q31": np.int32, "q15": np.int16}


def made(kind, type_name, n_cells=8):
    error = error_of("rules") if kind == "rate-table" else error_of("rules", 1)
    return error, Table(error, type_name, n_cells)


def scales_of(header):
    """What a whole number stands for, by input and of the error, as the header tells it."""
    inputs = re.findall(r"x\[\d\] is \w+ / 2\^(-?\d+) ", told(header))
    unit = re.search(r"y\[0\] \* 2\^(-?\d+) ", told(header))[1]
    return 2.0 ** np.array(inputs, dtype=float), 2.0 ** float(unit)


@pytest.mark.theory
@needs_compiler
@pytest.mark.parametrize("type_name", TYPES)
@pytest.mark.parametrize("kind", ["table", "rate-table"])
def test_what_c_says_is_within_the_certain_difference(kind, type_name, tmp_path):
    error, table = made(kind, type_name)
    code, real = table.code(["A note */ with stars * 2."], UNITS), REALS[type_name]
    rng, d = np.random.default_rng(5), len(table.names)
    points = rng.uniform(*ENDS[:d].T, (5000, d))
    bad = np.repeat([[np.nan], [np.inf], [-np.inf]], d, axis=1)
    if np.issubdtype(real, np.integer):
        scales, unit = scales_of(code.header)
        ends = np.iinfo(real).min, np.iinfo(real).max
        whole = rng.integers(*ends, (5000, d), endpoint=True)
        whole[:4] = np.array([ends, ends[::-1], ends[:1] * 2, ends[1:] * 2])[:, :d]
        X = np.vstack([whole, np.rint(points / scales)]).astype(real)
        # A step of the error is a small part of it.
        assert unit < 1e-3 * np.abs(error(points)).max()
        bad = bad[:0]
    else:
        scales, unit = np.ones(d), 1.0
        X = np.vstack([points, 3.0 * points]).astype(real)
    inputs = X * scales
    held = inputs.clip(*table.piecewise.ends.T)
    outside = (held != inputs).any(axis=1)
    given = np.vstack([X, held / scales, bad]).astype(real)
    [(y, status)] = evaluate_all([code], given, tmp_path, "c99", [1])
    (y, again), nothing = np.split(y[: 2 * len(X), 0], 2), y[2 * len(X) :]
    np.testing.assert_array_equal(status[: len(X)], outside)
    # Held at the ends is the value there, to the last bit.
    np.testing.assert_array_equal(y, again)
    np.testing.assert_array_equal(status[2 * len(X) :], 2 + 8)
    np.testing.assert_array_equal(nothing, UNTOUCHED)
    assert 100 < outside.sum() < len(X) - 100
    low, high = difference(error, table.piecewise)
    # What the caller has rounded counts as it was before.
    asked = held if unit == 1.0 else np.vstack([held[:5000], points]).clip(*table.piecewise.ends.T)
    off = error(asked) - y * unit
    assert low <= off.min()
    assert off.max() <= high


@pytest.mark.parametrize("kind", ["table", "rate-table"])
def test_a_table_is_the_interpolation_between_values_of_the_error(kind):
    error, table = made(kind, "double", 6)
    axes = [np.linspace(*ends, 7) for ends in ENDS[: len(table.names)]]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    values = error(grid.reshape(-1, len(axes))).reshape(grid.shape[:-1])
    points = np.random.default_rng(6).uniform(*ENDS[: len(axes)].T, (500, len(axes)))
    wanted = RegularGridInterpolator(axes, values)(points)
    np.testing.assert_allclose(table.piecewise(points), wanted, atol=1e-12)


def test_the_header_says_what_goes_in_and_comes_out():
    header = made("rate-table", "q15")[1].code(["Subtract it."], UNITS).header
    for text in (
        "Subtract it.",
        "8 x 8 cells; C99, int_least16_t.",
        "7 multiplications, 7 divisions",
        "[0] temperature [degC]: -20 to 60",
        "[1] output [counts]: -2500 to 2500",
        "x[0] is temperature / 2^-9 (0.00195312), x[1] is output / 2^-3 (0.125), rounded by the "
        "caller and held within -32768 and 32767.",
        "No sum or product overflows",
    ):
        assert text in told(header)
    assert "#include <stdint.h>" in header


@pytest.mark.parametrize("type_name", TYPES)
def test_a_plane_is_a_plane_to_the_end_of_the_range(type_name):
    # In fixed point cells are whole numbers wide, and the last of them goes beyond the range.
    class Plane:
        names, ends = ["temperature", "output"], np.array([(-23.0664, 61.0098), (-99.3, 101.7)])

        def __call__(self, points):
            return points.clip(*self.ends.T) @ [0.02, -0.01]

    table = Table(Plane(), type_name)
    low, high = table.piecewise.ends.T
    points = np.random.default_rng(7).uniform(low, high, (500, 2))
    points[:4] = [low, high, (low[0], high[1]), (high[0], low[1])]
    # The unit that a value is rounded to, or the last bit of a float.
    atol = table.unit if table.bits else 1e-6
    np.testing.assert_allclose(table.piecewise(points), Plane()(points), atol=atol)
