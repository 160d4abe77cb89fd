"""100,000 spoilt .fis files: read, or refused with the line, each in less than a second.

What is read must also predict: finite numbers, without a warning of overflow.
"""

import tempfile
import warnings
from pathlib import Path
from time import perf_counter

import numpy as np

from skanfis.export import read_fis
from tests.export.mutations import mutated, seeds

from .report import Measure, Results, Row

__all__ = ["run"]

N_FILES = 100_000


def outcome(path):
    """ "read" or "refused"; any other exception goes through, and so does a warning."""
    try:
        model = read_fis(path)
    except ValueError as error:
        if "line " not in str(error):
            raise AssertionError(f"no line in: {error}") from error
        return "refused"
    middle = 0.5 * (model.minimum + model.maximum)
    outputs = model.predict(np.stack([model.minimum, middle, model.maximum]))
    if not np.isfinite(outputs).all():
        raise AssertionError("a model that was read predicts what is not finite")
    return "read"


def run(options):
    rng, sound = np.random.default_rng(0), seeds()
    counts, slowest, faults = {"read": 0, "refused": 0}, 0.0, []
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("error")
        path = Path(folder) / "spoilt.fis"
        for _ in range(N_FILES):
            data = mutated(rng, sound)
            path.write_bytes(data)
            start = perf_counter()
            try:
                counts[outcome(path)] += 1
            except Exception as error:
                faults.append((repr(error), data))
            slowest = max(slowest, perf_counter() - start)
    for error, data in faults[:10]:
        print(error, data)
    measures = [
        Measure("not ValueError", len(faults), bar=0),
        Measure("slowest", slowest, "s", bar=1.0),
    ]
    work = f"{N_FILES:,} spoilt .fis files, of which {counts['read']:,} could be read"
    return Results([Row(work, measures)])
