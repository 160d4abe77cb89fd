"""The arcsine law: planted coefficients, exact derivatives, and what lies past the sine."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from sklearn.exceptions import ConvergenceWarning

from skanfis.exceptions import ConstantInputWarning, OutOfBoundsWarning
from skanfis.gyro import physics
from skanfis.gyro.physics import OpenLoopArcsineRegressor, phase_of

REFERENCE = 20.0
PLANTED = {
    "amplitude": [-6.2e6, -6.2e6 * -40e-6],
    "sagnac_factor": [0.2536, 0.2536 * -370e-6],  # rad/(rad/s)
    "bias": [0.02, 3e-4],  # deg/s
}


def planted_output(rate, temperature, **changed):
    """Counts of a gyro that follows the law exactly."""
    a, k, b = ((PLANTED | changed)[name] for name in PLANTED)
    powers = np.polynomial.polynomial.polyval
    difference = temperature - REFERENCE
    phase = powers(difference, k) * np.deg2rad(rate + powers(difference, b))
    return powers(difference, a) * np.sin(phase)


def calibration(rng, n_rows=600, max_rate=150.0, **planted):
    rate = rng.uniform(-max_rate, max_rate, n_rows)
    temperature = rng.uniform(-20.0, 60.0, n_rows)
    return np.column_stack([planted_output(rate, temperature, **planted), temperature]), rate


def about(law, coefficients):
    """Planted coefficients in powers of the distance from the law's own temperature."""
    distance = Polynomial([law.reference_temperature_ - REFERENCE, 1.0])
    return Polynomial(coefficients)(distance).coef


@pytest.mark.parametrize("lag", [0.0, 170.0])
@pytest.mark.parametrize("amplitude", [PLANTED["amplitude"], [6e6, -240.0, -3.0]])
def test_planted_coefficients_come_back(rng, amplitude, lag):
    """The coil is ahead of the thermometer by the lag times the thermal rate [degC/s]."""
    rate, shown = rng.uniform(-150, 150, 600), rng.uniform(-20, 60, 600)
    ramp = rng.uniform(-0.05, 0.05, 600)
    output = planted_output(rate, shown + lag * ramp, amplitude=amplitude)
    X = np.column_stack([output, shown, ramp])
    law = OpenLoopArcsineRegressor(amplitude_degree=len(amplitude) - 1)
    law.set_params(temperature_rate=2 if lag else None).fit(X, rate)
    np.testing.assert_allclose(law.amplitude_, about(law, amplitude), rtol=1e-7)
    planted = about(law, PLANTED["sagnac_factor"])
    np.testing.assert_allclose(np.rad2deg(law.sagnac_factor_), planted, rtol=1e-7)
    np.testing.assert_allclose(law.bias_, about(law, PLANTED["bias"]), rtol=1e-6)
    np.testing.assert_allclose(law.predict(X), rate, atol=1e-7)
    assert law.thermometer_lag_ == pytest.approx(lag, rel=1e-7)


def test_a_law_that_does_not_settle_is_told(rng, monkeypatch):
    monkeypatch.setattr(physics, "_MAX_EVALUATIONS", 1)
    with pytest.warns(ConvergenceWarning, match="in 1 evaluations: check its columns"):
        OpenLoopArcsineRegressor().fit(*calibration(rng))


def test_noise_in_the_output_reaches_the_rate_by_the_slope(rng):
    """The estimate's variance is sigma^2 / (A K cos phi)^2, and the ends have no bias."""
    X, rate = calibration(rng, n_rows=20_000)
    noisy = X + np.outer(600.0 * rng.standard_normal(len(X)), [1.0, 0.0])
    law = OpenLoopArcsineRegressor().fit(noisy, rate)
    slope = 6.2e6 * np.deg2rad(0.2536) * np.cos(phase_of(law, X))
    normalised = (law.predict(noisy) - rate) * slope / 600.0
    assert normalised.std() == pytest.approx(1.0, abs=0.03)  # 6 standard errors
    fastest = np.abs(rate) > 120.0
    assert abs(np.mean(normalised[fastest] * np.sign(rate[fastest]))) < 0.08  # 5 standard errors


def test_constant_temperature_is_said_and_survived(rng):
    X, rate = calibration(rng)
    X[:, 1] = REFERENCE
    X[:, 0] = planted_output(rate, X[:, 1])
    with pytest.warns(ConstantInputWarning, match="20 in all rows"):
        law = OpenLoopArcsineRegressor().fit(X, rate)
    np.testing.assert_allclose(law.predict(X), rate, atol=1e-7)
    np.testing.assert_array_equal(law.amplitude_[1:], 0.0)


class TestBeyondTheSine:
    LIMIT = 1.0

    def fitted(self, rng, **parameters):
        X, rate = calibration(rng)
        return OpenLoopArcsineRegressor(max_phase=self.LIMIT, **parameters).fit(X, rate)

    def row(self, phase):
        """A row at the reference temperature with this phase, or this multiple of the sine's."""
        return np.array([[PLANTED["amplitude"][0] * np.sin(phase), REFERENCE]])

    def rate(self, phase):
        return np.rad2deg(phase / PLANTED["sagnac_factor"][0]) - PLANTED["bias"][0]

    @pytest.mark.parametrize("sign", [1.0, -1.0])
    def test_clip_holds_the_phase(self, rng, sign):
        held = self.fitted(rng).predict(self.row(sign * 1.3))  # a warning would be an error
        assert held == pytest.approx(self.rate(sign * self.LIMIT), rel=1e-7)

    def test_linear_is_the_tangent(self, rng):
        law = self.fitted(rng, out_of_bounds="linear")
        edge = self.row(self.LIMIT)[0, 0]
        at, below = law.predict([[edge, REFERENCE], [edge * (1 - 1e-6), REFERENCE]])
        with pytest.warns(OutOfBoundsWarning, match="tangent beyond max_phase=1 rad"):
            beyond = law.predict([[1.1 * edge, REFERENCE]])[0]
        assert beyond == pytest.approx(at + 1e5 * (at - below), rel=1e-4)

    def test_what_is_refused_and_flagged(self, rng):
        rows = np.vstack([self.row(0.5), self.row(1.3), [[1e9, REFERENCE]], [[0.0, 80.0]]])
        law = self.fitted(rng)
        np.testing.assert_array_equal(law.in_bounds(rows), [True, False, False, False])
        np.testing.assert_array_equal(np.isnan(phase_of(law, rows)), [False, False, True, False])
        assert not self.fitted(rng).set_params(max_phase=0.4).in_bounds(rows).any()
        predicted = law.set_params(out_of_bounds="nan").predict(rows[:3])
        np.testing.assert_array_equal(np.isnan(predicted), [False, True, True])
        law.set_params(out_of_bounds="raise")
        with pytest.raises(ValueError, match=r"1 of 2 rows cannot be inverted.*max_phase=1 rad"):
            law.predict(rows[:2])

    def test_law_goes_on_outside_the_training_data_and_says_so(self, rng):
        X, rate = calibration(rng, max_rate=65.0)
        law = OpenLoopArcsineRegressor().fit(X, rate)
        faster = np.array([[planted_output(100.0, 30.0), 30.0]])
        with pytest.warns(OutOfBoundsWarning, match=r"1 of 1 rows follow the law there\.$"):
            assert law.predict(faster) == pytest.approx(100.0, abs=1e-5)
        assert not law.in_bounds(faster)[0]


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"output": 2}, "output=2 is no column of X, which has 2 feature"),
        ({"temperature": "T"}, "temperature='T' is no column of X, which has 2 feature"),
        ({"temperature": 0}, "Two of output=0, temperature=0 are one column"),
        ({"temperature_rate": 1}, "Two of .* temperature_rate=1 are one column"),
        ({"temperature": None, "temperature_rate": 1}, "of no use with temperature=None"),
        ({"output": True}, "output=True is no column of X"),
        ({"bias_degree": 6}, "bias_degree == 6"),
        ({"max_phase": 1.6}, "max_phase == 1.6"),
        ({"out_of_bounds": "hold"}, "out_of_bounds='hold' must be one of clip, linear, nan, raise"),
    ],
)
def test_bad_parameters_are_named(rng, parameters, message):
    X, rate = calibration(rng)
    with pytest.raises(ValueError, match=message):
        OpenLoopArcsineRegressor(**parameters).fit(X, rate)


def test_bad_logs_are_refused(rng):
    X, rate = calibration(rng, n_rows=20)
    with pytest.raises(ValueError, match="6 coefficients; n_samples = 5 rows"):
        OpenLoopArcsineRegressor().fit(X[:5], rate[:5])
    with pytest.raises(ValueError, match=r"the rate \(y\) never changes"):
        OpenLoopArcsineRegressor().fit(X, np.full(20, 3.0))
    with pytest.raises(ValueError, match="the output never changes"):
        OpenLoopArcsineRegressor().fit(X * [0.0, 1.0], rate)


def test_a_fit_that_fails_leaves_the_law_of_the_one_before(rng):
    X, rate = calibration(rng, n_rows=20)
    law = OpenLoopArcsineRegressor().fit(X, rate)
    before = law.predict(X)
    with pytest.raises(ValueError, match="the output never changes"):
        law.fit(np.column_stack([X, rate]) * [0.0, 1.0, 1.0], rate)
    np.testing.assert_array_equal(law.predict(X), before)
