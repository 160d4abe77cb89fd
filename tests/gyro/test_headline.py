"""What is proven of a compensation, against what was planted."""

import numpy as np
import pandas as pd
import pytest

from skanfis.gyro._calibration import Recipe, calibrate
from skanfis.gyro._headline import proven_bounds
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


def test_largest_compensation_of_a_line_is_that_of_its_corner():
    """Within the range of the calibration, a line is largest at a corner of the box."""
    calibration = calibrated(lambda t: 0.005 + 2e-4 * t, gain=1.001, noise=1e-9, scatter=0.0)
    certain = proven_bounds(calibration)
    # error = output - rate, as a line in temperature and output.
    heat, output = np.meshgrid(*calibration.X.agg(["min", "max"]).to_numpy().T)
    corner = np.abs(output - (output - 0.005 - 2e-4 * heat) / 1.001).max()
    assert certain.largest == pytest.approx(corner, rel=1e-3)
    assert certain.rate_rises is True


@pytest.mark.parametrize(("unit", "gain"), [("deg/s", -0.5), ("counts", -131.0)])
def test_rate_goes_with_the_output_or_is_not_proven(unit, gain):
    """An axis mounted the other way round: its scale factor's sign is found of counts alone."""
    calibration = calibrated(lambda t: 1e-3 * t, gain=gain, output_unit=unit)
    assert proven_bounds(calibration).rate_rises is (unit == "counts")
