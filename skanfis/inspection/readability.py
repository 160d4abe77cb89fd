"""Whether the rules of a model can be read one by one: figures, tables and sentences."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.utils import check_array, check_consistent_length, column_or_1d

from .._validation import as_numbers, check_finite, positive_weights
from ..digits import counted, in_digits
from ..export import fold_with_rows
from ..export.columns import categories
from ..export.folding import last_step
from ..model import TSKModel
from .labels import MOST_NAMED, in_one_line
from .measures import Measures, measure
from .rules import has_training_data, premise_texts
from .sentences import Sentences

# Largest distance of the strongest rule alone from the model, in deviations of the target: that of
# a model from a target of which it explains three quarters of the variance.
GREATEST_ALONE = 0.5
# Largest ratio of the error of the text as printed to the model's, and of a rule's to a constant's.
GREATEST_ERROR = 1.05
# Smaller errors are rounding errors, as if the target is the prediction itself.
_ROUNDING = np.sqrt(np.finfo(float).eps)
# A slope has a sign if it is this many deviations from zero, in a rule of at least this weight.
# Of m slopes that are zero, the largest is sqrt(2 log m) off by chance: many need as much.
_DEVIATIONS, _LEAST_WEIGHT = 2.0, 0.05


@dataclass(frozen=True, eq=False, repr=False)
class Readability:
    """Whether the rules of a model can be read one by one, and what speaks against it.

    :func:`skanfis.inspection.readability` makes it; ``print`` shows the findings.

    Parameters
    ----------
    model : TSKModel
        The model that was measured.
    measures : Measures
        The figures as arrays.
    is_of_chunk : bool, default=False
        Whether the rows are those of the latest ``partial_fit`` alone; ``print`` then says so.

    Attributes
    ----------
    rules : DataFrame
        One row per rule and output: "if", its terms; "output"; "weight", the part of the rows'
        weight on which it fires; "rows", the weight of the rows on which it is the strongest;
        "alone", the RMS of its value less the model on these, in sd of the target; "error", the
        RMSE of its value there, in units of the target; "numbers" in its sentence.
    reading_cost : int
        Numerals that a person reads in the rules' sentences, as ``structures_`` counts them, less
        the slopes that are too small to be written.
    summary : Series
        The worst "strongest_alone", and "text_over_model", the RMSE of the text as printed over
        the model's; NaN where the model has no error to compare with.
    findings, on_rules : list of str
        Sentences on what speaks against reading the rules one by one, empty if nothing does; and
        those that stay, however many digits are printed.
    line : str
        How many numbers there are to read, and the error of the text as printed.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> model = ANFISRegressor(n_mfs=[3, 1], order=0, solver="lse").fit(*make_jang_sinc())
    >>> model.readability_.rules["numbers"].tolist()
    [2, 2, 2]
    """

    model: TSKModel
    measures: Measures
    is_of_chunk: bool = False

    @property
    def _said(self):
        return Sentences.of(self.model)

    @property
    def rules(self) -> Any:
        """The rules; see the class."""
        found, said = self.measures, self._said
        premises = np.array(premise_texts(said.model), dtype=object)
        rule = np.repeat(np.arange(premises.size), self.model.n_outputs)
        return pd.DataFrame(
            {
                "if": premises[rule],
                "output": list(self.model.output_names) * premises.size,
                "weight": found.rule_weights[rule],
                "rows": found.rule_rows[rule],
                "alone": found.rule_alone.ravel(),
                "error": self.rule_errors.ravel(),
                "numbers": said.n_numbers[rule],
            },
            index=pd.Index(rule, name="rule"),
        )

    @property
    def rule_errors(self) -> np.ndarray:
        """RMSE of each rule alone where it is the strongest, in units of the target."""
        return self.measures.deviation * self.measures.rule_errors

    @property
    def reading_cost(self) -> int:
        """Numerals that a person reads in the rules' sentences; see the class."""
        return self._said.reading_cost

    @property
    def summary(self) -> Any:
        """The worst of each figure, over outputs."""
        found = self.measures
        is_known = found.errors > _ROUNDING
        worst = max(found.printed_errors[is_known] / found.errors[is_known], default=np.nan)
        figures = {"strongest_alone": found.alone.max(), "text_over_model": worst}
        return pd.Series(figures, name="readability")

    @property
    def findings(self) -> list[str]:
        """Sentences on what speaks against reading the rules one by one; empty if nothing does."""
        ratio = self.summary["text_over_model"]
        if not ratio > GREATEST_ERROR:
            return self.on_rules
        errs = f"The text as printed errs {in_digits(ratio, 3)} times as much as the model"
        return [f"{errs}: print more digits (precision).", *self.on_rules]

    @property
    def on_rules(self) -> list[str]:
        """The findings that stay, however many digits are printed."""
        sentences = _on_signs(self._said) + self._on_few_rows() + self._on_constants()
        for output, error in zip(self.model.output_names, self.measures.alone, strict=True):
            of_output = f" of {output!r}" if self.model.n_outputs > 1 else ""
            if error > GREATEST_ALONE:
                sentences.append(
                    f"No rule{of_output} can be read without the others: used alone, the strongest "
                    f"is {in_digits(error, 3)} standard deviations of the target off the model "
                    f"(more than {GREATEST_ALONE})."
                )
        return sentences

    @property
    def _is_on_few(self):
        """Which rules are the strongest on fewer training rows than they have numbers."""
        return has_training_data(self.model) & (self.model.rule_rows < self._said.n_numbers)

    def _on_few_rows(self):
        numbers, rows = self._said.n_numbers, self.model.rule_rows
        few = np.flatnonzero(self._is_on_few)
        named = _named([f"rule {r} (rows: {rows[r]:.3g}, numbers: {numbers[r]})" for r in few])
        what = "Strongest on fewer rows than its sentence has numbers"
        return [f"{what}: {named}."] if named else []

    def _on_constants(self):
        """Rules that err more on the rows on which they are the strongest than a constant would."""
        found, outputs, named = self.measures, self.model.output_names, []
        is_poor = found.rule_errors > np.maximum(GREATEST_ERROR * found.rule_spreads, _ROUNDING)
        # On a few rows, even a constant may be exact: these rules are not compared.
        is_poor &= ~self._is_on_few[:, None]
        if self.is_of_chunk:
            is_poor &= (found.rule_rows >= self._said.n_numbers)[:, None]
        for r, k in np.argwhere(is_poor):
            rule = f"rule {r} of {outputs[k]}" if len(outputs) > 1 else f"rule {r}"
            both = found.rule_errors[r, k], found.rule_spreads[r, k]
            errs, spread = (in_digits(found.deviation[k] * one, 3) for one in both)
            named.append(f"{rule} (errs by {errs}, a constant by {spread})")
        what = "Errs more on its own rows than a constant would"
        return [f"{what}: {_named(named)}."] if named else []

    @property
    def line(self) -> str:
        """How many numbers there are to read, and the error of the text as printed."""
        ratio, numbers = self.summary["text_over_model"], counted(self.reading_cost, "number")
        if np.isnan(ratio):
            return numbers
        more = round(100.0 * (ratio - 1.0))
        errs = f"{abs(more)} % {'more' if more > 0 else 'less'} than" if more else "as much as"
        return f"{numbers}; the text as printed errs {errs} the model"

    def __repr__(self):
        # As a notebook shows it.
        nothing = "Nothing measured here speaks against reading the rules one by one."
        of_chunk = ["Errors are of the rows of the latest partial_fit alone."] * self.is_of_chunk
        lines = [f"{self.line}.", *(self.findings or [nothing]), *of_chunk]
        return "\n".join(map(in_one_line, lines))


def readability(
    estimator: Any,
    X: ArrayLike,
    y: ArrayLike | None = None,
    *,
    sample_weight: ArrayLike | None = None,
) -> Readability:
    """Measure whether the rules can be read one by one, and list what speaks against it.

    It measures how far the strongest rule of a row lies from the model and from the target, and
    the error of the text as printed; see :doc:`/reading_rules`.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        As :func:`skanfis.export.fold` takes it; scalers are folded into the rules.
    X : array-like of shape (n_samples, n_features)
        Rows; those outside the range count at its nearest point.
    y : array-like of shape (n_samples,) or (n_samples, n_outputs), default=None
        The target, whose standard deviation is the unit; None takes the predictions.
    sample_weight : array-like of shape (n_samples,), default=None
        Weights, zero or positive; a whole number counts as that many copies of the row.

    Returns
    -------
    readability : Readability
        Tables, summary and findings.

    Raises
    ------
    ValueError, TypeError
        As :func:`skanfis.export.fold`; if X, y or the weights do not fit the model.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import readability
    >>> X, y = make_jang_sinc()
    >>> readability(ANFISRegressor(n_mfs=2, agreement=1.0).fit(X, y), X, y).findings
    []
    """
    (model, rows), target, weight = fold_with_rows(estimator, X), None, None
    if y is not None:
        target = as_numbers(y, "y")
        target = target.reshape(-1, 1) if target.ndim == 1 else target
        if target.shape[1] != model.n_outputs:
            raise ValueError(
                f"y must have a column for each output of the model, "
                f"{', '.join(map(repr, model.output_names))}; it has {target.shape[1]}."
            )
        check_finite(target, "y", model.output_names)
    if sample_weight is not None:
        weight = column_or_1d(check_array(sample_weight, dtype=float, ensure_2d=False))
        positive_weights(weight, len(rows))
    check_consistent_length(rows, target, weight)
    return Readability(model, measure(model, rows, target, weight))


def readability_in_training(estimator, model):
    """The fit's ``readability_`` for ``model``, the estimator folded and renamed; None if unknown.

    Behind a scaler, numbers are rounded in other units, so the error of the text is not known.
    """
    found = getattr(last_step(estimator), "readability_", None)
    if found is None:
        return None
    scale = 1.0 if model.target is None else model.target.spread / found.model.target.spread
    measures = replace(found.measures, deviation=scale * found.measures.deviation)
    # Compare sorted numbers: moving columns does not change them.
    own, fitted = (
        np.append(np.sort(one.coefficients, axis=1), np.sort(one.antecedent.parameters))
        for one in (model, found.model)
    )
    if not np.array_equal(own, fitted):
        measures = replace(measures, printed_errors=np.full(model.n_outputs, np.nan))
    return replace(found, model=model, measures=measures)


def _on_signs(said):
    """Inputs whose slopes are positive in some rules and negative in others, beyond chance."""
    model = said.model
    if model.posterior is None or not model.order:
        return []
    found, every, deviations = [], said.slopes.copy(), np.zeros(said.slopes.shape)
    deviations[:, model.posterior.inputs] = model.posterior.of_coefficients(model.n_rules)[:, 1:]
    # Sentences may count from a level of their own: here all rules count from the same.
    for own in (one.inputs for one in categories(model).values() if not one.others):
        base = [own[np.abs(every[:, own]).sum(axis=(0, 2)).argmin()]]
        moved = every[:, base]
        every[:, own] -= moved
        deviations[:, own] = np.hypot(deviations[:, own], deviations[:, base] * (moved != 0.0))
    heavy = model.rule_weights >= _LEAST_WEIGHT
    least = max(_DEVIATIONS, np.sqrt(2.0 * np.log1p(np.count_nonzero(every[heavy]))))
    for k, output in enumerate(model.output_names):
        for j in model.posterior.inputs:
            slopes = every[:, j, k]
            is_clear = heavy & (np.abs(slopes) > least * deviations[:, j, k])
            up, down = (np.flatnonzero(is_clear & (sign * slopes > 0.0)) for sign in (1.0, -1.0))
            if up.size and down.size:
                name, of_output = model.input_names[j], f" (of {output})" * (model.n_outputs > 1)
                level = model.levels.get(name)
                cause = f"by {name}{of_output}"
                if level is not None:
                    cause = f"if {level.said(True)}{of_output},"
                rises, falls = map(_rules, (up, down))
                found.append(f"{cause} up in {rises} and down in {falls}")
    named = _named(found, "; ")
    return [f"Rules go different ways, beyond chance: {named}."] if found else []


def _rules(numbers):
    return f"rule{'' if len(numbers) == 1 else 's'} {', '.join(map(str, numbers))}"


def _named(parts, between=", "):
    if len(parts) <= MOST_NAMED:
        return between.join(parts)
    return f"{between.join(parts[:MOST_NAMED])} and {len(parts) - MOST_NAMED} more"
