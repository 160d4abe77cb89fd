"""ANFIS, the adaptive neuro-fuzzy inference system, as a scikit-learn estimator."""

import os
import signal
import sys

# Ctrl-C while the command is still importing ends it, without a traceback; then it takes over.
if {"skanfis.gyro", "skanfis-gyro", "skanfis-gyro.exe"} & set(map(os.path.basename, sys.orig_argv)):
    signal.signal(signal.SIGINT, signal.SIG_DFL)

from .regressor import ANFISRegressor

__all__ = ["ANFISRegressor", "__version__"]

__version__ = "0.1.0"
