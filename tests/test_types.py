"""``py.typed`` promises types: public signatures carry them."""

import inspect

import skanfis

from .test_public_api import public_names, resolve

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


def test_what_is_public_says_what_it_returns():
    functions = [function for named in PUBLIC for function in functions_of(named)]
    assert len(functions) > 100
    assert [f.__qualname__ for f in functions if "return" not in f.__annotations__] == []


def test_what_is_public_says_what_it_takes():
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
