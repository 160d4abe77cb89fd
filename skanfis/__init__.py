"""ANFIS, the adaptive neuro-fuzzy inference system, as a scikit-learn estimator."""

import os
import signal
import sys

# Ctrl-C while the command is still importing ends it, without a traceback; then it takes over.
_words = sys.orig_argv
if "skanfis.gyro" in _words[1:4] or os.path.basename(sys.argv[0]) == "skanfis-gyro":
    signal.signal(signal.SIGINT, signal.SIG_DFL)

from .regressor import ANFISRegressor  # noqa: E402

__all__ = ["ANFISRegressor", "__version__"]

__version__ = "0.1.0"
