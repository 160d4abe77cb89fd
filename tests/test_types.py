"""``py.typed`` promises types: public signatures carry them."""

import inspect
from importlib import import_module

import pytest

import skanfis

MODULES = ["cluster", "datasets", "export", "inspection", "options", "solvers"]


def public():
    for module in MODULES:
        exported = import_module(f"skanfis.{module}")
        for name in exported.__all__:
            if callable(getattr(exported, name)):
                yield pytest.param(getattr(exported, name), id=f"{module}.{name}")


@pytest.mark.parametrize("named", list(public()))
def test_what_is_public_says_what_it_returns(named):
    if inspect.isclass(named):
        if "__init__" in vars(named):
            assert named.__init__.__annotations__
    else:
        assert "return" in named.__annotations__


def test_every_parameter_of_the_estimator_has_a_type():
    parameters = inspect.signature(skanfis.ANFISRegressor).parameters
    assert len(parameters) <= 20
    assert all(p.annotation is not inspect.Parameter.empty for p in parameters.values())
