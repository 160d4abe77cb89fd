"""The page on what to believe of a rule: its limits are those of the package."""

import re
from pathlib import Path

import pytest

from skanfis.inspection import Readability

PAGE = Path(__file__).parents[1] / "docs" / "reading_rules.rst"
if not PAGE.is_file():
    pytest.skip("the documentation is not here", allow_module_level=True)


def test_the_limits_on_the_page_are_those_of_the_package():
    table = PAGE.read_text(encoding="utf-8").partition("list-table")[2]
    limits = Readability.limits
    for measure, limit in (
        ("greatest truth of a term", f"{limits['least_truth']} or more"),
        ("crossing of neighbours", f"{limits['greatest_crossing']} or less"),
        ("strongest rule alone", f"{limits['strongest_alone']} standard deviations"),
    ):
        assert re.search(rf"\* - {measure}\n     - {re.escape(limit)}\n", table)
