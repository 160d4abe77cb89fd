"""What a calibration does beside its fits, without the time that these take."""

from functools import partial
from itertools import islice

import pytest

from skanfis.gyro import _calibration, _results, _simpler

from ..quick import quick


@pytest.fixture(scope="module")
def given_weights():
    """Rules whose weights are given: where it matters that they are fitted, and not how well."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_calibration, "ANFISRegressor", partial(quick, agreement=1e-8, alpha=1e-9))
        yield


@pytest.fixture(scope="module")
def coarse_report():
    """Pictures of few points, intervals of few resamples: both are looked at elsewhere."""
    every = _results.gyro_report
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("skanfis.gyro._results._DOTS_PER_INCH", 30)
        patch.setattr(_results, "gyro_report", lambda *a, **o: every(*a, **{"n_resamples": 20} | o))
        yield


@pytest.fixture
def say(capsys):
    """What gives words to the command: its exit code, and what it says on both streams."""
    from skanfis.gyro.command import main

    def say(*words):
        try:
            code = main([str(word) for word in words])
        except SystemExit as stopped:
            code = stopped.code
        return code, *capsys.readouterr()

    return say


@pytest.fixture
def few_rivals(monkeypatch):
    """Of what is simpler than rules the simplest alone; test_calibration.py asks for the others."""
    every = _simpler.kinds
    monkeypatch.setattr(_simpler, "kinds", lambda *given: islice(every(*given), 3))
