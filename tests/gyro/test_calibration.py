"""From a log to a verdict: planted truths, held out by hand, and structures chosen within folds."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from sklearn.model_selection import GroupKFold

from skanfis.gyro._calibration import Recipe, calibrate
from skanfis.gyro._choice import choose, choose_in_folds
from skanfis.gyro._formulas import formula_of
from skanfis.gyro._headline import errors_and_verdict, headline
from skanfis.gyro._split import Split

pytestmark = pytest.mark.theory

N_RUNS, N_ROWS = 8, 60
NOISE = 2e-4


def log_of(error, seed=0):
    """Runs at temperatures and rates that overlap, with a planted error of both [deg/s]."""
    rng = np.random.default_rng(seed)
    run = np.repeat(np.arange(N_RUNS), N_ROWS)
    temperature = rng.uniform(0.0, 50.0, run.size)
    rate = rng.uniform(-100.0, 100.0, run.size)
    output = rate + error(temperature, rate) + NOISE * rng.normal(size=run.size)
    columns = {"run": run, "temperature": temperature, "rate": rate, "output": output}
    return pd.DataFrame(columns)


def folds_of(log, n_folds=3):
    return list(GroupKFold(n_folds).split(log, groups=log["run"]))


def calibrated(log, **options):
    labels = log["run"].astype(str).to_numpy(dtype=object)
    split = Split("run", folds_of(log), labels, "runs held out")
    recipe = Recipe(("temperature", "output"), **options)
    return calibrate(log, split, recipe, lambda text: None)


def law(temperature, rate):
    """Of an open loop: its error against the tangent is that of a sine."""
    phase = 0.008 * (1 - 4e-4 * (temperature - 25.0)) * (rate + 0.01)
    return np.sin(phase) / 0.008 - rate


PLANTED = {
    "constant": (lambda t, r: 0.005 + 0.0 * t, (2, 2)),
    "straight line": (lambda t, r: 0.005 + 2e-4 * t + 1e-5 * r, (2, 2)),
    "arcsine law": (law, (2, 3)),
    "cubic polynomial": (lambda t, r: 2e-9 * (t - 25.0) * r**2 * 1e2, (1, 1)),
    "this model": (lambda t, r: 0.01 / (1.0 + np.exp(-(t - 25.0))), (3, 1)),
}


@pytest.mark.parametrize("truth", PLANTED)
def test_the_planted_truth_is_recommended(truth, request):
    error, terms = PLANTED[truth]
    if truth != "arcsine law":
        # Of a law that is not the truth any degree will do.
        request.getfixturevalue("law_of_degree_one")
    calibration = calibrated(log_of(error), terms=terms)
    verdict = calibration.verdict
    assert verdict.recommended == truth, verdict
    title, sentence = headline(calibration, "deg/s")
    said = " ".join(errors_and_verdict(calibration))
    assert title in said
    if truth == "this model":
        assert title == "The fuzzy rules are worth it"
        return
    assert title.startswith("Use ")
    assert title.endswith(f"{truth} instead of the fuzzy rules")
    assert f"more than the scatter over the {N_RUNS} held-out runs" in sentence


@pytest.mark.floors
def test_the_law_and_a_line_in_what_the_law_does_not_know_is_recommended():
    log = log_of(law)
    log["time"] = np.tile(np.arange(N_ROWS) * 60.0, N_RUNS)
    log["output"] += 2e-6 * log["time"]
    labels = log["run"].astype(str).to_numpy(dtype=object)
    split = Split("run", folds_of(log, 4), labels, "held out")
    recipe = Recipe(("time", "temperature", "output"), terms=(1, 1, 1))
    calibration = calibrate(log, split, recipe, lambda text: None)
    verdict = calibration.verdict
    assert verdict.recommended == "arcsine law and a line", verdict
    # Law and line are fitted in turns: what is left is a little more than the noise.
    assert verdict.rms["arcsine law and a line"] < 0.5 * verdict.rms["arcsine law"]
    assert verdict.rms["arcsine law and a line"] < 3.0 * NOISE
    # The single rule of --physics --terms 1,1,1 is that line.
    alone = calibrate(log, split, replace(recipe, physics=True), lambda text: None)
    assert alone.verdict.rms["this model"] == pytest.approx(
        verdict.rms["arcsine law and a line"], rel=0.01
    )
    law_text, line = formula_of(calibration, "arcsine law and a line").split("added the line:\n")
    assert law_text.startswith("rate [deg/s] = arcsin(")
    names = calibration.X.to_dict("series")
    for step in line.replace("\n    ", " ").replace("^", "**").split("\n"):
        variable, _, value = step.partition(" = ")
        names[variable] = eval(value, {}, names)
    simple = next(each for each in calibration.simpler if each.name == "arcsine law and a line")
    added = simple.model.predict(calibration.X) - simple.model.base_.predict(calibration.X)
    np.testing.assert_allclose(names["line"], added, atol=1e-8)


@pytest.mark.usefixtures("few_rivals")
def test_before_after_and_what_is_simpler_are_of_the_same_rows():
    log = log_of(PLANTED["constant"][0])
    # A run at a temperature of its own is out of range, and 30 times worse.
    hot = log["run"] == 3
    log.loc[hot, "temperature"] += 200.0
    log.loc[hot, "output"] += 0.15
    calibration = calibrated(log, terms=(1, 1))
    rows = calibration.inside
    assert not rows[hot].any()
    before = (log["output"] - log["rate"]).to_numpy()
    verdict = calibration.verdict
    assert verdict.rms["no compensation"] == pytest.approx(np.sqrt(np.mean(before[rows] ** 2)))
    # The constant of every fold by hand.
    left = before.copy()
    for train, test in folds_of(log):
        left[test] -= before[train].mean()
    assert verdict.rms["constant"] == pytest.approx(np.sqrt(np.mean(left[rows] ** 2)))
    shown = errors_and_verdict(calibration)[0]
    assert f"{verdict.rms['no compensation']:.4g} deg/s RMS, on {rows.sum():,} held" in shown


@pytest.mark.floors
def test_a_gyro_at_rest_has_no_law():
    log = log_of(PLANTED["constant"][0]).assign(rate=0.0)
    log["output"] = 0.01 + 1e-4 * log["temperature"]
    calibration = calibrated(log, terms=(1, 1))
    found = {simple.name: simple for simple in calibration.simpler}
    assert "never changes" in found["arcsine law"].missing
    assert "arcsine law" not in calibration.verdict.rms


def test_what_a_fold_holds_out_has_no_say_in_its_structure():
    """Whatever is done to the rows that a fold holds out, its structure stays the same."""
    log = log_of(PLANTED["this model"][0])
    X, y = log[["temperature"]], (log["output"] - log["rate"]).to_numpy()
    recipe = Recipe(("temperature",), max_rules=2)
    folds = folds_of(log, 3)
    found = choose_in_folds(X, y, folds, recipe, lambda text: None)
    assert max(choice.terms for choice in found) > (1,)
    _, test = folds[1]
    spoilt = y.copy()
    spoilt[test] += 0.5 * np.sign(np.sin(log["temperature"].to_numpy()[test]))
    again = choose_in_folds(X, spoilt, folds, recipe, lambda text: None)
    assert again[1].terms == found[1].terms
    assert dict(again[1].tried) == pytest.approx(dict(found[1].tried), rel=1e-9)
    assert dict(again[0].tried) != pytest.approx(dict(found[0].tried), rel=1e-3)
    assert choose_in_folds(X, y, folds, Recipe(("temperature",), terms=(2,)), print) is None


def test_folds_without_a_row_in_range_do_not_choose_a_structure():
    """Beside the run in the middle lie the coldest and the hottest: they hold out none in range."""
    rng = np.random.default_rng(0)
    middle = [20.0, 0.0, 25.0, 50.0, 30.0]
    temperature = np.concatenate([center + rng.uniform(-12.0, 12.0, 120) for center in middle])
    run = np.repeat(np.arange(5), 120)
    X = pd.DataFrame({"temperature": temperature})
    y = 0.3 * np.abs(temperature - 25.0) + 0.01 * rng.normal(size=run.size)
    folds = [(np.flatnonzero(run != k), np.flatnonzero(run == k)) for k in (0, 1, 2, 4, 3)]
    recipe = Recipe(("temperature",), max_rules=4)
    found = choose_in_folds(X, y, folds, recipe, lambda text: None)
    assert all(choice.terms > (1,) for choice in found)
    assert all(np.isfinite(rms) for choice in found for _, rms in choice.tried)
    # Of two runs apart, each is outside of the other: there is nothing to compare.
    three = run < 3
    apart = pd.DataFrame({"temperature": (temperature + 1e3 * run)[three]})
    folds = folds_of(pd.DataFrame({"run": run[three]}), 3)
    found = choose_in_folds(apart, y[three], folds, recipe, lambda text: None)
    assert [choice.structure for choice in found] == [(1, None)] * 3


@pytest.mark.floors
def test_terms_are_for_what_the_law_leaves():
    log, told = log_of(law), []
    X, rate = log[["temperature", "output"]], log["rate"].to_numpy()
    recipe = Recipe(tuple(X), physics=True)
    choice = choose(X, rate, folds_of(log), recipe, np.random.default_rng(0), told.append)
    assert choice.structure == (1, (1, 1))
    # That is the noise of the output, over the slope of a sine up to 0.8 rad.
    error = dict(choice.tried)[1, 1]
    assert error == pytest.approx(NOISE * np.sqrt(np.tan(0.8) / 0.8), rel=0.06)
    assert f"terms 1,1: held-out RMS {error:.4g} deg/s" in told
