"""The uncertainty of a row and what is proven of it, against what was planted."""

import numpy as np
import pandas as pd
import pytest

from skanfis.gyro._calibration import Recipe, calibrate
from skanfis.gyro._headline import budget_of, noise_within, proven_bounds, scatter_between
from skanfis.gyro._split import choose_split

pytestmark = pytest.mark.usefixtures("few_rivals")

N_RUNS, N_ROWS = 24, 40
NOISE, SCATTER = 2e-4, 5e-4


def calibrated(error, gain=1.0, noise=NOISE, scatter=SCATTER, **options):
    """Runs that are off by a bias each, of a gyro with an error of temperature and rate."""
    rng = np.random.default_rng(3)
    run = np.repeat(np.arange(N_RUNS), N_ROWS)
    temperature = rng.uniform(0.0, 50.0, run.size)
    rate = rng.uniform(-100.0, 100.0, run.size)
    off = scatter * rng.normal(size=N_RUNS)[run] + noise * rng.normal(size=run.size)
    output = gain * rate + error(temperature) + off
    columns = {"run": run, "temperature": temperature, "rate": rate, "output": output}
    log = pd.DataFrame(columns)
    recipe = Recipe(("temperature", "output"), write="rules", terms=(1, 1), **options)
    return calibrate(log, choose_split(log, "run"), recipe, lambda text: None)


def test_planted_noise_and_scatter_are_found():
    calibration = calibrated(lambda t: 0.005 + 2e-4 * t)
    budget = budget_of(calibration)
    n = N_RUNS * N_ROWS
    assert budget.noise == pytest.approx(NOISE, rel=4.0 / np.sqrt(2 * n))
    assert budget.scatter == pytest.approx(SCATTER, rel=2.5 / np.sqrt(2 * (N_RUNS - 1)))
    assert budget.scatter_low < SCATTER < budget.scatter_high
    # One rule of two slopes is a line: the mean leverage of its rows is 3 / n.
    in_fit = calibration.rules[-1].noise_std_
    assert budget.model == pytest.approx(in_fit * np.sqrt(3 / n), rel=0.02)
    error = (calibration.after - calibration.rate)[calibration.in_range]
    assert budget.combined == pytest.approx(np.sqrt(np.mean(error**2)), rel=0.1)


def test_scatter_is_unbiased_and_its_interval_covers():
    """Of groups of unequal sizes, whose means noise alone would make scatter as much."""
    rng = np.random.default_rng(0)
    groups = np.repeat(np.arange(10), np.arange(3, 13))
    squares, covered = [], 0
    n_logs = 400
    for _ in range(n_logs):
        off = 0.5 * rng.normal(size=10)[groups] + rng.normal(size=groups.size)
        scatter, low, high = scatter_between(off, groups)
        squares.append(scatter**2)
        covered += low <= 0.5 <= high
    # A little above, for what would be negative is zero.
    assert np.mean(squares) == pytest.approx(0.25, abs=0.03)
    assert 0.92 < covered / n_logs < 0.99
    assert np.isnan(scatter_between(off, np.zeros(off.size))).all()


def test_noise_pays_for_groups_and_parameters():
    rng = np.random.default_rng(1)
    groups = np.repeat(np.arange(50), 4)
    residual = 3.0 * rng.normal(size=50)[groups] + rng.normal(size=200)
    found = noise_within(residual, groups)
    # By hand: the mean of the variances of groups of one size.
    by_hand = np.sqrt(np.mean(np.var(residual.reshape(50, 4), axis=1, ddof=1)))
    assert found == pytest.approx(by_hand)
    of_fit = 1.1 * np.sqrt(np.mean(residual**2))
    assert noise_within(residual, groups, of_fit) == pytest.approx(1.1 * by_hand)
    assert np.isnan(noise_within(residual, np.arange(200)))


def test_largest_compensation_of_a_line_is_that_of_its_corner():
    """Within the range of the calibration, a line is largest at a corner of the box."""
    calibration = calibrated(
        lambda t: 0.005 + 2e-4 * t,
        gain=1.001,
        noise=1e-9,
        scatter=0.0,
        box=(("temperature", 5.0, 45.0), ("output", -60.0, 90.0)),
    )
    certain = proven_bounds(calibration)
    # error = output - rate, as a line in temperature and output.
    corner = 90.0 - (90.0 - 0.005 - 2e-4 * 45.0) / 1.001
    assert certain.largest == pytest.approx(corner, rel=1e-3)
    size, place = certain.met
    np.testing.assert_array_equal(place, [45.0, 90.0])
    assert size <= certain.largest
    assert certain.rate_rises is True


@pytest.mark.parametrize(("unit", "gain"), [("deg/s", -0.5), ("counts", -131.0)])
def test_rate_goes_with_the_output_or_is_not_proven(unit, gain):
    """An axis mounted the other way round: its scale factor's sign is found of counts alone."""
    calibration = calibrated(lambda t: 1e-3 * t, gain=gain, output_unit=unit)
    assert proven_bounds(calibration).rate_rises is (unit == "counts")
