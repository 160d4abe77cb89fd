"""What a structure is called in reports."""

import pytest

from skanfis.membership import Bell
from skanfis.search.candidate import Candidate


@pytest.mark.parametrize(
    ("candidate", "words"),
    [
        (Candidate((1, 3)), "grid [1, 3]"),
        (Candidate((1, 3), family=Bell), "grid [1, 3], bell"),
        (Candidate(None, 5, "k-means"), "5 scattered rules"),
        (Candidate(None, 3, "fcm", family=Bell), "3 fuzzy clusters, bell"),
        (Candidate(None, 0.5, "subtractive"), "clusters of radius 0.5"),
    ],
)
def test_in_words(candidate, words):
    assert candidate.describe() == words
