"""ANFIS, the adaptive neuro-fuzzy inference system, as a scikit-learn estimator."""

import os
import signal
import sys

# Ctrl-C while the command is still importing ends it, without a traceback; then it takes over.
if ("-m", "skanfis.gyro") in zip(sys.orig_argv, sys.orig_argv[1:], strict=False) or any(
    os.path.basename(word).removesuffix(".exe") == "skanfis-gyro" for word in sys.orig_argv[:2]
):
    signal.signal(signal.SIGINT, signal.SIG_DFL)

from .regressor import ANFISRegressor

__all__ = ["ANFISRegressor", "__version__"]

__version__ = "0.1.0"
