"""Parameters for autopilots: a cubic over temperature for one axis of one gyro.

PX4, in TemperatureCompensation::calc_thermal_offsets_3D: X0 + X1 d + X2 d^2 + X3 d^3, d = T - TREF.
ArduPilot, in AP_InertialSensor_TCal: (GYR1 d + GYR2 d^2 + GYR3 d^3) 1e-6, d = T - 35. Both are in
rad/s and single precision; NOTES tell the rest.
"""

import textwrap

import numpy as np
from scipy.optimize import linprog

from .error_model import Piecewise

_ARDUPILOT_REFERENCE, _ARDUPILOT_SCALE = 35.0, 1e6
NOTES = {
    "px4": "PX4: a cubic about TREF that is subtracted from the rate of one axis [rad/s]. The "
    "temperature is that of the IMU's own sensor, held between TMIN and TMAX. The axes of a "
    "gyro share ID, TREF, TMIN and TMAX: calibrate all from the same log. Calibrate the gyro's "
    "offsets (CAL_GYROn_XOFF ...) anew with this: both are subtracted.",
    "ardupilot": "ArduPilot: P(T) - P(T_cal) is subtracted from the rate of one axis [rad/s], with "
    "a cubic P about 35 degC. The temperature is that of the IMU's own sensor; both are held "
    "between TMIN and TMAX. The offset and T_cal (INS_GYRn_CALTEMP) are measured at boot.",
}
_N_POINTS = 400  # Chebyshev points, denser at the ends
# Rounding errors of an evaluation in single precision, relative to the sum of all terms' sizes.
_SLACK = 16.0 * np.finfo(np.float32).eps


class Cubic:
    """The minimax cubic approximation of an error, as an autopilot holds it.

    ``coefficients`` are its parameters, in single precision. ``piecewise`` is what the autopilot
    computes [deg/s]; ArduPilot's has another constant.
    """

    def __init__(self, error, autopilot):
        self.autopilot = autopilot
        # Range ends with two decimals, rounded inwards so that they stay in the range.
        [(low, high)] = 100.0 * error.ends
        low, high = np.ceil(low) / 100.0, np.floor(high) / 100.0
        self.low, self.high = np.float32(low), np.float32(high)
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        is_px4 = autopilot == "px4"
        self.reference = np.float32(np.round(middle, 2) if is_px4 else _ARDUPILOT_REFERENCE)
        T = middle + half * np.cos(np.pi * np.arange(_N_POINTS + 1) / _N_POINTS)
        # In powers of the distance from the reference [deg/s].
        found = _nearest_cubic((T - float(self.reference)) / half, error(T[:, None]))
        found /= half ** np.arange(4)
        scale = 1.0 if is_px4 else _ARDUPILOT_SCALE
        self.coefficients = (np.deg2rad(found) * scale).astype(np.float32)
        values = np.rad2deg(self.coefficients.astype(float) / scale)
        if not is_px4:
            values[0] = found[0]
        edges = np.array([self.low, self.high], dtype=float)
        farthest = np.abs(edges - float(self.reference)).max()
        slack = _SLACK * (np.abs(values) * farthest ** np.arange(4)).sum()
        origin = [np.array([float(self.reference)])]
        self.piecewise = Piecewise(
            [edges], origin, [1.0], np.arange(4)[:, None], values[:, None], slack
        )

    def text(self, notes, axis, instance=None, device_id=None):
        """The parameter file of one axis ("x", "y" or "z") of a gyro; ``notes`` are comments."""
        instance = instance or ("0" if self.autopilot == "px4" else "1")
        lines = [f"# {line}" for note in notes for line in textwrap.wrap(note, 96)]
        if self.autopilot == "ardupilot":
            imu = f"INS_TCAL{instance}_"
            found = {f"{imu}ENABLE": 1, f"{imu}TMIN": self.low, f"{imu}TMAX": self.high}
            found |= {f"{imu}GYR{k}_{axis.upper()}": self.coefficients[k] for k in (1, 2, 3)}
            lines += [f"{name} {_text(value)}" for name, value in found.items()]
            return "\n".join([*lines, ""])
        gyro, whole = f"TC_G{instance}_", {"TC_G_ENABLE": 1}
        if device_id is None:
            given = f"--target px4:{axis}:{instance}:DEVICE_ID"
            lines.append(f"# {gyro}ID is missing, and PX4 compensates nothing. Give {given}.")
        else:
            whole[f"{gyro}ID"] = device_id
        found = {f"{gyro}TREF": self.reference, f"{gyro}TMIN": self.low, f"{gyro}TMAX": self.high}
        for k, each in enumerate(self.coefficients):
            found[f"{gyro}X{k}_{'xyz'.index(axis)}"] = each
        # Vehicle, component, name, value, and type: 6 is an integer, 9 a float.
        lines += [f"1\t1\t{name}\t{value}\t6" for name, value in whole.items()]
        lines += [f"1\t1\t{name}\t{_text(value)}\t9" for name, value in found.items()]
        return "\n".join([*lines, ""])


def _text(value):
    """A number that reads back as the same float, without an exponent."""
    return np.format_float_positional(np.float32(value), trim="-")


def _nearest_cubic(s, values):
    """Coefficients of the minimax cubic in s, by linear programming."""
    offset, scale = values.mean(), np.ptp(values) or 1.0
    design, one = np.vander(s, 4, increasing=True), np.ones((s.size, 1))
    above = np.block([[design, -one], [-design, -one]])
    target = (values - offset) / scale
    limits = np.concatenate([target, -target])
    found = linprog([0.0] * 4 + [1.0], above, limits, bounds=(None, None))
    return scale * found.x[:4] + [offset, 0.0, 0.0, 0.0]
