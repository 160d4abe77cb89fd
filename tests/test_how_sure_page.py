"""The page on how sure: its code runs."""

import doctest
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[1] / "docs" / "how_sure.rst"
if not PAGE.is_file():
    pytest.skip("the documentation is not here", allow_module_level=True)


def test_the_code_on_the_page_works():
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    failed, tried = doctest.testfile(str(PAGE), module_relative=False, optionflags=flags)
    assert tried > 15
    assert failed == 0
