"""From a log to a verdict: planted truths, held out by hand, and structures chosen within folds."""

import re

import numpy as np
import pandas as pd
import pytest

from skanfis.digits import counted
from skanfis.gyro import _calibration
from skanfis.gyro._calibration import Recipe, fit_model
from skanfis.gyro._headline import errors_and_verdict, formula_of, headline
from skanfis.gyro._oddities import delay, oddities, whole_delay
from skanfis.gyro.compose import rules_of
from skanfis.gyro.metrics import rms

from .planted import NOISE, calibrated, evaluated, log_of

pytestmark = pytest.mark.theory


def constant(temperature, rate):
    return 0.005 + 0.0 * temperature


def law(temperature, rate):
    """Of an open loop: its error against the tangent is that of a sine."""
    phase = 0.008 * (1 - 4e-4 * (temperature - 25.0)) * (rate + 0.01)
    return np.sin(phase) / 0.008 - rate


PLANTED = {
    "constant": (constant, (2, 2)),
    "straight line": (lambda t, r: 0.005 + 2e-4 * t + 1e-5 * r, (2, 2)),
    "arcsine law": (law, (2, 3)),
    "cubic polynomial": (lambda t, r: 2e-9 * (t - 25.0) * r**2 * 1e2, (1, 1)),
    "this model": (lambda t, r: 0.01 / (1.0 + np.exp(-(t - 25.0))), (3, 1)),
}


@pytest.mark.parametrize("truth", PLANTED)
def test_the_planted_truth_is_recommended(truth):
    error, terms = PLANTED[truth]
    calibration = calibrated(log_of(error, n_rows=40), terms=terms)
    verdict = calibration.verdict
    assert verdict.recommended == truth, verdict
    title, sentence = headline(calibration, "deg/s")
    assert sentence.endswith("--physics.") == (truth == "arcsine law")
    if truth == "this model":
        assert title == "The fuzzy rules are worth it"
        return
    assert title.startswith("Use ")
    assert title.endswith(f"{truth} instead of the fuzzy rules")
    assert "more than the scatter over the 8 held-out runs" in sentence


BOTH, INPUTS = "arcsine law and a line", ("time", "temperature", "output")
SLOWLY = {"n_folds": 4, "terms": (1, 1, 1)}


@pytest.fixture(scope="module")
def law_and_line():
    """What follows the arcsine law, and goes up with the time since power-on."""
    log = log_of(law)
    log["time"] = 60.0 * log.groupby("run").cumcount()
    log["output"] += 2e-6 * log["time"]
    return calibrated(log, INPUTS, **SLOWLY)


@pytest.mark.floors
def test_the_law_and_a_line_in_what_the_law_does_not_know_is_recommended(law_and_line, few_rivals):
    verdict = law_and_line.verdict
    assert verdict.recommended == BOTH, verdict
    # Law and line are fitted in turns: what is left is a little more than the noise.
    assert verdict.rms[BOTH] < 0.5 * verdict.rms["arcsine law"]
    assert verdict.rms[BOTH] < 3.0 * NOISE
    # The single rule of --physics --terms 1,1,1 is that line.
    alone = calibrated(law_and_line.log, INPUTS, physics=True, **SLOWLY).verdict
    assert alone.rms["this model"] == pytest.approx(verdict.rms[BOTH], rel=0.01)


@pytest.mark.floors
@pytest.mark.parametrize("name", ["constant", "straight line", "cubic polynomial", BOTH])
def test_the_formula_of_what_is_simpler_can_be_computed(law_and_line, name):
    formula, columns = formula_of(law_and_line, name), law_and_line.X.to_dict("series")
    estimator = next(each for each in law_and_line.simpler if each.name == name).estimator
    if name == BOTH:
        law_text, line = formula.split("added the line:\n")
        assert law_text.startswith("rate [deg/s] = arcsin(")
        found = evaluated(line, columns)["line"]
        expected = estimator.residual_.predict(law_and_line.X)
    else:
        rate, _, error = formula.partition("\n")
        found = evaluated(f"{error}\n{rate}", columns)["rate"]
        expected = law_and_line.before - estimator.predict(law_and_line.X)
    np.testing.assert_allclose(found, expected, atol=1e-8)


def test_what_answers_fewer_rows_than_the_rules_is_missing_and_says_why():
    """The law has no value by the policy "nan" where the output is beyond its sine."""
    log = log_of(constant, n_rows=40)
    log["rate"] *= 2.5
    log["output"] = log["rate"] + law(log["temperature"], log["rate"])
    found = calibrated(log, outside="nan", terms=(2, 3))
    missing = {one.name: one.missing for one in found.simpler}
    assert re.fullmatch(r"it has no finite prediction for \d+ rows", missing["arcsine law"])
    assert "arcsine law" not in found.verdict.rms
    assert np.isfinite(list(found.verdict.rms.values())).all()


@pytest.mark.usefixtures("few_rivals")
def test_where_nothing_is_surely_better_something_may_still_have_left_less():
    """A constant is of use in three runs of eight, and does harm in the others."""
    log = log_of(lambda t, r: 0.01 * np.repeat([1.0, 0.0], [180, 300]))
    calibration = calibrated(log, ("temperature",), n_folds=8, terms=(1,))
    verdict = calibration.verdict
    assert verdict.recommended == "no compensation"
    assert min(verdict.rms.values()) < verdict.rms["no compensation"]
    title, _ = headline(calibration, "deg/s")
    assert title == "Leave the gyro as it is: none that was tried is better beyond chance"


@pytest.mark.usefixtures("few_rivals")
def test_before_after_and_what_is_simpler_are_of_the_same_rows():
    log = log_of(constant)
    # A run at a temperature of its own is out of range, and 30 times worse.
    hot = log["run"] == 3
    log.loc[hot, "temperature"] += 200.0
    log.loc[hot, "output"] += 0.15
    calibration = calibrated(log, terms=(1, 1))
    rows = calibration.inside
    assert not rows[hot].any()
    before = (log["output"] - log["rate"]).to_numpy()
    verdict = calibration.verdict
    assert verdict.rms["no compensation"] == pytest.approx(rms(before[rows]))
    # The constant of every fold by hand.
    left = before.copy()
    for train, test in calibration.split.folds:
        left[test] -= before[train].mean()
    assert verdict.rms["constant"] == pytest.approx(rms(left[rows]))
    shown, left, *_ = errors_and_verdict(calibration)
    error = np.abs(calibration.after - calibration.rate)[calibration.inside]
    row = np.flatnonzero(calibration.inside)[error.argmax()]
    told = f"half of them within {np.median(error):.4g}, peak {error.max():.4g} (row {row})"
    assert left.endswith(told)
    errors = [f"{verdict.rms[name]:.4g}" for name in ("no compensation", "constant")]
    assert f"{errors[0]} deg/s RMS, {errors[1]} once a constant (the output at rest)" in shown
    assert f"is taken off, on {rows.sum():,} held-out rows in range" in shown


@pytest.mark.usefixtures("few_rivals")
def test_what_a_fold_holds_out_has_no_say_in_its_model(monkeypatch):
    log, seen = log_of(constant), []

    def spy(X, target, groups, recipe):
        seen.append(X.index.to_numpy())
        return fit_model(X, target, groups, recipe)

    monkeypatch.setattr(_calibration, "fit_model", spy)
    folds = calibrated(log, ("temperature",), terms=(1,)).split.folds
    for rows, (train, _) in zip(seen[:-1], folds, strict=True):
        np.testing.assert_array_equal(rows, train)
    np.testing.assert_array_equal(seen[-1], log.index)


@pytest.mark.floors
def test_rules_are_for_what_the_law_leaves():
    log = log_of(law)
    X, rate = log[["temperature", "output"]], log["rate"].to_numpy()
    groups = log["run"].astype(str).to_numpy()
    recipe = Recipe(tuple(X), physics=True)
    assert rules_of(fit_model(X, rate, groups, recipe))[-1].n_rules_ == 1
    # An amplitude that is curved in temperature.
    curved = X.assign(output=X["output"] * (1 - 2e-5 * (X["temperature"] - 25.0) ** 2))
    assert rules_of(fit_model(curved, rate, groups, recipe))[-1].n_rules_ == 1


def in_steps(n_runs=4, n_levels=15, n_rows=8):
    """Rates of runs that step from level to level."""
    rate = np.random.default_rng(0).uniform(-50.0, 50.0, n_runs * n_levels).repeat(n_rows)
    return pd.DataFrame({"run": np.arange(n_runs).repeat(n_levels * n_rows), "rate": rate})


def delayed(log, rows):
    """The rates ``rows`` rows before, those at the ends of a run held."""
    place = np.arange(len(log) // log["run"].nunique())
    parts = (np.interp(place - rows, place, own) for _, own in log.groupby("run")["rate"])
    return np.concatenate(list(parts))


@pytest.mark.parametrize("rows", [1.0, -1.0, 0.25, 4.0, -2.5])
def test_a_delay_is_told_from_noise_of_the_rate(rng, rows):
    log = in_steps()
    noise = 0.01 * rng.normal(size=(2, len(log)))
    found, part = delay(log, delayed(log, rows) - log["rate"].to_numpy() + noise[0])
    assert found == pytest.approx(rows, abs=1e-3)
    assert part > 0.99
    known = log.assign(rate=log["rate"] + 0.1 * noise[1])
    assert delay(known, -0.1 * noise[1])[1] < 0.05
    # Nor is it what has no slope, no noise, few rows, or an offset of each run.
    assert delay(log.assign(rate=3.0), noise[0]) == delay(log, 0.0 * noise[0]) == (0.0, 0.0)
    few = [delay(in_steps(2, 2, 6), rng.normal(size=24))[1] for _ in range(100)]
    assert np.mean(few) < 0.02
    ramp = log.assign(rate=np.arange(len(log), dtype=float))
    assert delay(ramp, 1.0 + log["run"].to_numpy() + noise[0])[1] < 0.05


def test_a_delay_by_whole_rows_needs_enough_rows_that_agree():
    rate = pd.Series(np.repeat([0.0, 10.0, -10.0], 20))
    assert [whole_delay(rate.shift(rows), rate) for rows in (3, 0, -2)] == [3, 0, -2]
    # One row at the end like one at the start: all agree, but they are few.
    first, last = np.eye(60)[[0, -1]]
    assert whole_delay(last, first) == whole_delay(np.ones(60), rate) == 0


def test_runs_alike_are_no_delay_of_one_by_the_other(rng):
    rate = np.tile(np.repeat([0.0, 50.0, -50.0, 100.0, -100.0, 0.0], 10), 6)
    log = pd.DataFrame({"rate": rate, "run": np.arange(6).repeat(60)})
    log["rate"] *= 1.0 + 0.02 * rng.uniform(size=6).repeat(60)
    left = 0.01 * rng.normal(size=360)
    left[:60] = left[-60:] = np.nan  # the coldest and the hottest run are out of range
    assert abs(whole_delay(left + log["rate"], log["rate"])) == 60
    assert delay(log, left) == (0.0, 0.0)


def test_no_delay_is_longer_than_the_log(rng):
    rate = 50.0 + 1e-9 * rng.normal(size=60)  # one rate of a table, and rounding
    assert delay(pd.DataFrame({"rate": rate}), -1e9 * np.gradient(rate)) == (0.0, 0.0)


def test_a_long_delay_is_told_in_whole_rows(rng):
    log = in_steps(1, 200).assign(temperature=np.linspace(0.0, 50.0, 1600))
    error = delayed(log, 123.0) - log["rate"].to_numpy() + NOISE * rng.normal(size=1600)
    late, *_ = oddities(log.assign(output=log["rate"] + error), error, error, "row {}".format)
    assert "came some 120 rows late: align" in late


def test_of_a_delay_one_thing_is_told_and_a_glitch_beside_it(rng):
    log = in_steps(n_rows=20).assign(temperature=lambda log: np.linspace(0.0, 50.0, len(log)))
    for rows in (1.0, 0.5, -3.0):
        error = delayed(log, rows) - log["rate"].to_numpy() + NOISE * rng.normal(size=len(log))
        error[230] += 300.0
        found = oddities(log.assign(output=log["rate"] + error), error, error, "row {}".format)
        late, *told = found
        when = f"{counted(f'{abs(rows):g}', 'row')} {'late' if rows > 0 else 'early'}"
        assert f"as if the output came some {when}: align" in late
        assert [text.partition(":")[0] for text in told] == ["row 230"]


def test_a_delay_is_a_caution(rng):
    log = in_steps().assign(temperature=lambda log: rng.uniform(0.0, 50.0, len(log)))
    told = [
        calibrated(log.assign(output=delayed(log, rows) + NOISE * rng.normal(size=len(log))))
        for rows in (0.0, 0.02)
    ]
    sound, late = (calibration.cautions() for calibration in told)
    assert sound == []
    (sentence,) = (sentence for sentence in late if "from row to row" in sentence)
    assert sentence.endswith(
        "% of the squared error that is left follows the change of the rate from row to row, as if "
        "the output came some 0.02 rows late: align the two columns, or drop the rows while the "
        "rate changes."
    ), sentence
