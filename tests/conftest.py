"""What all tests share, and that they leave nothing behind."""

import gc
import json
import sys
from pathlib import Path

import numpy as np
import pytest

from .leftovers import left_behind, listing

# It is read by mypy, and run by nobody.
collect_ignore = ["typed_user.py"]

ROOT = Path(__file__).resolve().parents[1]
BEFORE = pytest.StashKey()


def pytest_sessionstart(session):
    # The one process that outlasts the others where there are several.
    if not hasattr(session.config, "workerinput"):
        session.config.stash[BEFORE] = listing(ROOT)


@pytest.hookimpl(tryfirst=True)
def pytest_sessionfinish(session):
    before = session.config.stash.get(BEFORE, None)
    if before is not None and (found := left_behind(before, listing(ROOT))):
        session.exitstatus = pytest.ExitCode.TESTS_FAILED
        report = session.config.pluginmanager.get_plugin("terminalreporter")
        if report is not None:
            report.section("the tests changed the folder that they run in", red=True)
            report.write("".join(f"{line}\n" for line in found))


def pytest_collection_finish(session):
    # Libraries and tests stay to the end: to go through them again and again finds nothing to free.
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session")
def fresh_process(tmp_path_factory, request):
    """What ``fresh_process.py`` saw, by the names of its functions; once for all workers."""
    from .fresh_process import in_a_fresh_process

    folder = tmp_path_factory.getbasetemp()
    if hasattr(request.config, "workerinput"):
        folder = folder.parent
    seen = folder / "fresh_process.json"
    if not seen.is_file():
        own = tmp_path_factory.mktemp("fresh")
        (own / "seen").write_text(json.dumps(in_a_fresh_process(own)), encoding="utf-8")
        (own / "seen").replace(seen)
    return json.loads(seen.read_text(encoding="utf-8"))


@pytest.fixture
def rng():
    """A generator with the same seed for every test."""
    return np.random.default_rng(0)


@pytest.fixture(autouse=True)
def _no_open_figures():
    """Close what a test draws; matplotlib is not imported for the sake of it."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")
