"""Every public name has a full docstring with an example, types, and a place in the docs."""

import inspect
import re
from importlib import import_module
from pathlib import Path

import pytest

import skanfis

PARTS = ["bounds", "cluster", "dask", "datasets", "export", "gyro", "inspection", "intervals"]
PUBLIC_MODULES = ["skanfis", *(f"skanfis.{part}" for part in [*PARTS, "options", "learning"])]
API_PAGE = Path(__file__).parents[1] / "docs" / "api.rst"


def exports(module):
    return import_module(module).__all__


def public_names():
    """Dotted names of the classes and functions that the public modules export."""
    exported = [f"{module}.{name}" for module in PUBLIC_MODULES for name in exports(module)]
    return [name for name in exported if callable(resolve(name))]


def resolve(dotted_name):
    module, _, name = dotted_name.rpartition(".")
    return getattr(import_module(module), name)


def is_of_another(public):
    """Whether a class takes the parameters of a public class, whose docstring has them."""
    bases = [base for base in getattr(public, "__mro__", [])[1:] if hasattr(skanfis, base.__name__)]
    return any(base.__init__ is public.__init__ for base in bases)


def sections(docstring):
    """Sections of a numpydoc docstring by title; the text before the first is the summary."""
    parts = re.split(r"^(\S.*)\n-{3,}$", inspect.cleandoc(docstring or ""), flags=re.MULTILINE)
    return {"Summary": parts[0], **dict(zip(parts[1::2], parts[2::2], strict=True))}


def described(section):
    """Names described in a section, which stand at the start of a line: ``a, b : float``."""
    heads = [line.partition(":")[0] for line in section.splitlines() if re.match(r"[\w*]", line)]
    return [name.strip(" *") for head in heads for name in head.split(",")]


def listed_on_api_page():
    """Dotted names in the autosummary tables of the API page."""
    module, listed = "", []
    for line in API_PAGE.read_text(encoding="utf-8").splitlines():
        if match := re.match(r"\.\. currentmodule:: (\S+)", line):
            module = match[1]
        elif match := re.fullmatch(r" +(\w+)", line):
            listed.append(f"{module}.{match[1]}")
    return listed


@pytest.mark.parametrize("name", public_names())
def test_docstring_is_complete_and_methods_tell_the_parameters_that_they_have(name):
    public = resolve(name)
    found = sections(public.__doc__)
    assert re.match(r"\S.*\.$", found["Summary"].split("\n\n")[0], flags=re.DOTALL)
    if not is_of_another(public):
        assert described(found.get("Parameters", "")) == list(inspect.signature(public).parameters)
    if not inspect.isclass(public) and inspect.signature(public).return_annotation is not None:
        assert "Returns" in found
    assert ">>> " in found["Examples"]
    for method, function in inspect.getmembers(public, inspect.isfunction):
        found = sections(function.__doc__)
        if function.__module__.startswith("skanfis") and "Parameters" in found:
            own = list(inspect.signature(function).parameters)[1:]
            assert described(found["Parameters"]) == own, method


def test_api_page_lists_every_public_name():
    assert set(public_names()) <= set(listed_on_api_page())


def test_what_the_api_page_lists_exists():
    named = [name.rpartition(".") for name in listed_on_api_page()]
    assert named
    assert [(module, name) for module, _, name in named if name not in exports(module)] == []


# ``py.typed`` promises types: public signatures carry them.
PUBLIC = [resolve(name) for name in public_names()]


def own_functions(named):
    """The constructor, public methods and properties that the package defines for a class."""
    for owner in named.__mro__:
        if not owner.__module__.startswith("skanfis."):
            continue
        for name, found in vars(owner).items():
            function = found.fget if isinstance(found, property) else found
            function = getattr(function, "__func__", function)
            if inspect.isfunction(function) and (name == "__init__" or not name.startswith("_")):
                yield function


def functions_of(named):
    return list(own_functions(named)) if inspect.isclass(named) else [named]


def test_what_is_public_says_what_it_takes_and_returns():
    functions = [function for named in PUBLIC for function in functions_of(named)]
    assert len(functions) > 100
    # help() and notebooks show them.
    assert [f.__qualname__ for f in functions if "_typing" in str(inspect.signature(f))] == []
    assert [f.__qualname__ for f in functions if "return" not in f.__annotations__] == []
    # The method solve() of a solver takes what training gives it, and is none of the user's.
    untyped = [
        f"{function.__qualname__}: {name}"
        for named in PUBLIC
        if not named.__module__.startswith("skanfis.learning")
        for function in map(inspect.unwrap, functions_of(named))
        for name, parameter in inspect.signature(function).parameters.items()
        if parameter.annotation is parameter.empty and name not in ("self", "cls")
    ]
    assert untyped == []


def test_the_estimator_has_no_more_parameters_than_a_person_reads():
    assert len(inspect.signature(skanfis.ANFISRegressor).parameters) <= 20
