"""Benchmarks of skanfis: ``python -m benchmarks`` runs them all and prints a table.

Times are of one thread, in seconds of the processor's time, and the best of several: what is
compared is measured side by side in one process. Nothing here passes or fails; the table says which
bar was met.
"""

import os
import warnings

# Read by the BLAS libraries when NumPy is first imported, which is later.
for _library in ("OMP", "OPENBLAS", "MKL"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"
# Rows out of range are a part of what is measured.
warnings.filterwarnings("ignore", "X lies outside the training data")
