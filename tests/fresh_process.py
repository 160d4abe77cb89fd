"""What can be seen only of a process that has imported nothing yet: one for all tests.

Each such process takes seconds for its imports. Run with a folder, it does everything below in this
order and prints it as JSON; the tests, by the fixture ``fresh_process``, say what it should be.
"""

import contextlib
import io
import json
import os
import runpy
import subprocess
import sys
import traceback
from pathlib import Path


def in_a_fresh_process(folder):
    """Run this file in a process of its own."""
    import skanfis

    # The package under test, whichever is installed.
    package = str(Path(skanfis.__file__).parents[1])
    environment = os.environ | {"MPLBACKEND": "nonsense", "PYTHONPATH": package}
    done = subprocess.run(
        [sys.executable, __file__, str(folder)],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def digests():
    """First thing fitted, in reverse order."""
    sys.path.insert(0, str(Path(__file__).parent))
    import test_reproducibility

    return {
        name: test_reproducibility.digest(name) for name in reversed(test_reproducibility.SETTINGS)
    }


def matplotlib_of_the_command():
    from skanfis.gyro import command  # noqa: F401

    return [name for name in sys.modules if name.startswith("matplotlib")]


def backend_that_does_not_exist():
    """By ``python -m skanfis.gyro``."""
    told, argv = io.StringIO(), sys.argv
    sys.argv = ["skanfis.gyro", "log.csv", "--output", "out"]
    try:
        with contextlib.redirect_stderr(told):
            runpy.run_module("skanfis.gyro", run_name="__main__", alter_sys=True)
    except SystemExit as end:
        status = end.code
    finally:
        sys.argv = argv
    return {"status": status, "told": told.getvalue(), "made": os.listdir()}


def pyplot_of_pictures():
    del os.environ["MPLBACKEND"]
    for half in [name for name in sys.modules if name.startswith("matplotlib")]:
        del sys.modules[half]
    from matplotlib.figure import Figure

    from skanfis.gyro import ErrorDisplay

    ErrorDisplay.from_predictions([0, 1], [0, 1], [0, 1], position=[0, 1], ax=Figure())
    return [name for name in sys.modules if name == "matplotlib.pyplot"]


STEPS = [digests, matplotlib_of_the_command, backend_that_does_not_exist, pyplot_of_pictures]


def outcome(step):
    """What fails is told by the tests that ask for it."""
    try:
        return step()
    except Exception:
        return traceback.format_exc()


if __name__ == "__main__":
    os.chdir(sys.argv[1])
    print(json.dumps({step.__name__: outcome(step) for step in STEPS}))
