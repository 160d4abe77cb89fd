"""The pages on memberships: the code of one runs, and both name every family."""

import doctest
from pathlib import Path

import numpy as np
import pytest

from skanfis.membership import MEMBERSHIPS

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "memberships.rst"
HOW_TO = ROOT / "docs" / "add_a_membership.rst"
if not HOW_TO.is_file():
    pytest.skip("the documentation is not here", allow_module_level=True)


def test_the_class_on_the_page_works():
    with np.printoptions(precision=8):
        failed, tried = doctest.testfile(str(HOW_TO), module_relative=False)
    assert tried > 5
    assert failed == 0


@pytest.mark.parametrize("family", MEMBERSHIPS.values(), ids=list(MEMBERSHIPS))
def test_every_family_is_on_the_page(family):
    text = PAGE.read_text(encoding="utf-8")
    assert f'``"{family.name}"``' in text
    assert all(parameter.name in text for parameter in family.parameters)
