"""The page on training: its code runs."""

import doctest
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[1] / "docs" / "training.rst"
if not PAGE.is_file():
    pytest.skip("the documentation is not here", allow_module_level=True)


def test_the_code_on_the_page_works():
    failed, tried = doctest.testfile(str(PAGE), module_relative=False)
    assert tried > 20
    assert failed == 0
