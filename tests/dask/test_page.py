"""The page on large data: its code runs."""

import doctest
from pathlib import Path

import pytest

pytest.importorskip("dask")

PAGE = Path(__file__).parents[2] / "docs" / "large_data.rst"
if not PAGE.is_file():
    pytest.skip("the documentation is not here", allow_module_level=True)

pytestmark = pytest.mark.page


def test_the_code_on_the_page_works():
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    failed, tried = doctest.testfile(str(PAGE), module_relative=False, optionflags=flags)
    assert tried > 5
    assert failed == 0
