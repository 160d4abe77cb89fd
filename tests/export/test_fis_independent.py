"""Programs that are not ours read our .fis files and compute what the model predicts.

fuzzylite is Debian's libfuzzylite; where it is not installed, its package is downloaded by apt-get
and unpacked, for which nobody needs to be root.
"""

import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis.export import export_fis, read_fis
from skanfis.membership import FAMILIES

from .. import oracles
from .rule_bases import EVERY_PAIR, MODELS, build, rows_of

N_ROWS = 1000
# In full scale. Where terms end at a foot, ours have a floor of 1e-10 there; others agree to
# rounding errors, which in a constant about zero are those of 1e6 times the slope in time.
TOLERANCE = dict.fromkeys(FAMILIES, 1e-10) | dict.fromkeys(
    ("triangular", "trapezoidal", "pi_shaped", "s_shaped", "z_shaped"), 1e-6
)

# fuzzylite counts strengths below 1e-6 as zero, unless told otherwise; its command line can not be.
FUZZYLITE = """
import ctypes, sys
library = ctypes.CDLL(sys.argv[1])
ctypes.c_double.in_dll(library, "_ZN2fl9fuzzylite8_machepsE").value = 0.0
words = [word.encode() for word in sys.argv[1:]]
sys.exit(library._ZN2fl7Console4mainEiPPKc(len(words), (ctypes.c_char_p * len(words))(*words)))
"""


@pytest.fixture(scope="session")
def fuzzylite(tmp_path_factory):
    """A function that runs fuzzylite's command line with these words."""
    installed = next(Path("/usr/lib").glob("*/libfuzzylite.so.6*"), None)
    library = installed or _downloaded(tmp_path_factory.mktemp("fuzzylite"))

    def run(*words):
        command = [sys.executable, "-c", FUZZYLITE, library, *words, "-decimals", "17"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr

    return run


def _downloaded(folder):
    for package in ("libfuzzylite6.0", "libfuzzylite6.0t64"):
        with suppress(OSError, subprocess.SubprocessError):
            settings = {"cwd": folder, "capture_output": True, "timeout": 60, "check": True}
            subprocess.run(["apt-get", "download", package], **settings)
            subprocess.run(["dpkg-deb", "-x", *folder.glob("*.deb"), folder], **settings)
            return next(folder.glob("usr/lib/*/libfuzzylite.so.6*"))
    pytest.skip(
        "NO INDEPENDENT READER HAS CHECKED THE .fis FILES: libfuzzylite is not installed and "
        "could not be downloaded. On Debian or Ubuntu: apt-get install fuzzylite."
    )


GRIDS = {
    mf: build(oracles.random_grid(np.random.default_rng(0), [family] * 2, (3, 2), (0, 2)))
    for mf, family in FAMILIES.items()
}


@pytest.mark.theory
@pytest.mark.filterwarnings("ignore:At .* no rule of the .fis file fires")
@pytest.mark.parametrize("name", GRIDS | EVERY_PAIR)
def test_fuzzylite_agrees_on_every_family_and_rule_base(name, fuzzylite, tmp_path):
    model = (GRIDS | EVERY_PAIR)[name]
    rows = rows_of(model, 1.0, N_ROWS)
    if name in GRIDS:
        # Where no rule of the file fires, fuzzylite gives NaN.
        fires = model.antecedent.log_memberships(rows.T).reshape(-1, N_ROWS) > np.log(1e-6)
        rows = rows[fires[:3].any(axis=0) & fires[3:].any(axis=0)]
    path, given, found = (tmp_path / name for name in ("model.fis", "rows", "outputs"))
    export_fis(model, path)
    np.savetxt(given, rows, fmt="%.17g")
    files = ["-i", path, "-if", "fis", "-d", given, "-o", found, "-of", "fld"]
    fuzzylite(*files, "-dheader", "false", "-dinputs", "false")
    expected = model.predict(rows)
    off = np.abs(np.loadtxt(found, ndmin=2).reshape(len(rows), -1) - expected).max(axis=0)
    # In full scales of each output; 1 of a constant one.
    full_scale = np.where(np.ptp(expected, axis=0) > 0.0, np.ptp(expected, axis=0), 1.0)
    assert (off / full_scale).max() < TOLERANCE.get(name, 1e-10)


def test_we_read_what_fuzzylite_writes(fuzzylite, tmp_path):
    model = MODELS["rule table, order 1, 2 outputs"]
    rows = rows_of(model, 1.0)
    export_fis(model, tmp_path / "ours.fis")
    files = ["-i", tmp_path / "ours.fis", "-o", tmp_path / "theirs.fis"]
    fuzzylite(*files, "-if", "fis", "-of", "fis")
    read = read_fis(tmp_path / "theirs.fis")
    assert_allclose(read.predict(rows), model.predict(rows), rtol=1e-9)
