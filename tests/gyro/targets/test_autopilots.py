"""Parameter files, read back and evaluated as the autopilots do: transcribed from their sources."""

import numpy as np
import pytest

from skanfis.gyro.targets.autopilots import Cubic
from skanfis.gyro.targets.error_model import difference

from .models import ENDS, error_of

F = np.float32


class Within:
    """A function of the temperature as an error in a range."""

    def __init__(self, function, ends):
        self.function, self.ends = function, ends

    def __call__(self, points):
        return self.function(points)


TEMPERATURES = np.linspace(-20.0, 60.0, 4001).astype(F)


def parameters(text):
    """Names and values of either file; comments, and lines that are empty, aside."""
    lines = [line.split() for line in text.splitlines() if line and not line.startswith("#")]
    is_px4 = len(lines[0]) == 5
    assert all(line[:2] == ["1", "1"] and line[4] in "69" for line in lines if is_px4)
    return {line[2] if is_px4 else line[0]: line[3] if is_px4 else line[1] for line in lines}


def px4_offset(found, temperature, gyro, axis):
    """TemperatureCompensation::calc_thermal_offsets_3D of PX4-Autopilot, in float [rad/s]."""

    def coef(name):
        return F(found[f"TC_G{gyro}_{name}"])

    low, high, reference = (coef(name) for name in ("TMIN", "TMAX", "TREF"))
    below = np.where(temperature < low, low - reference, temperature - reference)
    delta_temp = np.where(temperature > high, high - reference, below)
    delta_temp_2 = delta_temp * delta_temp
    delta_temp_3 = delta_temp_2 * delta_temp
    x0, x1, x2, x3 = (coef(f"X{k}_{axis}") for k in range(4))
    offset = x0 + x1 * delta_temp + x2 * delta_temp_2 + x3 * delta_temp_3
    assert offset.dtype == F
    return offset


def ardupilot_correction(found, temperature, cal_temp, imu, axis):
    """What AP_InertialSensor_TCal::correct_sensor of ArduPilot adds to a rate, in float [rad/s]."""
    low, high = (F(found[f"INS_TCAL{imu}_{name}"]) for name in ("TMIN", "TMAX"))
    c = [F(found[f"INS_TCAL{imu}_GYR{k}_{axis}"]) for k in (1, 2, 3)]
    assert found[f"INS_TCAL{imu}_ENABLE"] == "1"

    def polynomial_eval(tdiff):
        return (c[0] + (c[1] + c[2] * tdiff) * tdiff) * tdiff * F(1.0e-6)

    temperature, cal_temp = np.clip(temperature, low, high), np.clip(cal_temp, low, high)
    v = -polynomial_eval(temperature - F(35.0))
    v = v + polynomial_eval(cal_temp - F(35.0))
    assert v.dtype == F
    return v


@pytest.mark.parametrize("kind", ["rules", "polynomial"])
def test_px4_is_within_the_certain_difference(kind):
    error = error_of(kind, 1)
    cubic = Cubic(error, "px4")
    found = parameters(cubic.text(["A note."], "z", "2", "3407914"))
    assert {"TC_G_ENABLE": "1", "TC_G2_ID": "3407914"}.items() <= found.items()
    subtracted = np.rad2deg(px4_offset(found, TEMPERATURES, 2, 2).astype(float))
    off = error(TEMPERATURES[:, None].astype(float)) - subtracted
    low, high = difference(error, cubic.piecewise)
    assert low <= off.min()
    assert off.max() <= high
    if kind == "polynomial":
        # A cubic is itself, to the digits of its parameters.
        assert max(-low, high) < 2e-5 * np.abs(error(ENDS[0][:, None])).max()
    else:
        assert max(-low, high) < 1.05 * np.abs(off).max()
    beyond = px4_offset(found, np.array([-90.0, 150.0], dtype=F), 2, 2)
    np.testing.assert_array_equal(beyond, px4_offset(found, TEMPERATURES[[0, -1]], 2, 2))


def test_ardupilot_is_within_the_certain_difference_for_any_calibration_temperature():
    error = error_of("rules", 1)
    cubic = Cubic(error, "ardupilot")
    found = parameters(cubic.text(["A note."], "y", "3"))
    assert len(found) == 6
    low, high = difference(error, cubic.piecewise)
    model = error(TEMPERATURES[::20, None].astype(float))
    T = TEMPERATURES[::20]
    subtracted = -np.rad2deg(ardupilot_correction(found, T[:, None], T, 3, "Y").astype(float))
    off = np.abs(model[:, None] - model - subtracted)
    assert off.max() <= high - low
    assert off.max() > 0.95 * (high - low)


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_the_nearest_cubic_of_a_fourth_power_by_chebyshev(autopilot):
    # The nearest cubic to x^4 on [-1, 1] is x^4 - T_4(x) / 8, and 1 / 8 away five times.
    fourth = Within(lambda points: ((points[:, 0] - 20.0) / 40.0) ** 4, ENDS[:1])
    cubic = Cubic(fourth, autopilot)
    x = np.linspace(-1.0, 1.0, 2001)
    off = fourth(20.0 + 40.0 * x[:, None]) - cubic.piecewise(20.0 + 40.0 * x[:, None])
    np.testing.assert_allclose(off, np.cos(4.0 * np.arccos(x)) / 8.0, atol=1e-4)


@pytest.mark.parametrize(("autopilot", "name"), [("px4", "TC_G1_"), ("ardupilot", "INS_TCAL1_")])
def test_a_range_is_no_wider_for_two_digits_and_no_parameter_has_an_exponent(autopilot, name):
    error = Within(error_of("rules", 1), np.array([(-19.996, 59.994)]))
    text = Cubic(error, autopilot).text([], "x", "1")
    found = parameters(text)
    assert (found[f"{name}TMIN"], found[f"{name}TMAX"]) == ("-19.99", "59.99")
    assert not any("e" in value for value in found.values())
    assert ("# TC_G1_ID is missing, " in text) == (autopilot == "px4")
