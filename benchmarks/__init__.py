"""Benchmarks of skanfis: ``python -m benchmarks`` runs the quick ones and prints a table.

Times are processor seconds of one thread unless a table says otherwise; those that are compared
are taken side by side in one process. A missed bar is no error: the table says what was met.
"""

import os
import warnings

# The BLAS libraries read these when NumPy is first imported, which is later.
for _library in ("OMP", "OPENBLAS", "MKL"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"
# Rows outside the training data and iterations cut short are on purpose here. Every process that
# measures imports this module.
warnings.simplefilter("ignore")
