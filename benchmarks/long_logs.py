"""Logs of a million and of ten million rows through the command: time and memory of each way.

One thread. Terms are given: what a search takes does not depend on the rows. The files are Parquet,
38 bytes a row of the folder for temporary files; a million rows also as CSV.
"""

import tempfile
from pathlib import Path

from .command import calibrate, write_log
from .fresh import alone
from .report import Results, Table

__all__ = ["run"]

# Of a million rows.
_N_RUNS = 12
_TERMS = ("--terms", "2,2,2,2", "--force")
_MILLION = 1_000_000


def run(options):
    lines = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for millions in sorted({1, max(options.rows // _MILLION, 1)}):
            log, n_runs = f"log{millions}.parquet", _N_RUNS * millions
            n_rows = alone(write_log, folder / log, n_runs)
            ways = {"": (log,)}
            if millions == 1:
                alone(write_log, folder / "log.csv", n_runs)
                ways = {"of CSV": ("log.csv",)} | ways
            for way, arguments in ways.items():
                output = ("--output", "model")
                lines.append([f"{n_rows:,}", way, *calibrate(folder, *arguments, *_TERMS, *output)])
            target = ("--output", "rates.csv", "--force")
            used = calibrate(folder, "--apply", "model/compensator.json", log, *target)
            lines.append([f"{n_rows:,}", "--apply", *used])
            (folder / "rates.csv").unlink()
    head = ["rows", "way", "wall [s]", "CPU [s]", "peak memory [GB]"]
    return Results(tables=[Table("Long logs through the command", head, lines)])
