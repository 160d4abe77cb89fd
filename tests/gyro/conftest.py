"""What a calibration does beside its fits, without the time that these take."""

from functools import partial

import pytest

from skanfis.gyro import _calibration, _results

from ..quick import quick
from .planted import with_few_rivals


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
    with_few_rivals(monkeypatch)


@pytest.fixture
def no_drawing(monkeypatch):
    """Pictures are made but not painted, which takes longer than all else."""
    painter = "matplotlib.backends.backend_agg.FigureCanvasAgg.print_png"
    monkeypatch.setattr(painter, lambda *_, **__: None)


@pytest.fixture
def no_pictures(monkeypatch, no_drawing):
    """The report's words and tables, with few pictures."""
    monkeypatch.setattr(_results, "_PICTURES", {})
