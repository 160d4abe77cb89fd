"""The page on files says what is supported."""

from pathlib import Path

import pytest

from skanfis.export.fis.functions import function_of
from skanfis.membership import MEMBERSHIPS

PAGE = Path(__file__).parents[2] / "docs" / "files.rst"
if not PAGE.is_file():
    pytest.skip("the documentation is not here", allow_module_level=True)


@pytest.mark.parametrize("family", MEMBERSHIPS.values(), ids=list(MEMBERSHIPS))
def test_every_family_is_on_the_page_with_its_function(family):
    name, _ = function_of(family, [1.0] * len(family.parameters))
    assert f'``"{family.name}"``\n     - ``{name}``' in PAGE.read_text(encoding="utf-8")
