"""The page on files: its code runs, and it says what is supported."""

import doctest
from pathlib import Path

import pytest

from skanfis.export.fis.functions import function_of
from skanfis.membership import MEMBERSHIPS

PAGE = Path(__file__).parents[2] / "docs" / "files.rst"
if not PAGE.is_file():
    pytest.skip("the documentation is not here", allow_module_level=True)


def test_the_code_on_the_page_works(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    failed, tried = doctest.testfile(str(PAGE), module_relative=False)
    assert tried > 5
    assert failed == 0


@pytest.mark.parametrize("family", MEMBERSHIPS.values(), ids=list(MEMBERSHIPS))
def test_every_family_is_on_the_page_with_its_function(family):
    name, _ = function_of(family, [1.0] * len(family.parameters))
    assert f'``"{family.name}"``\n     - ``{name}``' in PAGE.read_text(encoding="utf-8")
