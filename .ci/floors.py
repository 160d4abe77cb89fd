"""Print pip constraints that hold every dependency in pyproject.toml at its floor.

Run it with the Python that the pins are for: its version has a floor too.
"""

import re
import sys
import tomllib
from pathlib import Path

# Those that the package itself can use.
EXTRAS = ("plot", "allan", "onnx", "dask")
PYPROJECT = Path(__file__).resolve().parents[1] / "pyproject.toml"


def floor(requirement):
    """Name and version of "name>=version", the one form that dependencies are written in."""
    match = re.fullmatch(r"([\w.-]+)\s*>=\s*([\w.]+)", requirement)
    if match is None:
        sys.exit(f"{PYPROJECT.name}: {requirement!r} has no floor of the form name>=version")
    return match.groups()


def main():
    whole = tomllib.loads(PYPROJECT.read_text(encoding="utf-8"))
    project = whole["project"]
    # Data frames come in too: the oldest scikit-learn knows nothing of the newest polars.
    frames = [r for r in whole["dependency-groups"]["test"] if r.startswith("polars")]
    (_, python_floor) = floor("python" + project["requires-python"])
    running = ".".join(map(str, sys.version_info[:2]))
    if running != python_floor:
        sys.exit(f"the floors are tested on Python {python_floor}, this is {running}")
    extras = [r for name in EXTRAS for r in project["optional-dependencies"][name]]
    for requirement in project["dependencies"] + extras + frames:
        print("==".join(floor(requirement)))


if __name__ == "__main__":
    main()
