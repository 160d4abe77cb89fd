"""Jang's benchmarks against closed forms, and against an independent integration."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

from skanfis.datasets import make_jang_sinc, make_jang_three_input, make_mackey_glass
from skanfis.datasets._jang import _mackey_glass_series


def _mackey_glass_slope(x, delayed):
    return 0.2 * delayed / (1 + delayed**10) - 0.1 * x


class TestSinc:
    def test_values_of_the_formula(self):
        X, y = make_jang_sinc()
        values = {tuple(row): target for row, target in zip(X.tolist(), y, strict=True)}
        assert values[0.0, 0.0] == 1.0
        assert_allclose(values[0.0, 2.0], np.sin(2) / 2, rtol=1e-14)
        assert_allclose(values[-10.0, 4.0], np.sin(10) / 10 * np.sin(4) / 4, rtol=1e-13)

    def test_grid_is_jangs(self):
        X, _ = make_jang_sinc()
        assert len(X) == len(np.unique(X, axis=0)) == 121
        assert_allclose(np.unique(X), np.arange(-10, 11, 2))

    def test_midpoints_are_one_unit_from_every_grid_line(self):
        corners, centres = make_jang_sinc()[0], make_jang_sinc(midpoints=True)[0]
        distances = np.abs(centres[:, None] - corners).max(axis=2).min(axis=1)
        assert len(centres) == 100
        assert_allclose(distances, 1.0)

    def test_midpoint_values(self):
        X, y = make_jang_sinc(6, midpoints=True)
        with np.errstate(invalid="ignore"):
            expected = np.where(X == 0, 1.0, np.sin(X) / X).prod(axis=1)
        assert_allclose(y, expected, rtol=1e-12, atol=1e-17)

    @pytest.mark.parametrize("n_points", [1, 2.5, "11"])
    def test_refuses_what_is_no_grid(self, n_points):
        with pytest.raises(ValueError, match="n_points"):
            make_jang_sinc(n_points)


class TestThreeInput:
    def test_values_worked_out_by_hand(self):
        X, y = make_jang_three_input()
        values = {tuple(row): target for row, target in zip(X.tolist(), y, strict=True)}
        assert values[1, 1, 1] == (1 + 1 + 1 + 1) ** 2
        assert values[4, 2, 4] == (1 + 2 + 1 / 2 + 1 / 8) ** 2

    def test_check_points_lie_between_training_points(self):
        train, check = make_jang_three_input()[0], make_jang_three_input("check")[0]
        assert (len(train), len(check)) == (216, 125)
        assert_array_equal(np.unique(train), [1, 2, 3, 4, 5, 6])
        assert_array_equal(np.unique(check), [1.5, 2.5, 3.5, 4.5, 5.5])

    def test_all_is_train_then_check(self):
        for joined, *parts in zip(
            *map(make_jang_three_input, ("all", "train", "check")), strict=True
        ):
            assert_array_equal(joined, np.concatenate(parts))

    def test_refuses_an_unknown_subset(self):
        with pytest.raises(ValueError, match=r"must be a str among .* Got 'test'"):
            make_jang_three_input("test")


class TestMackeyGlass:
    def test_decays_exponentially_until_the_delay(self):
        # The delayed value is zero until t = 17, which leaves dx/dt = -0.1 x.
        series = _mackey_glass_series(16, 17, 1.2, 0.1)
        assert_allclose(series, 1.2 * np.exp(-0.1 * np.arange(17)), rtol=1e-9)

    def test_half_the_step_is_sixteen_times_as_exact_before_the_jump_is_read(self):
        exact = 1.2 * np.exp(-1.6)
        errors = [_mackey_glass_series(16, 17, 1.2, step)[16] - exact for step in (0.5, 0.25)]
        assert_allclose(errors[0] / errors[1], 16, rtol=0.05)

    def test_integrates_the_equation_by_the_method_of_steps(self):
        # From 17 to 33 the delayed value is the known exponential: an ordinary equation. The mean
        # of neighbours in the middle of a step makes the integration one of second order.
        series = _mackey_glass_series(33, 17, 1.2, 0.1)
        solution = solve_ivp(
            lambda t, x: _mackey_glass_slope(x, 1.2 * np.exp(-0.1 * (t - 17))),
            (17, 33),
            series[17:18],
            t_eval=np.arange(17, 34),
            rtol=1e-10,
            atol=1e-12,
        )
        assert_allclose(series[17:], solution.y[0], rtol=5e-5)

    def test_agrees_with_half_the_step_at_early_times(self):
        # First order: one step reads across the jump at t = 0, and half a step is half as wrong.
        full, half, quarter = (
            _mackey_glass_series(60, 17, 1.2, step) for step in (0.1, 0.05, 0.025)
        )
        assert_allclose(full, half, atol=0.005)
        assert_allclose(np.abs(half - quarter).max() / np.abs(full - half).max(), 0.5, atol=0.02)

    def test_equilibrium_stays(self):
        # x = 1 solves 0.2 / (1 + x^10) = 0.1; without delay every start is drawn to it.
        series = _mackey_glass_series(400, 0.1, 0.5, 0.1)
        assert_allclose(series[-1], 1.0, atol=1e-9)

    def test_rows_are_windows_of_one_series(self):
        X, y = make_mackey_glass("all")
        assert X.shape == (1000, 4)
        assert_array_equal(X[6:, 3], y[:-6])  # x(t) six rows later is what was predicted
        for newer, older in ((3, 2), (2, 1), (1, 0)):
            assert_array_equal(X[6:, older], X[:-6, newer])

    def test_windows_start_at_time_118(self):
        X, y = make_mackey_glass()
        series = _mackey_glass_series(124, 17, 1.2, 0.1)
        assert_array_equal(X[0], series[[100, 106, 112, 118]])
        assert y[0] == series[124]

    def test_all_is_train_then_check(self):
        for joined, *parts in zip(*map(make_mackey_glass, ("all", "train", "check")), strict=True):
            assert_array_equal(joined, np.concatenate(parts))

    @pytest.mark.parametrize(
        ("parameters", "message"),
        [
            ({"step": 0.3}, "must divide 1 "),
            ({"step": 0.1, "tau": 17.05}, "must divide tau"),
            ({"tau": -1}, "'tau' .* Got -1"),
            ({"tau": float("nan")}, "'tau' .* Got nan"),
            ({"initial_value": -0.1}, "initial_value"),
            ({"subset": "test"}, "'subset' .* must be a str among"),
        ],
    )
    def test_refuses_parameters_without_meaning(self, parameters, message):
        with pytest.raises(ValueError, match=message):
            make_mackey_glass(**parameters)
