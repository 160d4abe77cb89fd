"""What the measures say to a reader: tables, and a line."""

from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ..model import TSKModel
from .findings import (
    GREATEST_ALONE,
    GREATEST_BEYOND,
    GREATEST_CROSSING,
    GREATEST_SUM,
    GREATEST_WORDLESS,
    LEAST_TRUTH,
    capital,
    figure,
    findings,
)
from .measures import Measures, Source, measure
from .readable_terms import crossings, distinct_terms, own_terms

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Readability", "readability_of_rows"]

# Lines of the notebook's table of rules.
_MOST_LINES = 10


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
        One row per term, from the lowest to the highest of each input, labelled by its number; of
        terms that are the very same, the first. Columns: "input"; "term", its name;
        "greatest_truth", its greatest membership on a row; "crossing", the greatest value of the
        smaller of its membership and the next one's between the two locations, missing for the
        last. Both are from 0 to 1.
    inputs : DataFrame
        One row per input that has terms, labelled by its name. Columns: "terms", their number;
        "wordless", the part of the rows' weight on which none of them is truer than 0.5.
    rules : DataFrame
        One row per rule, labelled by its number, and output. Columns: "if", the rule's terms;
        "output"; "weight", the part of the rows' weight on which it fires; "rows", the weight of
        the rows on which it is the strongest; "alone", the RMS difference between its value and the
        model on these, missing where there are none, and "disagreement", the same over all rows by
        its strength, both in standard deviations of the target; "value", what it says at its own
        center, in the target's units; "in_range", whether that lies in the range of the target;
        "beyond", how far beyond it lies, in ranges. The last three are missing where a rule fires
        on no row.
    outputs : DataFrame
        One row per output, of all rules together. Columns: "strongest_alone", the RMS difference
        between the strongest rule of each row and the model, and "disagreement", that of a rule
        drawn by its strength, in standard deviations of the target; "greatest_sum", the greatest
        sum over the rules of the sizes of strength times value about the target's mean, in ranges
        of the target; "rules_beyond", the number of rules whose value at their own center lies
        beyond the target's range by more than a quarter of it.
    summary : Series
        The worst of each column of ``outputs``; "least_truth" and "greatest_crossing" of the terms
        and "wordless" of the inputs, missing where there are no terms, or no two on an input.
    findings : list of str
        What is not fit to be read, in sentences; an empty list if all is well.
    line : str
        The summary in one line.
    limits : dict
        By entry of ``summary`` the least truth that passes, and the most of all else.

    See Also
    --------
    skanfis.inspection.readability : Measures a fitted estimator on rows.
    skanfis.inspection.ReadabilityDisplay : The same as a picture.

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
    >>> isinstance(found.findings, list)
    True
    """

    model: TSKModel
    measures: Measures

    #: By entry of :attr:`summary`: the least truth that passes, the most of all else.
    limits: ClassVar[dict] = {
        "strongest_alone": GREATEST_ALONE,
        "greatest_sum": GREATEST_SUM,
        "rules_beyond": 0,
        "least_truth": LEAST_TRUTH,
        "greatest_crossing": GREATEST_CROSSING,
        "wordless": GREATEST_WORDLESS,
    }

    @property
    def terms(self) -> "pd.DataFrame":
        """The terms; see the class."""
        import pandas as pd

        own = own_terms(self.model.antecedent)
        inputs, names = self.model.antecedent.term_inputs, self.model.term_names
        return pd.DataFrame(
            {
                "input": [self.model.input_names[inputs[t]] for t in own],
                "term": [names[t] for t in own],
                "greatest_truth": self.measures.truth[own],
                "crossing": crossings(self.model.antecedent)[own],
            },
            index=pd.Index(own, name="term", dtype=int),
        )

    @property
    def inputs(self) -> "pd.DataFrame":
        """The inputs that have terms; see the class."""
        import pandas as pd

        terms = distinct_terms(self.model.antecedent)
        return pd.DataFrame(
            {
                "terms": [len(own) for own in terms.values()],
                "wordless": self.measures.wordless[list(terms)],
            },
            index=pd.Index([self.model.input_names[j] for j in terms], name="input", dtype=object),
        )

    @property
    def rules(self) -> "pd.DataFrame":
        """The rules; see the class."""
        import pandas as pd

        from .rules import conditions, premise_text

        found, model = self.measures, self.model
        texts = [premise_text(model, rule) for rule in conditions(model)]
        tables = []
        for k, output in enumerate(model.output_names):
            beyond = pd.Series(found.rule_beyond[:, k])
            table = pd.DataFrame(
                {
                    "if": texts,
                    "output": output,
                    "weight": found.rule_weights,
                    "rows": found.rule_rows,
                    "alone": found.rule_alone[:, k],
                    "disagreement": found.rule_disagreement[:, k],
                    "value": found.mean[k] + found.deviation[k] * found.rule_values[:, k],
                    "in_range": (beyond == 0.0).astype("boolean").mask(beyond.isna()),
                    "beyond": beyond,
                },
                index=pd.RangeIndex(model.n_rules, name="rule"),
            )
            tables.append(table)
        return pd.concat(tables).sort_index(kind="stable")

    @property
    def outputs(self) -> "pd.DataFrame":
        """What holds of all rules together; see the class."""
        import pandas as pd

        found = self.measures
        return pd.DataFrame(
            {
                "strongest_alone": found.alone,
                "disagreement": found.disagreement,
                "greatest_sum": found.greatest_sum,
                "rules_beyond": (found.rule_beyond > GREATEST_BEYOND).sum(axis=0),
            },
            index=pd.Index(self.model.output_names, name="output"),
        )

    @property
    def summary(self) -> "pd.Series":
        """The worst of each figure, over terms and outputs."""
        import pandas as pd

        return pd.Series(self._summary(), name="readability")

    @property
    def findings(self) -> list[str]:
        """What is not fit to be read, in sentences; an empty list if all is well."""
        return findings(self.model, self.measures)

    @property
    def line(self) -> str:
        """The summary as one line of text."""
        found = self._summary()
        parts = [
            f"strongest rule alone {figure(found['strongest_alone'])} sd off the model",
            f"disagreement {figure(found['disagreement'])} sd",
            f"greatest sum {figure(found['greatest_sum'])} ranges",
        ]
        if np.isfinite(found["least_truth"]):
            parts.append(f"least true term {figure(found['least_truth'])}")
        if np.isfinite(found["greatest_crossing"]):
            parts.append(f"highest crossing {figure(found['greatest_crossing'])}")
        if np.isfinite(found["wordless"]):
            parts.append(f"rows on which no term of an input is true {found['wordless']:.1%}")
        return "; ".join(parts)

    def __repr__(self):
        return f"<Readability of {self.model!r}: {self.line}>"

    def __str__(self):
        return "\n".join([capital(self.line) + ".", *(self.findings or [_ALL_IS_WELL])])

    def _repr_html_(self):
        rules = self.rules.sort_values("weight", ascending=False, kind="stable")
        tables = [self.terms, self.inputs, rules.head(_MOST_LINES)]
        left_out = len(rules) - _MOST_LINES
        more = f"<div>and {left_out} more lines</div>" if left_out > 0 else ""
        return (
            '<div style="font-family:sans-serif;font-size:90%;margin:0.5em 0">'
            + self.html()
            + "".join(_table(table) for table in tables)
            + f"{more}</div>"
        )

    def html(self) -> str:
        """The summary and the findings as HTML.

        Returns
        -------
        html : str
            A ``<div>`` for each, with names escaped.
        """
        lines = [capital(self.line) + ".", *(self.findings or [_ALL_IS_WELL])]
        return "".join(f"<div>{escape(line)}</div>" for line in lines)

    def _summary(self):
        found = self.measures
        own = own_terms(self.model.antecedent)
        heights = crossings(self.model.antecedent)
        heights = heights[np.isfinite(heights)]
        return {
            "strongest_alone": float(found.alone.max()),
            "disagreement": float(found.disagreement.max()),
            "greatest_sum": float(found.greatest_sum.max()),
            "rules_beyond": int((found.rule_beyond > GREATEST_BEYOND).sum(axis=0).max()),
            "least_truth": float(found.truth[own].min()) if own.size else np.nan,
            "greatest_crossing": float(heights.max()) if heights.size else np.nan,
            "wordless": float(np.nanmax(found.wordless)) if own.size else np.nan,
        }


_ALL_IS_WELL = "Nothing measured here speaks against reading the rules one by one."


def readability_of_rows(model, X, y=None, sample_weight=None):
    """Measure a model on rows that have been checked.

    Parameters
    ----------
    model : TSKModel
    X : ndarray of shape (n_rows, model.n_inputs)
        Finite; may be memory-mapped.
    y : ndarray of shape (n_rows, model.n_outputs), default=None
        The target, for its mean, deviation and range; None takes those of the predictions.
    sample_weight : ndarray of shape (n_rows,), default=None
        Zero or positive, one of them positive.

    Returns
    -------
    readability : Readability
        After one pass over X, or two where there is no y.
    """
    source = Source(X.shape[0], lambda part: X[part], y, sample_weight)
    return Readability(model, measure(model, source))


def _table(table):
    return f"<div>{table.to_html(float_format=figure, na_rep='', border=0)}</div>"
