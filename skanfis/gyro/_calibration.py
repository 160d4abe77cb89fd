"""Calibration: fit a compensator to a checked log, predict held-out rows, give a verdict.

docs/gyro_command.rst says what is recommended. Gains are geometric means over groups: a mean of
squares would be decided by the one group with the largest errors.
"""

import warnings
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import t as student
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from .. import ANFISRegressor
from ..digits import counted
from ..exceptions import OutOfBoundsWarning
from ._checks import LARGEST_AT_REST
from ._columns import RATE_UNITS, SIGNALS, ask
from ._oddities import oddities
from ._simpler import NAMES, ROUNDS, Compensation, make_law, simpler_compensations
from ._split import Split
from .compensator import GyroCompensator, as_written, features
from .compose import ResidualRegressor, rules_of
from .errors import LogError
from .metrics import rms, scale_factor

_TIME_CONSTANT = 30.0  # of the rate of the temperature [s]
_MOST_FIT_ROWS = 10_000
# Degree in temperature of the law beside rules: with 1, rules would have to model its curvature.
_DEGREE = 2
# Rows on which rules are searched, before they are fitted to all; largest number of rules. More
# rules gained only 1 % on 16 simulated logs, and the search took twice as long.
_ROWS_FOR_SEARCH, _MOST_RULES = 1_500, 12
# The model's name in a verdict, and the gain that a compensation must exceed to be worth having.
_MODEL, _LEAST_GAIN = "this model", 1.02
_CONFIDENCE = 0.95
# Errors below this part of the uncompensated one are rounding: they count as equal.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Recipe:
    """The settings of a calibration.

    ``terms`` is "search" or numbers, one per input. ``units`` are the units in the files, by part;
    ``assumed`` has a sentence on each unit that neither the file nor the user named.
    """

    inputs: tuple[str, ...]
    output_unit: str = "deg/s"
    scale_factor: float = 1.0  # of a raw signal, if the log has only one rate
    write: str = "recommended"  # or "rules", or one of NAMES in _simpler
    terms: str | tuple[int, ...] = "search"
    physics: bool = False
    outside: str = "linear"
    units: dict[str, str] = field(default_factory=dict)
    assumed: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Gain:
    """How many times smaller one error is than another; ``low``, ``high`` are NaN for one group."""

    factor: float
    low: float
    high: float
    of_all_rows: float

    @property
    def is_decisive(self):
        """Whether the gain exceeds the scatter between groups, and is worth having."""
        return self.low > _LEAST_GAIN and self.of_all_rows > _LEAST_GAIN


@dataclass(frozen=True)
class Verdict:
    """RMS errors [deg/s] by compensation, the simplest first and the model last; which to use.

    ``gains`` are those of the model over each of the others.
    """

    rms: dict[str, float]
    gains: dict[str, Gain]
    n_groups: int
    recommended: str

    @property
    def model(self):
        return list(self.rms)[-1]


@dataclass(frozen=True, eq=False)
class Calibration:
    """A compensator, and what was found out about it.

    ``compensator`` is the one written, and ``written`` its name in the verdict. ``model`` is the
    estimator of law and rules, written or not. For every row, ``before`` is the indicated rate,
    ``after`` the rate compensated by a model that had not seen the row, and ``inside`` whether the
    row was in the bounds of such a model of law and rules: then ``after`` is finite. ``simpler``
    are compensations without rules; ``verdict`` judges them and the model on the rows ``inside``.
    ``warnings`` are those of the fit, ``oddities`` sentences on what is odd about the log.
    """

    recipe: Recipe
    compensator: GyroCompensator
    written: str
    model: Any
    split: Split
    log: pd.DataFrame
    X: pd.DataFrame
    before: np.ndarray
    after: np.ndarray
    inside: np.ndarray
    simpler: list[Compensation]
    verdict: Verdict
    n_fit_rows: int
    warnings: list
    oddities: list
    fold_models: list  # of the written compensation: per fold, the one fitted without its test rows

    @property
    def rules(self):
        """The pipeline of the rules; with the arcsine law, the part that adds to it."""
        return rules_of(self.model)

    @property
    def writes_model(self):
        return self.written == self.verdict.model

    @property
    def rate(self):
        return self.log["rate"].to_numpy()

    def cautions(self, unit="deg/s"):
        """Sentences on why the compensator should not be used as it is; errors in ``unit``."""
        found = list(self.split.cautions)
        if "output" not in self.recipe.inputs and np.abs(self.rate).max() > LARGEST_AT_REST:
            found.append(
                "the gyro turned, but its output is no input: the bias that is learnt has the "
                "scale factor error at the rates of this log in it."
            )
        for rows, where in ((self.inside, "in range"), (~self.inside, "out of range")):
            answered = rows & np.isfinite(self.after)
            if not answered.any():
                continue
            errors = (RATE_UNITS[unit] * (each - self.rate) for each in (self.before, self.after))
            was, became = (rms(each[answered]) for each in errors)
            if became > was:
                found.append(
                    f"the compensation makes held-out rows {where} worse, from {was:.4g} to "
                    f"{became:.4g} {unit} RMS."
                )
        return found + self.oddities


def calibrate(log, split, recipe, tell, name_row="row {}".format):
    """Predict every row by a model that has not seen it, fit all rows, and give a verdict.

    ``tell`` is called with a line of text for every step; ``name_row`` names a row in messages.
    """
    factor = recipe.scale_factor
    if recipe.output_unit in SIGNALS and np.ptp(log["rate"]) > 0.0:
        factor = scale_factor(log["rate"], log["output"])
    X = features(log, recipe.inputs, _TIME_CONSTANT)
    rate, before = log["rate"].to_numpy(), log["output"].to_numpy() / factor
    target = rate if recipe.physics else before - rate
    groups, rng = split.labels.astype(str), np.random.default_rng(0)
    predicted, inside, folds, fold_models = _held_out(X, target, groups, split, recipe, tell, rng)
    rows = some_rows(np.arange(len(X)), _MOST_FIT_ROWS, X, rng)
    # All compensations are judged on the same rows: those that the model answered in range.
    judged = inside & np.isfinite(predicted)
    tell("comparing with simpler compensations")
    simpler = list(simpler_compensations(X, rate, before, folds, rows, judged, recipe.outside))
    estimator, messages = _fit(X.iloc[rows], target[rows], groups[rows], recipe, tell)
    predicts, after = ("rate", predicted) if recipe.physics else ("error", before - predicted)
    model = Compensation(_MODEL, predicts, after, estimator=estimator, fold_models=fold_models)
    every = [each for each in [*simpler, model] if each.after is not None]
    errors = {each.name: (each.after - rate)[judged] for each in every}
    verdict = judge(errors, split.labels[judged], split.most)
    written = _to_write(recipe, verdict, simpler)
    chosen = next(each for each in every if each.name == written)
    left = np.where(judged, chosen.after - rate, np.nan)
    whole = GyroCompensator(
        chosen.estimator,
        recipe.inputs,
        predicts=chosen.predicts,
        scale_factor=factor,
        output_unit=recipe.output_unit,
        time_constant=_TIME_CONSTANT,
        units={part: recipe.units[part] for part in recipe.units if part in log},
        assumed=recipe.assumed,
    )
    return Calibration(
        recipe=recipe,
        compensator=as_written(whole),
        written=written,
        model=estimator,
        split=split,
        log=log,
        X=X,
        before=before,
        after=chosen.after,
        inside=judged,
        simpler=simpler,
        verdict=verdict,
        n_fit_rows=rows.size,
        warnings=messages,
        oddities=list(oddities(log, before - rate, left, name_row)),
        fold_models=chosen.fold_models,
    )


def fit_model(X, target, groups, recipe):
    """Fit the estimator of a recipe; ``groups`` guide the search for rules that are not given."""
    law = make_law(recipe.inputs, _DEGREE, recipe.outside) if recipe.physics else None
    if not isinstance(recipe.terms, str):
        structure: dict[str, Any] = {"n_mfs": list(recipe.terms)}
    else:
        rows = some_rows(np.arange(len(X)), _ROWS_FOR_SEARCH, X, np.random.default_rng(0))
        left = target - law.fit(X, target).predict(X) if law else target
        found = _make_rules(recipe, max_rules=_MOST_RULES)
        found.fit(X.iloc[rows], left[rows], anfisregressor__groups=groups[rows])
        if law is None and rows.size == len(X):
            return found
        structure = {"partition": found[-1].model_}
    rules = _make_rules(recipe, **structure)
    # Rules are searched once, in the residual of the law; every round starts from them.
    whole = rules if law is None else ResidualRegressor(law, rules, n_rounds=ROUNDS)
    return whole.fit(X, target)


def _make_rules(recipe, **structure):
    """A scaler and rules, with a given structure or one to be searched."""
    rules = ANFISRegressor(**structure, simplicity=0.0, out_of_bounds=recipe.outside)
    return make_pipeline(StandardScaler(), rules)


def some_rows(rows, n_rows, X, rng):
    """At most ``n_rows`` random rows in order, plus those at the ends of every input's range."""
    if rows.size <= n_rows:
        return rows
    values = X.to_numpy()[rows]
    ends = np.concatenate([values.argmin(axis=0), values.argmax(axis=0)])
    chosen = rng.choice(rows.size, n_rows, replace=False)
    return rows[np.unique(np.concatenate([chosen, ends]))]


def _held_out(X, target, groups, split, recipe, tell, rng):
    """Predict every row by a model that has not seen it; also rows in range, folds and models."""
    predicted, inside = np.full(len(X), np.nan), np.zeros(len(X), dtype=bool)
    folds, models = [], []
    for number, (train, test) in enumerate(split.folds, 1):
        tell(f"checking by held-out {split.kind}: fold {number} of {len(split.folds)}")
        rows = some_rows(train, _MOST_FIT_ROWS, X, rng)
        folds.append((rows, test))
        # The final fit warns of the same.
        with warnings.catch_warnings(action="ignore"):
            model = fit_model(X.iloc[rows], target[rows], groups[rows], recipe)
            predicted[test] = model.predict(X.iloc[test])
            inside[test] = ask(model, "in_bounds", X.iloc[test])
        models.append(model)
    if not (inside & np.isfinite(predicted)).any():
        raise LogError(
            f"the compensator could not be checked: every row of a held-out group ({split.kind}) "
            "lies outside the range of the other groups. Log groups that overlap in temperature, "
            "rate and time."
        )
    return predicted, inside, folds, models


def _fit(X, target, groups, recipe, tell):
    """The model fitted to all rows, and the texts of its warnings."""
    tell(f"fitting to {len(X):,} rows")
    with warnings.catch_warnings(record=True, action="always") as caught:
        # Trial fits warn of held-out rows out of range; the final fit predicts no such rows.
        warnings.simplefilter("ignore", OutOfBoundsWarning)
        estimator = fit_model(X, target, groups, recipe)
    tell(counted(rules_of(estimator)[-1].n_rules_, "rule"))
    return estimator, sorted({str(warning.message) for warning in caught})


def _to_write(recipe, verdict, simpler):
    if recipe.write == "recommended":
        return verdict.recommended
    name = NAMES.get(recipe.write, verdict.model)
    if name not in verdict.rms:
        reason = next(each.missing for each in simpler if each.name == name)
        raise LogError(f"--write {recipe.write}: {reason}.")
    return name


def judge(errors, groups, most=""):
    """Judge compensations by their errors on the same rows, in groups that were held out together.

    ``errors`` are by name, in order of complexity: "no compensation" first, the model last.
    ``most`` is the most complex one that the groups can support: others may have memorised the log.
    """
    codes = np.unique(groups.astype(str), return_inverse=True)[1]
    counts = np.bincount(codes)
    of_all = {name: rms(error) for name, error in errors.items()}
    floor = _ROUNDING * next(iter(of_all.values())) or np.finfo(float).tiny
    logs = {}
    for name, error in errors.items():
        by_group = np.sqrt(np.bincount(codes, error**2) / counts)
        logs[name] = np.log(np.maximum([*by_group, of_all[name]], floor))
    names = list(errors)
    recommended = next(
        name
        for place, name in enumerate(names)
        # Nothing simpler may have a smaller error: one bad group can hide that in the scatter.
        if of_all[name] == min(of_all[other] for other in names[: place + 1])
        and not any(_gain(logs[name] - logs[other]).is_decisive for other in names[place + 1 :])
    )
    if most:
        safe = list(NAMES.values())[: 1 + list(NAMES).index(most)]
        recommended = min([name for name in names if name in safe], key=lambda name: of_all[name])
    gains = {name: _gain(logs[name] - logs[names[-1]]) for name in names[:-1]}
    return Verdict(of_all, gains, counts.size, recommended)


def _gain(logs):
    """The gain from logarithms of ratios of RMS errors: one per group, then over all rows."""
    *by_group, of_all = logs
    n, mean = len(by_group), np.mean(by_group)
    half = np.nan
    if n > 1:
        half = student.ppf(0.5 + 0.5 * _CONFIDENCE, n - 1) * np.std(by_group, ddof=1) / np.sqrt(n)
    return Gain(*(float(np.exp(value)) for value in (mean, mean - half, mean + half, of_all)))
