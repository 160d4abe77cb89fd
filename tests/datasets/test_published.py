"""Jang's benchmarks against closed forms and an independent integration, and Table 1's defects."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

from skanfis.datasets import load_ofog, make_jang_sinc, make_jang_three_input, make_mackey_glass
from skanfis.datasets._published import _mackey_glass_series


def test_sinc_on_jangs_grid_and_between():
    X, y = make_jang_sinc()
    assert len(np.unique(X, axis=0)) == 121
    # NumPy's is that of pi x, and 1 at zero.
    assert_allclose(y, np.sinc(X / np.pi).prod(axis=1), rtol=1e-13, atol=1e-17)
    centres, y = make_jang_sinc(midpoints=True)
    distances = np.abs(centres[:, None] - X).max(axis=2).min(axis=1)
    assert len(centres) == 100
    assert_allclose(distances, 1.0)
    assert_allclose(y, (np.sin(centres) / centres).prod(axis=1), rtol=1e-12, atol=1e-17)


def test_three_inputs_by_hand_and_check_points_between():
    X, y = make_jang_three_input()
    values = {tuple(row): target for row, target in zip(X.tolist(), y, strict=True)}
    assert values[1, 1, 1] == (1 + 1 + 1 + 1) ** 2
    assert values[4, 2, 4] == (1 + 2 + 1 / 2 + 1 / 8) ** 2
    check = make_jang_three_input("check")[0]
    assert (len(X), len(check)) == (216, 125)
    assert_array_equal(np.unique(X), [1, 2, 3, 4, 5, 6])
    assert_array_equal(np.unique(check), [1.5, 2.5, 3.5, 4.5, 5.5])


@pytest.mark.parametrize("make", [make_jang_three_input, make_mackey_glass])
def test_all_is_train_then_check(make):
    for joined, *parts in zip(*map(make, ("all", "train", "check")), strict=True):
        assert_array_equal(joined, np.concatenate(parts))
    with pytest.raises(ValueError, match=r"'subset' .* must be a str among .* Got 'test'"):
        make("test")


def test_series_decays_exponentially_until_the_delay():
    # The delayed value is zero until t = 17, which leaves dx/dt = -0.1 x.
    assert_allclose(_mackey_glass_series(16), 1.2 * np.exp(-0.1 * np.arange(17)), rtol=1e-9)
    # Of fourth order: half the step is sixteen times as exact.
    errors = [_mackey_glass_series(16, n_steps)[16] - 1.2 * np.exp(-1.6) for n_steps in (2, 4)]
    assert_allclose(errors[0] / errors[1], 16, rtol=0.05)


def test_series_solves_the_equation_by_the_method_of_steps():
    # From 17 to 33 the delayed value is the known exponential: an ordinary equation. The mean
    # of neighbours in the middle of a step makes the integration one of second order.
    series = _mackey_glass_series(33)

    def slope(t, x):
        delayed = 1.2 * np.exp(-0.1 * (t - 17))
        return 0.2 * delayed / (1 + delayed**10) - 0.1 * x

    times = np.arange(17, 34)
    solution = solve_ivp(slope, (17, 33), series[17:18], t_eval=times, rtol=1e-10, atol=1e-12)
    assert_allclose(series[17:], solution.y[0], rtol=5e-5)
    # First order later on: one step reads across the jump at t = 0, and half is half as wrong.
    full, half, quarter = (_mackey_glass_series(60, n_steps) for n_steps in (10, 20, 40))
    assert_allclose(np.abs(half - quarter).max() / np.abs(full - half).max(), 0.5, atol=0.02)
    assert_allclose(full, half, atol=0.005)


def test_rows_are_windows_of_one_series_from_time_118_on():
    X, y = make_mackey_glass("all")
    assert X.shape == (1000, 4)
    assert_array_equal(X[6:, 3], y[:-6])  # x(t) six rows later is what was predicted
    for newer, older in ((3, 2), (2, 1), (1, 0)):
        assert_array_equal(X[6:, older], X[:-6, newer])
    series = _mackey_glass_series(124)
    assert_array_equal(X[0], series[[100, 106, 112, 118]])
    assert y[0] == series[124]


def test_table_is_as_printed():
    # Summed from the paper's text by another program, in units of the last printed digit.
    frame = load_ofog().frame
    assert_array_equal(frame["time"], np.arange(0, 361, 20))
    assert round(frame["temperature"].sum() * 100) == 39588
    assert round(frame["rate"].sum() * 10_000) == 7360549
    assert round(frame["output"].sum() * 10_000) == 7590233
    assert frame.equals(load_ofog().data.assign(output=load_ofog().target))


def test_table_has_the_defects_that_its_description_states():
    table = load_ofog()
    for fact in ("19 are printed", "rate column is damaged", "39.5906", "39.7843", "1 degC"):
        assert fact in table.DESCR
    units, fractions = np.divmod(table.frame["rate"].to_numpy(), 1)
    assert fractions.std() < 0.0055
    assert set(units) == {37, 38, 39}
    # The output does not know of the jumps.
    output = table.target.to_numpy()
    assert abs(np.corrcoef(units, output)[0, 1]) < 0.2
    assert set(output[np.abs(output - np.median(output)) > 0.15]) == {39.5906, 39.7843}
    temperature = table.frame["temperature"]
    assert (temperature.min(), temperature.max()) == (20.47, 21.32)
