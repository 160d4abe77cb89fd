"""From a checked log to a compensator, and to predictions of every row by models new to it."""

import warnings
from dataclasses import dataclass
from functools import partial

import numpy as np
import pandas as pd
from sklearn.linear_model import LinearRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler

from .. import ANFISRegressor
from ._ask import ask
from ._glitches import find_glitches
from ._split import Split
from ._structure import grow_terms, held_out_rms
from ._units import SIGNALS
from .compensator import GyroCompensator, features
from .compose import ResidualRegressor
from .log import LogError
from .metrics import scale_factor
from .physics import OpenLoopArcsineRegressor

__all__ = ["MAX_EXTRAPOLATION", "Calibration", "Recipe", "calibrate"]

# That of the estimator.
MAX_EXTRAPOLATION = ANFISRegressor().max_extrapolation

# For comparing structures; what neighbours in time say twice is left out.
_SEARCH_ROWS = 6_000
# Of law and rules by turns: what dies away after power-on would bend the law that is fitted first.
_ROUNDS = 3
_BASELINES = {"straight line": 1, "cubic polynomial": 3}


@dataclass(frozen=True)
class Recipe:
    """What a calibration is asked to do.

    ``terms`` is "search", "auto" (left to ANFISRegressor) or numbers, one per input.
    """

    inputs: tuple[str, ...]
    output_unit: str = "deg/s"
    scale_factor: float = 1.0  # of a raw signal at rest, which does not tell it
    terms: str | tuple[int, ...] = "search"
    physics: bool = False
    outside: str = "linear"
    max_extrapolation: float = MAX_EXTRAPOLATION
    time_constant: float = 30.0
    min_coverage: float = 0.1
    max_rules: int = 36
    fit_rows: int = 100_000
    n_jobs: int | None = None


@dataclass(frozen=True, eq=False)
class Calibration:
    """A compensator, and what was found out about it.

    ``before`` and ``after`` are the indicated rate and the held-out compensated one of every row,
    ``inside`` whether the row was in the bounds of the model that had not seen it. ``warnings`` are
    those of the fit; ``cautions`` say why the compensator should not be used as it is.
    """

    recipe: Recipe
    compensator: GyroCompensator
    split: Split
    log: pd.DataFrame
    X: pd.DataFrame
    before: np.ndarray
    after: np.ndarray
    inside: np.ndarray
    terms: tuple[int, ...] | None
    tried: list
    baselines: dict
    n_fit_rows: int
    warnings: list
    cautions: list

    @property
    def rate(self):
        """True rate of every row [deg/s]."""
        return self.log["rate"].to_numpy()


def calibrate(log, split, recipe, tell, name_row="row {}".format):
    """Choose the structure, compensate every row by a model that is new to it, fit to all rows.

    ``tell`` is called with a line of text for every step; ``name_row`` says where a row is found.
    """
    factor = 1.0
    if recipe.output_unit in SIGNALS:
        at_rest = np.ptp(log["rate"]) == 0.0
        factor = recipe.scale_factor if at_rest else scale_factor(log["rate"], log["output"])
    X = features(log, recipe.inputs, recipe.time_constant)
    before = log["output"].to_numpy() / factor
    error = before - log["rate"].to_numpy()
    glitches = [
        f"{name_row(glitch.row)}: {glitch.reason} is supported by no other row; if it is a glitch, "
        "drop this row and calibrate again."
        for glitch in find_glitches(log, error)
    ]
    for sentence in glitches:
        tell(f"warning: {sentence}")
    target = log["rate"].to_numpy() if recipe.physics else error
    rng = np.random.default_rng(0)
    chosen, tried, baselines = _search(X, target, error, split, recipe, rng, tell)
    make = partial(make_estimator, recipe, chosen)
    predicted, inside = _held_out(make, X, target, split, recipe, rng, tell)
    if not (inside & np.isfinite(predicted)).any():
        raise LogError(
            f"the compensator could not be checked: every row lies outside the range of the rows "
            f"that the model had seen while its group was held out ({split.kind}). Log groups that "
            "overlap in temperature, rate and time."
        )
    rows = _some(np.arange(len(X)), recipe.fit_rows, X, rng)
    tell(f"fitting to {rows.size:,} rows")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        estimator = make().fit(X.iloc[rows], target[rows])
    compensator = GyroCompensator(
        estimator,
        recipe.inputs,
        predicts="rate" if recipe.physics else "error",
        scale_factor=factor,
        output_unit=recipe.output_unit,
        time_constant=recipe.time_constant,
        min_coverage=recipe.min_coverage,
    )
    after = compensator.compensate(before, predicted)
    return Calibration(
        recipe=recipe,
        compensator=compensator,
        split=split,
        log=log,
        X=X,
        before=before,
        after=after,
        inside=inside,
        terms=chosen[1],
        tried=tried,
        baselines=baselines,
        n_fit_rows=rows.size,
        warnings=sorted({str(warning.message) for warning in caught}),
        cautions=[*_what_is_worse(error, after - log["rate"].to_numpy(), inside), *glitches],
    )


def _what_is_worse(before, after, inside):
    """Sentences about the held-out rows, in range and out of it, that are better left alone."""
    for rows, where in ((inside, "in range"), (~inside, "out of range")):
        answered = rows & np.isfinite(after)
        if not answered.any():
            continue
        was, became = (float(np.sqrt(np.mean(e[answered] ** 2))) for e in (before, after))
        if became > was:
            yield (
                f"the compensation makes held-out rows {where} worse, from {was:.4g} to "
                f"{became:.4g} deg/s RMS."
            )


def make_estimator(recipe, choice):
    """The estimator of a recipe; ``choice`` is the degree of the law and the numbers of terms."""
    degree, terms = choice
    anfis = ANFISRegressor(
        "auto" if terms is None else list(terms),
        out_of_bounds=recipe.outside,
        max_extrapolation=recipe.max_extrapolation,
        warn_out_of_bounds=False,
        n_jobs=recipe.n_jobs,
    )
    pipeline = make_pipeline(StandardScaler(), anfis)
    if not recipe.physics:
        return pipeline
    knows_lag = {"temperature", "temperature_rate"} <= set(recipe.inputs)
    law = OpenLoopArcsineRegressor(
        "output",
        "temperature" if "temperature" in recipe.inputs else None,
        # The lag of the thermometer is part of the law where it can be known.
        temperature_rate="temperature_rate" if knows_lag else None,
        amplitude_degree=degree,
        bias_degree=degree,
        out_of_bounds=recipe.outside,
        warn_out_of_bounds=False,
    )
    return ResidualRegressor(law, pipeline, n_rounds=_ROUNDS)


def _search(X, target, error, split, recipe, rng, tell):
    """The choice for :func:`make_estimator`, all that was tried, and the baselines' errors."""
    folds = [
        (_some(train, _SEARCH_ROWS, X, rng), _some(test, _SEARCH_ROWS, X, rng))
        for train, test in split.folds
    ]

    def score(terms, degree=1):
        make = partial(make_estimator, recipe, (degree, terms))
        return held_out_rms(partial(_errors_of_fold, make, X, target), folds)

    baselines = {
        name: held_out_rms(partial(_errors_of_fold, partial(_polynomial, d), X, error), folds)
        for name, d in _BASELINES.items()
    }
    degree = 1
    if recipe.physics:
        linear = (1,) * len(recipe.inputs)
        degree = min((1, 2), key=lambda d: score(linear, d))
        tell(f"law of the open loop with coefficients of degree {degree} in temperature")
    if recipe.terms == "auto":
        return (degree, None), [(None, score(None, degree))], baselines
    if recipe.terms != "search":
        return (degree, recipe.terms), [(recipe.terms, score(recipe.terms, degree))], baselines
    tell(f"choosing the terms on {len(folds)} folds of {folds[0][0].size:,} rows")
    terms, tried = grow_terms(
        partial(score, degree=degree), len(recipe.inputs), recipe.max_rules, tell
    )
    return (degree, tuple(terms)), tried, baselines


def _held_out(make, X, target, split, recipe, rng, tell):
    predicted, inside = np.full(len(X), np.nan), np.zeros(len(X), dtype=bool)
    with warnings.catch_warnings():
        # The final fit warns of the same.
        warnings.simplefilter("ignore")
        for number, (train, test) in enumerate(split.folds, start=1):
            tell(f"checking by held-out {split.kind}: fold {number} of {len(split.folds)}")
            rows = _some(train, recipe.fit_rows, X, rng)
            estimator = make().fit(X.iloc[rows], target[rows])
            predicted[test] = estimator.predict(X.iloc[test])
            inside[test] = ask(estimator, "in_bounds", X.iloc[test])
    return predicted, inside


def _errors_of_fold(make, X, target, train, test):
    """Errors of the test rows, and which of them are in the range of the training rows."""
    estimator = make().fit(X.iloc[train], target[train])
    low, high = X.iloc[train].min(), X.iloc[train].max()
    tested = X.iloc[test]
    inside = ((tested >= low) & (tested <= high)).all(axis=1).to_numpy()
    errors = estimator.predict(tested) - target[test]
    return errors, inside & np.isfinite(errors)


def _polynomial(degree):
    return make_pipeline(
        StandardScaler(), PolynomialFeatures(degree, include_bias=False), LinearRegression()
    )


def _some(rows, n_rows, X, rng):
    """At most so many of the rows in their order, with those at the ends of every input's range."""
    if rows.size <= n_rows:
        return rows
    values = X.to_numpy()[rows]
    ends = np.concatenate([values.argmin(axis=0), values.argmax(axis=0)])
    chosen = rng.choice(rows.size, n_rows, replace=False)
    return rows[np.unique(np.concatenate([chosen, ends]))]
