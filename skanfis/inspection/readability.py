"""Whether the rules of a model can be read one by one: figures, tables and sentences."""

from dataclasses import dataclass
from html import escape
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.utils import check_array, check_consistent_length, column_or_1d

from .._validation import check_finite, positive_weights
from ..export.folding import fold_with_reader
from ..learning.penalty import GREATEST_ALONE
from ..membership import GREATEST_CROSSING, LEAST_TRUTH
from ..model import TSKModel
from .measures import Measures, crossings, distinct_terms, measure
from .rules import premise_texts, rules_frame, writable

__all__ = ["Readability", "checked_rows", "readability", "readability_of_rows"]

# Rules of the notebook's table.
_MOST_LINES = 10
# A sentence names so many terms or pairs; beyond, it counts them.
_MOST_NAMED = 5
_NOTHING_FOUND = "Nothing measured here speaks against reading the rules one by one."


@dataclass(frozen=True, eq=False, repr=False)
class Readability:
    """Whether the rules of a model can be read one by one, and what speaks against it.

    :func:`skanfis.inspection.readability` makes it; in a notebook it shows itself. The page "What
    to believe of a rule" of the documentation says what the figures mean.

    Parameters
    ----------
    model : TSKModel
        The model that was measured.
    measures : Measures
        The figures as arrays.

    Attributes
    ----------
    terms : DataFrame
        One row per term, from the lowest to the highest of each input; equal terms count once.
        Columns: "input"; "term", its name; "greatest_truth", its greatest membership on a row;
        "crossing", the height at which it crosses the next, missing for the last.
    rules : DataFrame
        One row per rule and output. Columns: "if", the rule's terms; "output"; "weight", the part
        of the rows' weight on which it fires; "rows", the weight of the rows on which it is the
        strongest; "alone", the RMS difference between its value and the model on these, in standard
        deviations of the target, missing where there are none.
    summary : Series
        "strongest_alone", that difference over all rows, of the worst output; "least_truth" and
        "greatest_crossing" of the terms, missing where there are none, or no two on an input.
    limits : dict
        By entry of ``summary`` the least truth that passes, and the most of the others.
    findings : list of str
        What is not fit to be read, in sentences; an empty list if all is well.
    line : str
        The summary in one line.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import readability
    >>> X, y = make_jang_sinc()
    >>> found = readability(ANFISRegressor(n_mfs=[3, 1], solver="lse").fit(X, y), X, y)
    >>> found.terms[["input", "term"]]
         input    term
    term
    0       x0     low
    1       x0  medium
    2       x0    high
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
        """The terms; see the class."""
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
        return "\n".join(self._lines())

    def _lines(self):
        line = self.line
        return [f"{line[0].upper()}{line[1:]}.", *(self.findings or [_NOTHING_FOUND])]

    def _repr_html_(self):
        rules = self.rules.sort_values("weight", ascending=False, kind="stable")
        parts = [self.html()]
        for table in (self.terms, rules.head(_MOST_LINES)):
            parts.append(f"<div>{table.to_html(float_format=_figure, na_rep='', border=0)}</div>")
        if len(rules) > _MOST_LINES:
            parts.append(f"<div>and {len(rules) - _MOST_LINES} more lines</div>")
        style = "font-family:sans-serif;font-size:90%;margin:0.5em 0"
        return f'<div style="{style}">{"".join(parts)}</div>'

    def html(self) -> str:
        """The summary and the findings as HTML.

        Returns
        -------
        html : str
            A ``<div>`` for each, with names escaped.
        """
        return "".join(f"<div>{escape(line)}</div>" for line in self._lines())


def readability(
    estimator: Any,
    X: ArrayLike,
    y: ArrayLike | None = None,
    *,
    sample_weight: ArrayLike | None = None,
) -> Readability:
    r"""Measure whether the rules can be read one by one, and say what speaks against it.

    The model is the mean of its rules by their strengths, :math:`\hat y = \sum_r w_r f_r`. Nothing
    but the sum need be right: rules may say anything as long as others cancel it. Measured are how
    far the strongest rule of a row lies from the model,

    .. math:: \sqrt{\operatorname{mean} (f_{r^*} - \hat y)^2} \; / \; \mathrm{sd}(y) ,

    how true each term becomes on the rows, and where neighbouring terms cross.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        As :func:`skanfis.export.fold` takes it; scalers are folded into the rules.
    X : array-like of shape (n_samples, n_features)
        Rows, as ``estimator.predict`` takes them. They are read block by block, and may be
        memory-mapped. A row outside the training range is taken at the nearest point in it.
    y : array-like of shape (n_samples,) or (n_samples, n_outputs), default=None
        The target; None takes the standard deviation of the predictions. That of a constant counts
        as one.
    sample_weight : array-like of shape (n_samples,), default=None
        Weights, zero or positive; a whole number counts as so many copies of the row.

    Returns
    -------
    readability : Readability
        With the tables ``terms`` and ``rules``, the ``summary``, and the ``findings`` in sentences,
        an empty list if all is well.

    Raises
    ------
    ValueError
        If X, y or the weights are not finite, of different lengths, or of other columns than in
        training; if weights are negative or leave fewer than two rows; if a step of a pipeline
        cannot be folded.

    See Also
    --------
    ReadabilityDisplay : The same as a picture.

    Examples
    --------
    Rules of a straight line, and the same with 30 added to one and taken from the other:

    >>> from dataclasses import replace
    >>> import numpy as np
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.inspection import readability
    >>> X = np.linspace(0.0, 10.0, 101).reshape(-1, 1)
    >>> y = 2.0 * X[:, 0] + 1.0
    >>> model = ANFISRegressor(n_mfs=2, solver="lse").fit(X, y).model_
    >>> readability(model, X, y).findings
    []
    >>> change = np.zeros_like(model.coefficients)
    >>> change[:, 0, 0] = [30.0, -30.0]
    >>> apart = replace(model, coefficients=model.coefficients + change)
    >>> for sentence in readability(apart, X, y).findings:
    ...     print(sentence)
    No rule can be read without the others: the strongest alone misses the model by ... (limit 0.5).
    """
    model, *rows = checked_rows(estimator, X, y, sample_weight)
    return Readability(model, measure(model, *rows))


def checked_rows(estimator, X, y, sample_weight):
    """The model, and the arguments of :func:`measure`; rows are checked as they are read."""
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
    return model, read, n_rows, y, sample_weight


def readability_of_rows(model, X, y=None, sample_weight=None):
    """Measure a model on arrays that have been checked; X may be memory-mapped."""
    return Readability(model, measure(model, lambda part: X[part], X.shape[0], y, sample_weight))


def _on_truth(terms):
    never = terms[terms["greatest_truth"] < LEAST_TRUTH]
    if never.empty:
        return []
    what = "A term is" if len(never) == 1 else f"{len(never)} of {len(terms)} terms are"
    named = _named(
        f"{line.term!r} of {line.input!r} ({_figure(line.greatest_truth)})"
        for line in never.itertuples(index=False)
    )
    return [f"{what} never truer than {LEAST_TRUTH} on any row: {named}."]


def _on_crossings(terms):
    lines = list(terms.itertuples(index=False))
    pairs = [(a, b) for a, b in pairwise(lines) if a.input == b.input]
    too_high = [(a, b) for a, b in pairs if a.crossing > GREATEST_CROSSING]
    if not too_high:
        return []
    many = f"{len(too_high)} of {len(pairs)} pairs of neighbouring terms"
    named = _named(
        f"{a.term!r} and {b.term!r} of {a.input!r} ({_figure(a.crossing)})" for a, b in too_high
    )
    return [
        f"{many if len(too_high) > 1 else 'Two terms'} can hardly be told apart, for they cross "
        f"above {GREATEST_CROSSING}: {named}."
    ]


def _named(parts):
    parts = list(parts)
    if len(parts) <= _MOST_NAMED:
        return ", ".join(parts)
    return f"{', '.join(parts[:_MOST_NAMED])} and {len(parts) - _MOST_NAMED} more"


def _figure(value):
    """Three digits, and no exponent where a person would write none."""
    return f"{float(f'{value:.3g}'):.10g}"
