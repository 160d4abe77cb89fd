"""Files that a test leaves in the folder of the tests make the whole run fail."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
SUITE = """
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_that_passes():
    {action}
"""
CHANGES = '(ROOT / "README.md").rename(ROOT / "never.json")'
BUILDS = '(ROOT / "dist").mkdir()'


@pytest.mark.theory
@pytest.mark.parametrize(
    ("action", "told"),
    [(CHANGES, ["left behind: never.json", "gone: README.md"]), (BUILDS, [])],
    ids=["changes", "builds"],
)
def test_a_test_that_changes_the_folder_fails_the_run(action, told, tmp_path):
    (tmp_path / "tests").mkdir()
    for name in ("conftest.py", "leftovers.py"):
        shutil.copy(HERE / name, tmp_path / "tests")
    (tmp_path / "README.md").write_text("")
    (tmp_path / "pytest.ini").write_text("[pytest]\naddopts = --import-mode=importlib\n")
    (tmp_path / "tests" / "test_one.py").write_text(SUITE.format(action=action))
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "tests"]
    bare = os.environ | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    caught = {"capture_output": True, "text": True, "check": False}
    done = subprocess.run(command, cwd=tmp_path, env=bare, **caught)
    assert "1 passed" in done.stdout
    assert done.returncode == bool(told), done.stdout
    assert all(line in done.stdout for line in told)
