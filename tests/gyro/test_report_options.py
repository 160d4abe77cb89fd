"""Limits of a specification: what may be typed, and which side of a limit a figure is on."""

from argparse import ArgumentTypeError

import numpy as np
import pandas as pd
import pytest

from skanfis.gyro._options import check_limit, parse_limit


@pytest.mark.parametrize(
    ("text", "value", "unit"),
    [
        ("bias=5deg/h", 5.0, "deg/h"),
        ("residual_rms= 1e-2 °/s", 0.01, "deg/s"),
        ("reduction_factor=10", 10.0, ""),
        ("scale_factor_nonlinearity=500ppm", 500.0, "ppm of full scale"),
        ("bias_ramp_sensitivity=2deg/s/(°C/min)", 2.0, "deg/s/(degC/min)"),
    ],
)
def test_what_may_be_typed(text, value, unit):
    limit = parse_limit(text)
    assert (limit.value, limit.unit) == (value, unit)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("bias", "'' must be a number"),
        ("drift=5deg/h", "must be FIGURE=VALUE; figures: residual_rms"),
        ("bias=5", "bias takes deg/s or deg/h; found ''"),
        ("bias=-2:5deg/h", "must be a number, not negative, and a unit, as in bias=5deg/h"),
        ("reduction_factor=10ppm", "reduction_factor takes no unit; found 'ppm'"),
    ],
)
def test_what_may_not(text, message):
    with pytest.raises(ArgumentTypeError, match=message):
        parse_limit(text)


def table_of(value, low=np.nan, high=np.nan):
    line = {"figure": "bias", "unit": "deg/h", "after": value, "note": "no rate changes"}
    return pd.DataFrame([line | {"after_low": low, "after_high": high}]).set_index("figure")


@pytest.mark.parametrize(
    ("text", "value", "result"),
    [
        *(("bias=5deg/h", 5.0, "pass"), ("bias=5deg/h", 5.0 + 1e-9, "fail")),
        *(("bias=5deg/h", -5.0, "pass"), ("bias=5deg/h", -5.0 - 1e-9, "fail")),
        # 0.001 deg/s is 3.6 deg/h.
        *(("bias=0.001deg/s", 3.599, "pass"), ("bias=0.001deg/s", 3.601, "fail")),
        *(("bias=5deg/h", np.nan, "not measured"), ("hysteresis=5deg/h", 1.0, "not measured")),
    ],
)
def test_both_sides_of_a_limit(text, value, result):
    check = check_limit(parse_limit(text), table_of(value))
    assert check.result == result
    assert bool(check.remark) == (result == "not measured")


@pytest.mark.parametrize(
    ("value", "low", "high", "result", "is_sure"),
    [
        *((1.0, 1.0, 4.9, "pass", True), (1.0, 1.0, 5.1, "pass", False)),
        *((1.0, -6.0, 1.0, "pass", False), (6.0, 5.1, 19.0, "fail", True)),
        # All that is permitted lies in the interval.
        *((6.0, -7.0, 19.0, "fail", False), (-6.0, -19.0, -5.1, "fail", True)),
    ],
)
def test_an_interval_over_the_limit_is_said(value, low, high, result, is_sure):
    check = check_limit(parse_limit("bias=5deg/h"), table_of(value, low, high))
    assert check.result == result
    assert (check.remark == "") == is_sure
