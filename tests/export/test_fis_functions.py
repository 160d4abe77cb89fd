"""Membership functions of the format against the definitions in MATLAB's documentation."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis.export import export_c, export_fis, export_json
from skanfis.export.fis.functions import function_of, theta_of
from skanfis.membership import FAMILIES

from ..quick import quick

LOW, HIGH = -4.0, 4.0
X = np.linspace(LOW, HIGH, 801)


def gaussmf(x, sigma, c):
    return np.exp(-((x - c) ** 2) / (2 * sigma**2))


def gbellmf(x, a, b, c):
    return 1 / (1 + np.abs((x - c) / a) ** (2 * b))


def trimf(x, a, b, c):
    return np.interp(x, [a, b, c], [0, 1, 0])


def trapmf(x, a, b, c, d):
    return np.interp(x, [a, b, c, d], [0, 1, 1, 0])


def gauss2mf(x, sigma1, c1, sigma2, c2):
    left = np.where(x < c1, gaussmf(x, sigma1, c1), 1)
    return left * np.where(x > c2, gaussmf(x, sigma2, c2), 1)


def smf(x, a, b):
    middle = (a + b) / 2
    pieces = [0 * x, 2 * ((x - a) / (b - a)) ** 2, 1 - 2 * ((x - b) / (b - a)) ** 2]
    return np.select([x <= a, x <= middle, x <= b], pieces, 1.0)


def zmf(x, a, b):
    return 1 - smf(x, a, b)


def pimf(x, a, b, c, d):
    return smf(x, a, b) * zmf(x, c, d)


def sigmf(x, a, c):
    return 1 / (1 + np.exp(-a * (x - c)))


def dsigmf(x, a1, c1, a2, c2):
    return np.abs(sigmf(x, a1, c1) - sigmf(x, a2, c2))


def psigmf(x, a1, c1, a2, c2):
    return sigmf(x, a1, c1) * sigmf(x, a2, c2)


BY_DEFINITION = {
    f.__name__: f
    for f in (gaussmf, gbellmf, trimf, trapmf, gauss2mf, smf, zmf, pimf, sigmf, dsigmf, psigmf)
}


def mu(name, parameters):
    """The family's textbook membership at X of a function in a file."""
    family, theta = theta_of(name, parameters, LOW, HIGH)
    return family.value(X[None], theta[:, None])[0]


@pytest.mark.parametrize("family", FAMILIES.values(), ids=list(FAMILIES))
def test_what_is_written_is_the_family_and_is_read(family, rng):
    for _ in range(20):
        theta = rng.normal(scale=0.7, size=(len(family.parameters), 1))
        name, parameters = function_of(family, family.natural(theta)[:, 0])
        expected = BY_DEFINITION[name](X, *parameters)
        assert_allclose(family.value(X[None], theta)[0], expected, rtol=1e-9, atol=1e-12)
        read, theta_read = theta_of(name, parameters, LOW, HIGH)
        assert read is family
        assert_allclose(theta_read, theta[:, 0], rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("gaussmf", [-1.5, 0.3]),  # a deviation counts by its size
        ("gbellmf", [-2.0, 1.5, 1.0]),
        ("gauss2mf", [-1.0, -0.5, 0.7, 0.5]),
        ("trapmf", [-1.0, 0.5, 0.5, 2.0]),  # no plateau
        ("pimf", [-1.0, 0.5, 0.5, 2.0]),
        ("dsigmf", [-3.0, 1.0, -3.0, -1.0]),  # both sigmoids fall
        ("dsigmf", [3.0, 1.0, 3.0, -1.0]),  # the greater place first
        ("psigmf", [-3.0, 1.0, 2.0, -1.0]),  # the fall first
        ("psigmf", [3.0, 1.0, 2.0, -1.0]),  # the greater place first
    ],
)
def test_other_ways_to_write_a_function_are_read(name, parameters):
    assert_allclose(mu(name, parameters), BY_DEFINITION[name](X, *parameters), atol=1e-11)


def test_vertical_flank_at_the_edge_of_the_range_or_beyond_is_as_good_as_any():
    assert_allclose(mu("trimf", [-4.0, -4.0, 1.0]), np.maximum((1 - X) / 5, 0), atol=1e-14)
    assert_allclose(mu("pimf", [0.0, 2.0, 5.0, 5.0]), smf(X, 0, 2), atol=1e-14)


@pytest.mark.parametrize(
    ("name", "parameters", "message"),
    [
        ("sinc", [1.0, 2.0], "'sinc' is not supported; gaussmf, gbellmf"),
        ("sigmf", [0.0, 2.0], "slope 0 is one half everywhere"),
        ("psigmf", [1.0, 2.0, 1.0, 2.0], "width 0, which must be"),
        ("gaussmf", [1.0], "gaussmf takes 2 parameters, found 1"),
        ("gaussmf", [0.0, 1.0], "width 0, which must be between 1e-50 and 1e"),
        ("gbellmf", [1.0, 0.0, 0.0], "slope 0, which must be between"),
        ("trimf", [0.0, -1.0, 1.0], "ascending order"),
        ("trimf", [0.0, 0.0, 1.0], r"vertical flank within its input's Range \[-4 4\]"),
        ("gauss2mf", [1.0, 1.0, 1.0, -1.0], "plateau -2, which must be"),
        ("smf", [1.0, 1.0], "width 0, which must be"),
        ("dsigmf", [1.0, 0.0, 2.0, 1.0], "must be the same and not zero"),
        ("psigmf", [1.0, 0.0, 0.0, 1.0], "slope 0 is one half everywhere"),
    ],
)
def test_refuses(name, parameters, message):
    with pytest.raises(ValueError, match=message):
        theta_of(name, parameters, LOW, HIGH)


@pytest.mark.parametrize("given", ["own", "gaussian"])
def test_a_family_of_ones_own_is_refused(given):
    class Own(FAMILIES["gaussian"]):
        name = given

    X = np.linspace(0.0, 1.0, 30)[:, None]
    estimator = quick(n_mfs=2, mf=Own).fit(X, X[:, 0])
    for export in (export_c, export_fis, export_json):
        name = {"name": "m"} if export is export_c else {}
        with pytest.raises(ValueError, match=r"class 'Own' cannot be exported; .* can: Gaussian, "):
            export(estimator, **name)
