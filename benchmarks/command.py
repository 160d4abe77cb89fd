"""A log of a million rows through the command ``python -m skanfis.gyro``, as its user sees it."""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from skanfis.datasets import make_ofog

from .report import Measure, Results, Row

__all__ = ["run"]

_N_RUNS, _RUN = 12, 83_340.0  # s, a row a second
# The names give the units: the values do not tell that of the clock.
_COLUMNS = {
    "time": "time_s",
    "temperature": "temp_degC",
    "output": "output_deg_s",
    "rate": "rate_deg_s",
    "run": "run",
}
_GIGABYTE = 1e9


def run(options):
    with tempfile.TemporaryDirectory() as folder:
        n_rows = write_log(Path(folder) / "log.csv")
        calibrated = figures(calling(Path(folder), "log.csv"), 120.0, 60.0)
        model = Path("log-compensator", "compensator.json")
        applied = figures(calling(Path(folder), "--apply", model, "log.csv"))
    work = f"log of {n_rows:,} rows through the command"
    rows = [Row(f"{work}: structure, five folds, fit, report", calibrated)]
    return Results([*rows, Row(f"{work}: --apply", applied)])


def figures(used, *seconds):
    """What the command used, as measures; ``seconds`` are the bar and the aim of its wall time."""
    wall, cpu, peak = used
    return [
        Measure("wall time", wall, "s", *seconds),
        Measure("CPU", cpu, "s"),
        Measure("peak memory", peak, "GB", 2.0, 1.0),
    ]


def write_log(path):
    """A row a second, of twelve runs of 83,341 rows."""
    log = make_ofog(
        n_devices=1,
        n_runs=_N_RUNS,
        duration=_RUN,
        sampling_interval=1.0,
        profile="ramps",
        random_state=0,
    )
    log = log[list(_COLUMNS)].rename(columns=_COLUMNS)
    log.to_csv(path, index=False, float_format="%.9g")
    return len(log)


def calling(folder, *arguments):
    """Wall time and CPU time [s] and peak memory [GB] of the command."""
    command = [sys.executable, "-m", "skanfis.gyro", *map(str, arguments), "--quiet"]
    start = time.perf_counter()
    # Where it runs there is no skanfis to import but the one that runs this.
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    process = subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - start
    if status:
        raise RuntimeError(f"{' '.join(command)} failed with status {status}.")
    unit = 1 if sys.platform == "darwin" else 1024
    return seconds, used.ru_utime + used.ru_stime, used.ru_maxrss * unit / _GIGABYTE
