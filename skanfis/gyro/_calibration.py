"""From a checked log to a compensator, and to predictions of every row by models new to it."""

import warnings
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd

from ..options import LinearExtrapolation
from ._checks import find_glitches
from ._columns import SIGNALS, ask
from ._models import Choice, fit_model, some_rows
from ._simpler import Simpler, simpler_compensations
from ._split import Split
from ._verdict import Verdict, judge
from .compensator import GyroCompensator, features
from .errors import LogError
from .metrics import rms, scale_factor

__all__ = ["MODEL", "Calibration", "Recipe", "calibrate"]

# Its name in a verdict.
MODEL = "this model"


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
    max_extrapolation: float | Literal["auto"] = LinearExtrapolation().max_extrapolation
    time_constant: float = 30.0
    min_coverage: float = 0.1
    fit_rows: int = 100_000
    n_jobs: int | None = None
    box: tuple[tuple[str, float, float], ...] = ()  # of proven bounds: input, low, high


@dataclass(frozen=True, eq=False)
class Calibration:
    """A compensator, and what was found out about it.

    ``before`` and ``after`` are the indicated rate and the held-out compensated one of every row,
    ``inside`` whether the row was in the bounds of the model that had not seen it. ``choice`` is of
    the model's structure, ``fold_choices`` of those held out, each from its fold's training rows;
    None where it was given. ``simpler`` are compensations without rules, judged with the model by
    ``verdict`` on the rows in range. ``warnings`` are those of the fit; ``glitches`` sentences on
    rows that no other supports. ``n_rows`` is how many rows there were, of which ``log`` has some.
    """

    recipe: Recipe
    compensator: GyroCompensator
    split: Split
    log: pd.DataFrame
    X: pd.DataFrame
    before: np.ndarray
    after: np.ndarray
    inside: np.ndarray
    choice: Choice
    fold_choices: list[Choice] | None
    simpler: list[Simpler]
    verdict: Verdict
    n_fit_rows: int
    warnings: list
    glitches: list
    n_rows: int

    @property
    def rules(self):
        """The pipeline of the rules: beside the arcsine law, what adds to it."""
        return getattr(self.compensator.estimator, "residual_", self.compensator.estimator)

    @property
    def is_thinned(self):
        """Whether the log has more rows than are held."""
        return self.n_rows > len(self.log)

    @property
    def rate(self):
        """True rate of every row [deg/s]."""
        return self.log["rate"].to_numpy()

    @property
    def in_range(self):
        """Rows that were in the bounds of a model new to them, and have its answer."""
        return self.inside & np.isfinite(self.after)

    @property
    def cautions(self):
        """Sentences that say why the compensator should not be used as it is; rates in deg/s."""
        return self.cautions_in("deg/s")

    def cautions_in(self, unit, per_unit=1.0):
        """The same, with errors in another unit, of which ``per_unit`` are 1 deg/s."""
        before, after = (per_unit * (rate - self.rate) for rate in (self.before, self.after))
        return [*_what_is_worse(before, after, self.inside, unit), *self.glitches]


def calibrate(log, split, recipe, tell, name_row="row {}".format, *, made=None, n_rows=None):
    """Compensate every row by a model that is new to it, fit to all rows, and judge.

    ``tell`` is called with a line of text for every step; ``name_row`` says where a row is found.
    ``made`` are inputs that are there already, and ``n_rows`` is of how many rows these are some.
    """
    factor = 1.0
    if recipe.output_unit in SIGNALS:
        at_rest = np.ptp(log["rate"]) == 0.0
        factor = recipe.scale_factor if at_rest else scale_factor(log["rate"], log["output"])
    X = features(log, recipe.inputs, recipe.time_constant, made)
    rate, before = log["rate"].to_numpy(), log["output"].to_numpy() / factor
    glitches = [
        f"{name_row(row)}: {reason} is supported by no other row; if it is a glitch, drop this row "
        "and calibrate again."
        for row, reason in find_glitches(log, before - rate)
    ]
    for sentence in glitches:
        tell(f"warning: {sentence}")
    target = rate if recipe.physics else before - rate
    groups, rng = split.labels.astype(str), np.random.default_rng(0)
    predicted, inside = np.full(len(X), np.nan), np.zeros(len(X), dtype=bool)
    folds, choices = [], []
    for number, (train, test) in enumerate(split.folds, 1):
        tell(f"checking by held-out {split.kind}: fold {number} of {len(split.folds)}")
        rows = some_rows(train, recipe.fit_rows, X, rng)
        folds.append((rows, test))
        with warnings.catch_warnings():
            # The final fit warns of the same.
            warnings.simplefilter("ignore")
            model, choice = fit_model(X.iloc[rows], target[rows], groups[rows], recipe)
            predicted[test] = model.predict(X.iloc[test])
            inside[test] = ask(model, "in_bounds", X.iloc[test])
        choices.append(choice)
    if not (inside & np.isfinite(predicted)).any():
        raise LogError(
            f"the compensator could not be checked: every row lies outside the range of the rows "
            f"that the model had seen while its group was held out ({split.kind}). Log groups that "
            "overlap in temperature, rate and time."
        )
    rows = some_rows(np.arange(len(X)), recipe.fit_rows, X, rng)
    tell("comparing with simpler compensations")
    simpler = list(simpler_compensations(X, rate, before, folds, rows))
    tell(f"fitting to {rows.size:,} rows")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        estimator, choice = fit_model(X.iloc[rows], target[rows], groups[rows], recipe)
    if choice.tried:
        terms = "no grid" if choice.terms is None else f"terms {','.join(map(str, choice.terms))}"
        error = dict(choice.tried).get(choice.terms, np.nan)
        tell(f"{terms}: held-out RMS {error:.4g} deg/s")
    if recipe.physics:
        tell(f"law of the open loop with coefficients of degree {choice.degree} in temperature")
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
    # The same rows for all: those that the model answered in range.
    judged = inside & np.isfinite(after)
    rates = {each.name: each.after for each in simpler if each.after is not None} | {MODEL: after}
    errors = {name: (compensated - rate)[judged] for name, compensated in rates.items()}
    return Calibration(
        recipe=recipe,
        compensator=compensator,
        split=split,
        log=log,
        X=X,
        before=before,
        after=after,
        inside=inside,
        choice=choice,
        fold_choices=choices if recipe.physics or isinstance(recipe.terms, str) else None,
        simpler=simpler,
        verdict=judge(errors, split.labels[judged]),
        n_fit_rows=rows.size,
        warnings=sorted({str(warning.message) for warning in caught}),
        glitches=glitches,
        n_rows=len(log) if n_rows is None else n_rows,
    )


def _what_is_worse(before, after, inside, unit):
    """Sentences about the held-out rows, in range and out of it, that are better left alone."""
    for rows, where in ((inside, "in range"), (~inside, "out of range")):
        answered = rows & np.isfinite(after)
        if not answered.any():
            continue
        was, became = rms(before[answered]), rms(after[answered])
        if became > was:
            yield (
                f"the compensation makes held-out rows {where} worse, from {was:.4g} to "
                f"{became:.4g} {unit} RMS."
            )
