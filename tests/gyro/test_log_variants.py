"""A log in a thousand forms is read as the clean one, or refused with the option that settles it.

LOG_VARIANTS=1000 tries that many (``make fuzz``); the suite a few, always the same.
"""

import os

import numpy as np
import pytest
from sklearn.linear_model import LinearRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler

from skanfis.gyro import LogError
from skanfis.gyro._checks import check_at_rest
from skanfis.gyro._guess import Request
from skanfis.gyro.errors import UsageError
from skanfis.gyro.log import read

from . import instrument_logs
from .log_variants import clean_logs, variant

N_VARIANTS = int(os.environ.get("LOG_VARIANTS", "40"))
FEWEST_READ = 0.98


@pytest.fixture(scope="module")
def logs():
    return clean_logs()


def rate_error(log):
    """Inputs and target of a compensator, the output scaled to the rate."""
    if "rate" not in log:
        return log[["temperature"]], log["output"]
    output = log["output"] / np.polyfit(log["rate"], log["output"], 1)[0]
    return log[["temperature"]].assign(output=output), output - log["rate"]


def cubic(X, y):
    return make_pipeline(StandardScaler(), PolynomialFeatures(3), LinearRegression()).fit(X, y)


def outcome(case, logs, folder):
    """ "read", "refused", "asked" for an option, or "wrong"."""
    path = folder / f"log{case.number}{case.suffix}"
    path.write_bytes(case.content)
    clean = logs[case.source]
    require = ("temperature", "output", *(["rate"] if "rate" in clean else []))
    try:
        reading = read([path], Request(require=require, guess=True))
        if "rate" not in clean:
            check_at_rest(reading.log, reading.units["output"])
    except (LogError, UsageError) as error:
        return ("asked" if "--" in str(error) or "give the file a header" in str(error) else
                "refused"), str(error)  # fmt: skip
    finally:
        path.unlink()
    log = reading.log
    if "rate" in log and "rate" not in clean:
        return "wrong", "a rate that is none"
    found = cubic(*rate_error(log))
    X, y = rate_error(clean.iloc[case.rows])
    expected = cubic(X, y).predict(X)
    off = np.sqrt(np.mean((found.predict(X) - expected) ** 2) / np.mean(expected**2))
    if "time" not in log:
        return "wrong", "no time"
    steps = [np.median(np.diff(each["time"])) for each in (log, clean)]
    if abs(steps[0] / steps[1] - 1.0) > 0.01:
        return "wrong", f"steps of {steps[0]:.4g} s where {steps[1]:.4g} are due"
    if off > 0.01 or len(log) != case.rows.size:
        return "wrong", f"off by {off:.3g}, {len(log)} of {case.rows.size} rows"
    return "read", ""


@pytest.mark.parametrize(
    ("make", "n_variants"),
    [
        (variant, N_VARIANTS),
        (instrument_logs.variant, max(N_VARIANTS // 5, 11)),
    ],
    ids=["by parts", "by instruments"],
)
def test_a_log_in_many_forms(logs, tmp_path, make, n_variants):
    told, counts = [], {}
    for number in range(n_variants):
        case = make(number, logs)
        result, why = outcome(case, logs, tmp_path)
        key = (case.is_determined, result)
        counts[key] = counts.get(key, 0) + 1
        if result != ("read" if case.is_determined else "asked"):
            told.append(f"{number} {case.source}, {key}: {why}\n    {case.story}")
    report = f"{counts}\n" + "\n".join(told)
    n_determined = sum(n for (is_determined, _), n in counts.items() if is_determined)
    assert n_determined > 0.4 * n_variants
    assert counts.get((True, "read"), 0) >= FEWEST_READ * n_determined, report
    assert not any(result == "wrong" for _, result in counts), report
    assert set(counts) <= {(True, "read"), (True, "refused"), (True, "asked"), (False, "asked")}, (
        report
    )
