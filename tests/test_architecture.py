"""Imports point one way: the layers of the package as a table, held against its source."""

import ast
import re
import sys
from pathlib import Path

import pytest

import skanfis

PACKAGE = Path(skanfis.__file__).parent

NUMERIC = ["numpy", "scipy"]
SKLEARN = [*NUMERIC, "sklearn", "joblib", "threadpoolctl"]
PLOTTING = [*NUMERIC, "sklearn", "matplotlib", "pandas"]
FOR_REPORTS_AND_FILES = ["allantools", "h5py", "jinja2", "openpyxl", "pyarrow", "weasyprint"]

# From the bottom to the top: each layer, a module or a subpackage, may import those before it, and
# the packages beside its name. PUBLIC is the package itself, to others the names that it exports.
PUBLIC = "__init__"
LAYERS = {
    "_sklearn": SKLEARN,
    "_threads": SKLEARN,
    "exceptions": [],
    "blocks": NUMERIC,
    "_validation": SKLEARN,
    "digits": NUMERIC,
    "policies": NUMERIC,
    "options": SKLEARN,
    "membership": NUMERIC,
    "antecedent": NUMERIC,
    "reading_cost": [],
    "consequent": NUMERIC,
    "naming": NUMERIC,
    "support": NUMERIC,
    "posterior": NUMERIC,
    "model": NUMERIC,
    "learning": SKLEARN,
    "cluster": SKLEARN,
    "search": SKLEARN,
    "export": [*SKLEARN, "pandas", "onnx", "skl2onnx"],
    "bounds": SKLEARN,
    "inspection": PLOTTING,
    "training": SKLEARN,
    "regressor": SKLEARN,
    PUBLIC: [],
    "intervals": SKLEARN,
    "dask": [*SKLEARN, "pandas", "dask"],
    "datasets": [*SKLEARN, "pandas"],
    "gyro": [*PLOTTING, *FOR_REPORTS_AND_FILES],
}
# The version, which what is exported carries.
ALSO = {"export": [PUBLIC]}
# The application takes public names only, but for these.
ONLY = {
    "gyro": [
        *(PUBLIC, "_threads", "exceptions", "blocks", "digits", "policies", "options", "naming"),
        *("search", "export", "bounds", "inspection", "datasets"),
    ]
}
ONLY_INSIDE_FUNCTIONS = {"dask", "matplotlib", "onnx", "skl2onnx", *FOR_REPORTS_AND_FILES}
DOOR_TO_PRIVATE_SKLEARN = "_sklearn"
# What has an underscore belongs to its layer, but for these modules of the root: they are of all
# layers that the table lets take them, and none of the user's.
SHARED = {
    "_sklearn": "what scikit-learn may move is taken in one place, and handed on to nobody",
    "_validation": "checks and warnings in one voice, by parameters and columns that it knows",
    "_threads": "what is set for the whole process, which works only if all set it alike",
}


def violations(source, module):
    """What ``source``, the module of this dotted name, does against the rules."""
    layer = module.split(".")[1]
    if layer not in LAYERS:
        return [f"{module} is in no layer: give {layer!r} a place among the layers"]
    tree = ast.parse(source)
    lazy = {
        node
        for function in ast.walk(tree)
        if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef)
        for node in ast.walk(function)
        if isinstance(node, ast.Import | ast.ImportFrom)
    }
    found = []
    for node in ast.walk(tree):
        for name in imported_names(node, module):
            found += forbidden_import(name, layer, is_lazy=node in lazy)
        if (
            isinstance(node, ast.Attribute)
            and is_private_sklearn(dotted(node))
            and layer != DOOR_TO_PRIVATE_SKLEARN
        ):
            found.append(f"{dotted(node)} is private")
    return found


def forbidden_import(name, layer, is_lazy):
    """Reasons why ``layer`` may not import ``name``; none is as it should be."""
    names = list(LAYERS)
    layers = ONLY.get(layer) or [*names[: names.index(layer)], *ALSO.get(layer, [])]
    packages = LAYERS[layer]
    top = name.partition(".")[0]
    if top == "skanfis":
        if layer_of(name) not in [layer, *layers]:
            yield f"{name} is not below"
        elif layer_of(name) != layer and is_private_to_its_layer(name):
            yield f"{name} is private to {layer_of(name)}"
    elif top not in sys.stdlib_module_names:
        if top not in packages:
            yield f"{top} is not for this layer"
        if top in ONLY_INSIDE_FUNCTIONS and not is_lazy:
            yield f"{top} outside a function"
    if is_private_sklearn(name) and layer != DOOR_TO_PRIVATE_SKLEARN:
        yield f"{name} is private"


def layer_of(name):
    """The layer that an imported name belongs to: a module, or an object that is exported."""
    _, part, *_ = [*name.split("."), ""]
    is_module = part in LAYERS or (PACKAGE / part / "__init__.py").is_file()
    return part if part and (is_module or (PACKAGE / f"{part}.py").is_file()) else PUBLIC


def is_private_to_its_layer(name):
    """Whether a dotted name of skanfis has an underscore that no other layer may look behind."""
    _, *parts = name.split(".")
    return has_underscore(parts[1:] if parts and parts[0] in SHARED else parts)


def has_underscore(parts):
    return any(part.startswith("_") and not part.endswith("__") for part in parts)


def imported_names(node, module):
    """Full dotted names of what an import statement imports; ``module`` is where it stands."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom):
        origin = [node.module] if node.module else []
        if node.level:
            origin = module.split(".")[: -node.level] + origin
        return [".".join([*origin, alias.name]) for alias in node.names]
    return []


def is_private_sklearn(name):
    """Whether a dotted name reaches behind an underscore of scikit-learn."""
    top, *rest = name.split(".")
    return top == "sklearn" and has_underscore(rest)


def dotted(node):
    """The node as a dotted name; empty if it is none."""
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute):
        owner = dotted(node.value)
        return owner and f"{owner}.{node.attr}"
    return ""


def module_name(path):
    """Dotted name by which relative imports count: a package ends in .__init__."""
    return ".".join(["skanfis", *path.relative_to(PACKAGE).with_suffix("").parts])


SOURCES = {module_name(path): path for path in sorted(PACKAGE.rglob("*.py"))}


@pytest.mark.theory
def test_every_module_keeps_to_its_layer():
    found = [
        f"{module}: {violation}"
        for module, path in SOURCES.items()
        for violation in violations(path.read_text(encoding="utf-8"), module)
    ]
    assert found == []


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("skanfis.exceptions", "from . import model"),
        ("skanfis.learning.objective", "from skanfis.search.grid import grid"),
        ("skanfis.learning.__init__", "from ..search import grid"),
        ("skanfis.model", "import pandas"),
        ("skanfis.model", "def f():\n    from sklearn.base import clone"),
        ("skanfis.regressor", "from sklearn.utils._param_validation import Interval"),
        ("skanfis.regressor", "import sklearn\nsklearn.utils._safe_indexing"),
        ("skanfis.gyro.report", "from skanfis.model import TSKModel"),
        ("skanfis.gyro.report", "import matplotlib.pyplot as plt"),
        ("skanfis.gyro.report", "from ..export._numbers import Numbers"),
        ("skanfis.gyro.report", "from .._validation import check_finite"),
        ("skanfis.intervals.conformal", "from .._validation import _columns"),
        ("skanfis.somewhere", ""),
        ("skanfis.regressor", "import somewhere"),
    ],
)
def test_checker_finds(module, source):
    assert len(violations(source, module)) == 1


def test_every_module_stands_on_the_page_of_layers_by_the_first_line_of_its_docstring():
    page = Path(__file__).parents[1] / "docs" / "layers.rst"
    if not page.is_file():
        pytest.skip("the documentation is not here")
    text = page.read_text(encoding="utf-8")
    found = re.findall(r"^\* ``(skanfis\.[\w.]+)``: (.*(?:\n  .*)*)", text, re.MULTILINE)
    doors = {"skanfis.__init__", *(f"skanfis.{layer}.__init__" for layer in LAYERS)}
    doors |= {"skanfis.gyro.__main__"}
    docstrings = {
        name.removesuffix(".__init__"): ast.get_docstring(ast.parse(path.read_text("utf-8")))
        for name, path in SOURCES.items()
        if name not in doors
    }
    expected = {name: told.splitlines()[0] for name, told in docstrings.items()}
    assert {name: " ".join(line.split()) for name, line in found} == expected
