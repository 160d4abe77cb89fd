"""Whether the rules of a model can be read one by one: figures, tables and sentences."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.utils import check_array, check_consistent_length, column_or_1d

from .._validation import check_finite, positive_weights
from ..export.folding import fold_with_reader
from ..membership import GREATEST_CROSSING, LEAST_TRUTH
from ..model import TSKModel
from ..reading_cost import reading_cost
from .measures import Measures, crossings, distinct_terms, measure
from .rules import premise_texts, rules_frame, writable

# In standardised units: whoever reads the strongest rule alone is then as wrong as a model that
# explains three quarters of the variance; beyond, the rule says too little of the model.
GREATEST_ALONE = 0.5
# A sentence names so many terms or pairs, and counts the others.
_MOST_NAMED = 5


@dataclass(frozen=True, eq=False, repr=False)
class Readability:
    """Whether the rules of a model can be read one by one, and what speaks against it.

    :func:`skanfis.inspection.readability` makes it; ``print`` says what was found.

    Parameters
    ----------
    model : TSKModel
        The model that was measured.
    measures : Measures
        The figures as arrays.

    Attributes
    ----------
    terms : DataFrame
        One row per term: "input"; "term"; "greatest_truth", its greatest membership on a row;
        "crossing", the height at which it crosses the next one. Equal terms count once.
    rules : DataFrame
        One row per rule and output: "if", its terms; "output"; "weight", the part of the rows'
        weight on which it fires; "rows", the weight of the rows on which it is the strongest;
        "alone", the RMS of its value less the model on these, in sd of the target.
    reading_cost : int
        Numerals that a person reads in the rules' sentences, as ``structures_`` counts them.
    summary, limits : Series, dict
        The worst "strongest_alone", "least_truth" and "greatest_crossing", and what just passes.
    findings, line : list of str, str
        What is not fit to be read, in sentences, empty if all is well; the summary in one line.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import readability
    >>> X, y = make_jang_sinc()
    >>> found = readability(ANFISRegressor(n_mfs=[3, 1], solver="lse").fit(X, y), X, y)
    >>> list(found.terms["term"])
    ['low', 'medium', 'high']
    """

    model: TSKModel
    measures: Measures

    limits: ClassVar[dict] = {
        "strongest_alone": GREATEST_ALONE,
        "least_truth": LEAST_TRUTH,
        "greatest_crossing": GREATEST_CROSSING,
    }

    @property
    def terms(self) -> Any:
        """One row per term; see the class."""
        model, antecedent = writable(self.model), self.model.antecedent
        own = [t for terms in distinct_terms(antecedent).values() for t in terms]
        inputs = antecedent.term_inputs
        return pd.DataFrame(
            {
                "input": [model.input_names[inputs[t]] for t in own],
                "term": [model.term_names[t] for t in own],
                "greatest_truth": self.measures.truth[own],
                "crossing": crossings(antecedent)[own],
            },
            index=pd.Index(own, name="term", dtype=int),
        )

    @property
    def rules(self) -> Any:
        """The rules; see the class."""
        found, model = self.measures, writable(self.model)
        premises = premise_texts(rules_frame(model, model.reference))
        return pd.DataFrame(
            {
                "if": np.repeat(np.array(premises, dtype=object), model.n_outputs),
                "output": list(model.output_names) * model.n_rules,
                "weight": np.repeat(found.rule_weights, model.n_outputs),
                "rows": np.repeat(found.rule_rows, model.n_outputs),
                "alone": found.rule_alone.ravel(),
            },
            index=pd.Index(np.repeat(np.arange(model.n_rules), model.n_outputs), name="rule"),
        )

    @property
    def reading_cost(self) -> int:
        """Numerals that a person reads in the rules' sentences; see the class."""
        model = self.model
        n_slopes = int(np.count_nonzero(model.coefficients[:, 1:].any(axis=2)))
        is_common = model.common_slopes
        n_slopes -= int(is_common.sum() - is_common.any(axis=0).sum())
        return reading_cost(model.antecedent, n_slopes, model.n_outputs)

    @property
    def summary(self) -> Any:
        """The worst of each figure, over outputs and terms."""
        terms = self.terms
        figures = {
            "strongest_alone": float(self.measures.alone.max()),
            "least_truth": float(terms["greatest_truth"].min()),
            "greatest_crossing": float(terms["crossing"].max()),
        }
        return pd.Series(figures, name="readability")

    @property
    def findings(self) -> list[str]:
        """What is not fit to be read, in sentences; an empty list if all is well."""
        terms = self.terms
        sentences = _on_truth(terms) + _on_crossings(terms)
        for output, error in zip(self.model.output_names, self.measures.alone, strict=True):
            of_output = f" of {output!r}" if self.model.n_outputs > 1 else ""
            if error > GREATEST_ALONE:
                sentences.append(
                    f"No rule{of_output} can be read without the others: the strongest alone "
                    f"misses the model by {_figure(error)} standard deviations of the target "
                    f"(limit {GREATEST_ALONE})."
                )
        return sentences

    @property
    def line(self) -> str:
        """The summary as one line of text."""
        found = self.summary
        parts = [f"strongest rule alone {_figure(found['strongest_alone'])} sd off the model"]
        if np.isfinite(found["least_truth"]):
            parts.append(f"least true term {_figure(found['least_truth'])}")
        if np.isfinite(found["greatest_crossing"]):
            parts.append(f"highest crossing {_figure(found['greatest_crossing'])}")
        return "; ".join(parts)

    def __repr__(self):
        return f"<Readability of {self.model!r}: {self.line}>"

    def __str__(self):
        nothing = "Nothing measured here speaks against reading the rules one by one."
        summary = f"{self.line[0].upper()}{self.line[1:]}."
        return "\n".join([summary, *(self.findings or [nothing])])


def readability(
    estimator: Any,
    X: ArrayLike,
    y: ArrayLike | None = None,
    *,
    sample_weight: ArrayLike | None = None,
) -> Readability:
    """Measure whether the rules can be read one by one, and say what speaks against it.

    Measured are how far the strongest rule of a row lies from the model, how true each term
    becomes on the rows, and where neighbouring terms cross; see :doc:`/reading_rules`.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        As :func:`skanfis.export.fold` takes it; scalers are folded into the rules.
    X : array-like of shape (n_samples, n_features)
        Rows, read block by block; those outside the range count at its nearest point.
    y : array-like of shape (n_samples,) or (n_samples, n_outputs), default=None
        The target, whose standard deviation is the unit; None takes the predictions.
    sample_weight : array-like of shape (n_samples,), default=None
        Weights, zero or positive; a whole number counts as so many copies of the row.

    Returns
    -------
    readability : Readability
        Tables, summary and findings.

    Raises
    ------
    ValueError
        If X, y or the weights do not fit the model, or a step of a pipeline cannot be folded.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import readability
    >>> X, y = make_jang_sinc()
    >>> readability(ANFISRegressor(n_mfs=2, agreement=1.0).fit(X, y), X, y).findings
    []
    """
    return _readability(estimator, X, y, sample_weight)


def _readability(estimator, X, y, sample_weight):
    model, reader = fold_with_reader(estimator)
    n_rows = X.shape[0] if hasattr(X, "shape") else len(X)
    take = getattr(X, "iloc", X)

    def read(part):
        try:
            return reader(take[part])
        except ValueError:
            # The whole table: the error then names the row by its place in it.
            reader(X)
            raise

    if y is not None:
        y = check_array(y, dtype=float, ensure_2d=False, ensure_all_finite=False, input_name="y")
        y = y.reshape(-1, 1) if y.ndim == 1 else y
        if y.shape[1] != model.n_outputs:
            raise ValueError(
                f"y has {y.shape[1]} columns; the model has {model.n_outputs} outputs: "
                f"{', '.join(map(repr, model.output_names))}."
            )
        check_finite(y, "y", model.output_names)
    if sample_weight is not None:
        sample_weight = column_or_1d(check_array(sample_weight, dtype=float, ensure_2d=False))
        positive_weights(sample_weight, n_rows)
    check_consistent_length(X, y, sample_weight)
    return Readability(model, measure(model, read, n_rows, y, sample_weight))


def readability_of_rows(model, X, y=None, sample_weight=None):
    """Measure a model on arrays that have been checked."""
    return Readability(model, measure(model, lambda part: X[part], X.shape[0], y, sample_weight))


def _on_truth(terms):
    never = terms[terms["greatest_truth"] < LEAST_TRUTH]
    if never.empty:
        return []
    what = "A term is" if len(never) == 1 else f"{len(never)} of {len(terms)} terms are"
    named = _named(
        [f"{t.term!r} of {t.input!r} ({_figure(t.greatest_truth)})" for t in never.itertuples()]
    )
    return [f"{what} never truer than {LEAST_TRUTH} on any row: {named}."]


def _on_crossings(terms):
    # The last term of an input crosses no other: its crossing is NaN.
    found = [
        f"{a.term!r} and {b.term!r} of {a.input!r} ({_figure(a.crossing)})"
        for a, b in pairwise(terms.itertuples())
        if a.crossing > GREATEST_CROSSING
    ]
    if not found:
        return []
    many = f"{len(found)} of {terms['crossing'].count()} pairs of neighbouring terms"
    return [
        f"{many if len(found) > 1 else 'Two terms'} can hardly be told apart, for they cross "
        f"above {GREATEST_CROSSING}: {_named(found)}."
    ]


def _named(parts):
    if len(parts) <= _MOST_NAMED:
        return ", ".join(parts)
    return f"{', '.join(parts[:_MOST_NAMED])} and {len(parts) - _MOST_NAMED} more"


def _figure(value):
    """Three digits, and no exponent where a person would write none."""
    return f"{float(f'{value:.3g}'):.10g}"
