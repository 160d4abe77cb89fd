"""A log in a thousand forms is read as the clean one, or refused with the option that settles it.

LOG_VARIANTS=1000 tries that many (``make fuzz``); the suite a few, always the same.
"""

import os
from collections import Counter

import numpy as np
import pandas as pd

from skanfis.gyro import LogError
from skanfis.gyro._checks import check_at_rest
from skanfis.gyro._columns import SIGNALS
from skanfis.gyro._guess import Request
from skanfis.gyro.errors import UsageError
from skanfis.gyro.log import read

from .log_variants import clean_logs, variant

N_VARIANTS = int(os.environ.get("LOG_VARIANTS", "40"))
FEWEST_READ = 0.98


def outcome(case, logs, folder):
    """ "read", "refused", "asked" for an option, or "wrong"."""
    path, clean = folder / f"log{case.suffix}", logs[case.source]
    path.write_bytes(case.content)
    require = ("temperature", "output", *(["rate"] if "rate" in clean else []))
    try:
        reading = read([path], Request(require=require, guess=True))
        if "rate" not in clean:
            check_at_rest(reading.log, reading.units["output"])
    except (LogError, UsageError) as error:
        is_asked = "--" in str(error) or "give the file a header" in str(error)
        return ("asked" if is_asked else "refused"), str(error)
    log = reading.log
    if "rate" in log and "rate" not in clean:
        return "wrong", "a rate that is none"
    clean = clean.iloc[case.rows].reset_index(drop=True)
    if len(log) != len(clean):
        return "wrong", f"{len(log)} rows where {len(clean)} are due"
    if "run" in clean and log["run"].nunique() != clean["run"].nunique():
        return "wrong", f"{log['run'].nunique()} runs"
    if reading.units["output"] in SIGNALS:
        log["output"] /= np.polyfit(clean["output"], log["output"], 1)[0]
    if "time" not in log:
        return "wrong", "no time"
    # From row to row in a run: where a clock begins is nobody's matter.
    run = clean["run"] if "run" in clean else pd.Series("", clean.index)
    for each in (log, clean):
        each["time"] = each["time"].diff().where(run == run.shift(), 0.0)
    for part in set(clean) - {"run"}:
        off = np.abs(log[part] - clean[part]).max()
        if not off <= 1e-6 * np.abs(clean[part]).max():
            return "wrong", f"{part} off by {off:.3g}"
    return "read", ""


def test_a_log_in_many_forms(tmp_path):
    logs, told, counts = clean_logs(), [], Counter()
    for number in range(N_VARIANTS):
        case = variant(number, logs)
        result, why = outcome(case, logs, tmp_path)
        key = (case.is_determined, result)
        counts[key] += 1
        if result != ("read" if case.is_determined else "asked"):
            told.append(f"{number} {case.source}, {key}: {why}\n    {case.story}")
    report = f"{counts}\n" + "\n".join(told)
    n_determined = sum(n for (is_determined, _), n in counts.items() if is_determined)
    assert n_determined > 0.4 * N_VARIANTS
    assert counts[True, "read"] >= FEWEST_READ * n_determined, report
    # Nothing is read as what it is not, and nothing that two readings would do for.
    asked = {(True, "refused"), (True, "asked"), (False, "asked")}
    assert set(counts) <= {(True, "read")} | asked, report
