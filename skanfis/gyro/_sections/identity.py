"""Whose gyro, when, by whom, from which files, with which program and options."""

import platform

import numpy as np
import scipy
import sklearn

from ... import __version__

__all__ = ["identity", "programs"]


def identity(page, results):
    """What is needed to find this calibration again, and to repeat it."""
    dossier = results.dossier
    page.section("This calibration")
    entries = [
        ("device, serial number", dossier.serial or "not given"),
        ("operator", dossier.operator or "not given"),
        ("made", dossier.made or "not given"),
        ("program", programs()),
    ]
    page.table(("what", "entry"), entries)
    if dossier.files:
        lines = [(file.name, f"{file.n_bytes:,}", file.sha256) for file in dossier.files]
        page.table(("file of the log", "bytes", "SHA-256"), lines)
    page.paragraph(
        f"Errors and biases are in {results.symbol} throughout, and rates of the table in °/s.",
        kind="soft",
    )


def programs():
    """The programs that figures depend on, with their versions."""
    return (
        f"skanfis {__version__} with scikit-learn {sklearn.__version__}, NumPy {np.__version__}, "
        f"SciPy {scipy.__version__} and Python {platform.python_version()}"
    )
