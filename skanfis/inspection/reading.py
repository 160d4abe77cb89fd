"""Whether the rules of a fitted estimator can be read one by one: in figures, and as a picture."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.utils import check_array, check_consistent_length, column_or_1d

from .._validation import check_count, check_finite, positive_weights
from ..export import fold_with_reader
from ._common import panels, position
from .findings import GREATEST_ALONE, GREATEST_CROSSING, LEAST_TRUTH
from .measures import Source, measure
from .readability import Readability
from .readable_terms import own_terms
from .table import rule_values
from .text import range_text

__all__ = ["Readability", "ReadabilityDisplay", "readability"]

_BLUE, _RED = "#0072b2", "#c1272d"
# Of the left panel, in bands: half the height of one, and what the name of an input takes.
_HALF_BAND, _ROOM_FOR_INPUT = 0.36, 1.1


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

    .. math:: \sqrt{\operatorname{mean} (f_{r^*} - \hat y)^2} \; / \; \mathrm{sd} ,

    their disagreement,

    .. math:: \sqrt{\operatorname{mean} \sum_r w_r (f_r - \hat y)^2} \; / \; \mathrm{sd} ,

    the greatest :math:`\sum_r |w_r (f_r - m)|` over the target's range, with m and sd its mean and
    standard deviation, what each rule says at its own center, how true each term becomes on the
    rows, and where neighbouring terms cross.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        As :func:`skanfis.export.fold` takes it; scalers are folded into the rules.
    X : array-like of shape (n_samples, n_features)
        Rows, as ``estimator.predict`` takes them. They are read block by block, and may be
        memory-mapped. A row outside the training range is taken at the nearest point in it.
    y : array-like of shape (n_samples,) or (n_samples, n_outputs), default=None
        The target, of which mean, standard deviation and range are taken; None takes those of the
        predictions. A constant target counts as having a standard deviation and a range of one.
    sample_weight : array-like of shape (n_samples,), default=None
        Weights, zero or positive; a whole number counts as so many copies of the row.

    Returns
    -------
    readability : Readability
        With the tables ``terms``, ``rules`` and ``outputs``, the ``summary``, and the ``findings``
        in sentences, an empty list if all is well.

    Raises
    ------
    ValueError
        If X, y or the weights are not finite, of different lengths, or of other columns than in
        training; if weights are negative or leave fewer than two rows; if a step of a pipeline
        cannot be folded.
    TypeError
        If ``estimator`` has no rules.

    See Also
    --------
    ReadabilityDisplay : The same as a picture.
    skanfis.inspection.explain : What each rule contributes to given rows.

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
    2 of 2 rules say where they fire what the target never was, beyond its range by more than ...
    """
    model, source = _source(estimator, X, y, sample_weight)
    return Readability(model, measure(model, source))


def _source(estimator, X, y, sample_weight):
    """The model, and the rows, checked as they are read."""
    model, reader = fold_with_reader(estimator)
    n_rows = X.shape[0] if hasattr(X, "shape") else len(X)
    take = getattr(X, "iloc", X)

    def read(part):
        try:
            return reader(take[part])
        except ValueError:
            # The whole table: the error then tells the row by its place in it.
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
    return model, Source(n_rows, read, y, sample_weight)


@dataclass(kw_only=True, eq=False, repr=False)
class ReadabilityDisplay:
    """Terms as bands with their greatest truth; the strongest rule alone against the model.

    On the left a band for every term, along the range of its input: the darker, the truer the term
    is there. The number beside it is the greatest truth on the rows. Red is what cannot be read: a
    term that is hardly true anywhere, neighbours that can hardly be told apart. On the right every
    point is a row: what the strongest rule says there alone, over what all rules say together.
    Where the rules can be read one by one, points lie along the diagonal; the target's range is
    grey.

    Make it with :meth:`from_estimator`; parameters are stored as attributes.

    Parameters
    ----------
    readability : Readability
        The figures.
    memberships : ndarray of shape (n_distinct_terms, n_points)
        Each term of ``readability.terms`` along the range of its input in training.
    predictions, alone : ndarray of shape (n_shown_rows,)
        What all rules, and what the strongest says, on some of the rows.
    output : int
        Position of the output.

    Attributes
    ----------
    figure_, axes_ : matplotlib Figure, ndarray of matplotlib Axes of shape (2,)
        The figure and its panels, once drawn.

    See Also
    --------
    readability : The figures without the picture.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import ReadabilityDisplay
    >>> X, y = make_jang_sinc()
    >>> model = ANFISRegressor(n_mfs=[4, 1]).fit(X, y)
    >>> display = ReadabilityDisplay.from_estimator(model, X, y)
    >>> display.memberships.shape, display.alone.shape
    ((4, 201), (121,))
    """

    readability: Any
    memberships: np.ndarray
    predictions: np.ndarray
    alone: np.ndarray
    output: int

    @classmethod
    def from_estimator(
        cls,
        estimator: Any,
        X: ArrayLike,
        y: ArrayLike | None = None,
        *,
        sample_weight: ArrayLike | None = None,
        output: int | str = 0,
        n_points: int = 201,
        max_rows: int = 2000,
        colormap: str = "Blues",
        ax: Any = None,
    ) -> Self:
        """Draw how the rules of a fitted estimator can be read.

        Parameters
        ----------
        estimator : fitted estimator or TSKModel
            As :func:`skanfis.export.fold` takes it.
        X, y, sample_weight : array-like
            As :func:`readability` takes them.
        output : int or str, default=0
            Which output the right panel shows, by position or name.
        n_points : int, default=201
            Points along each band, 2 or more.
        max_rows : int, default=2000
            Most points on the right, evenly chosen, 1 or more; the figures are of all rows.
        colormap : str, default="Blues"
            Colours of the bands, for truth from 0 to 1.
        ax : sequence of 2 matplotlib Axes or matplotlib Axes, default=None
            Where to draw: None makes a figure; one axes is divided.

        Returns
        -------
        display : ReadabilityDisplay

        Raises
        ------
        ValueError
            If X or y do not go with the model.
        TypeError
            If ``estimator`` has no rules.
        ImportError
            Without matplotlib.
        """
        check_count("n_points", n_points, 2)
        check_count("max_rows", max_rows, 1)
        model, source = _source(estimator, X, y, sample_weight)
        k = position(output, model.output_names, "output")
        found = Readability(model, measure(model, source))
        shown = slice(None, None, -(-source.n_rows // max_rows))
        rows = np.clip(source.read(shown), model.minimum, model.maximum)
        if source.sample_weight is not None:
            rows = rows[source.sample_weight[shown] > 0.0]
        strengths, values = model.strengths(rows), rule_values(model, rows)[:, :, k]
        display = cls(
            readability=found,
            memberships=_bands(model, n_points),
            predictions=np.sum(strengths * values, axis=1),
            alone=values[np.arange(len(rows)), strengths.argmax(axis=1)],
            output=k,
        )
        return display.plot(colormap=colormap, ax=ax)

    def plot(self, *, colormap: str = "Blues", ax: Any = None) -> Self:
        """Draw the picture.

        Parameters
        ----------
        colormap, ax
            As :meth:`from_estimator` takes them.

        Returns
        -------
        display : ReadabilityDisplay
        """
        height = np.clip(1.4 + 0.34 * len(self.memberships), 3.8, 12.0)
        self.axes_ = panels(ax, 2, width=5.4, height=height)
        self.figure_ = self.axes_[0].figure
        self._draw_terms(self.axes_[0], colormap)
        self._draw_rules(self.axes_[1])
        return self

    def _draw_terms(self, axes, colormap):
        terms = self.readability.terms
        model = self.readability.model
        places, places_of_inputs, place, last = [], {}, 0.0, None
        for name in terms["input"]:
            if name != last:
                place += _ROOM_FOR_INPUT
                places_of_inputs[name], last = place - 0.62, name
            places.append(place)
            place += 1.0
        for y, curve in zip(places, self.memberships, strict=True):
            axes.imshow(
                curve[None],
                extent=(0.0, 1.0, y + _HALF_BAND, y - _HALF_BAND),
                cmap=colormap,
                vmin=0.0,
                vmax=1.0,
                aspect="auto",
            )
            axes.plot(
                [0.0, 1.0, 1.0, 0.0, 0.0],
                y + _HALF_BAND * np.array([-1, -1, 1, 1, -1]),
                color="0.8",
                linewidth=0.8,
            )
        self._mark_terms(axes, places)
        for name, y in places_of_inputs.items():
            j = model.input_names.index(name)
            low, high = range_text(model, j, 4)
            axes.text(0.0, y, low, ha="left", va="center", fontsize="small", color="0.4")
            axes.text(1.0, y, high, ha="right", va="center", fontsize="small", color="0.4")
            axes.text(0.5, y, name, ha="center", va="center", fontweight="bold")
        if not places:
            axes.text(0.5, 0.5, "no terms", ha="center", color="0.4")
        axes.set_yticks(places, terms["term"])
        axes.set_xticks([])
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
        axes.set_xlim(0.0, 1.12)
        axes.set_ylim(max(place, 1.0), 0.0)
        axes.set_title("terms, and their greatest truth on the rows", fontsize="medium", loc="left")

    def _mark_terms(self, axes, places):
        """Each term's greatest truth beside its band, and where neighbours cross too high."""
        terms = self.readability.terms
        for y, truth, height in zip(
            places, terms["greatest_truth"], terms["crossing"], strict=True
        ):
            bad = truth < LEAST_TRUTH
            axes.text(1.02, y, f"{truth:.2f}", va="center", color=_RED if bad else "0.2")
            if height > GREATEST_CROSSING:
                axes.text(
                    0.5,
                    y + 0.5,
                    f" cross at {height:.2f} ",
                    ha="center",
                    va="center",
                    fontsize="small",
                    color=_RED,
                    bbox={"color": "white", "pad": 0.5},
                )

    def _draw_rules(self, axes):
        found, k = self.readability.measures, self.output
        name = self.readability.model.output_names[k]
        error = found.alone[k]
        seen = np.concatenate([self.predictions, self.alone])
        axes.axhspan(found.low[k], found.high[k], color="0.93", zorder=0)
        ends = [self.predictions.min(), self.predictions.max()]
        axes.plot(ends, ends, color="0.3", linewidth=1.0)
        axes.scatter(self.predictions, self.alone, s=9, alpha=0.5, linewidths=0.0, color=_BLUE)
        margin = 0.05 * np.ptp([*seen, found.low[k], found.high[k]])
        if margin > 0.0:
            axes.set_ylim(
                min(seen.min(), found.low[k]) - margin, max(seen.max(), found.high[k]) + margin
            )
        axes.set(
            xlabel=f"{name}: all rules (grey: range of the target)",
            ylabel=f"{name}: strongest rule alone",
        )
        axes.spines[["top", "right"]].set_visible(False)
        axes.set_title(
            f"strongest rule alone: off by {error:.3g} sd of the target",
            fontsize="medium",
            loc="left",
            color=_RED if error > GREATEST_ALONE else "black",
        )


def _bands(model, n_points):
    """Each distinct term along the range of its input, (n_distinct_terms, n_points)."""
    steps = np.linspace(0.0, 1.0, n_points)
    # Every input along its own range at once: a term looks at one input alone.
    Z = model.minimum[:, None] + (model.maximum - model.minimum)[:, None] * steps
    return np.exp(model.antecedent.log_memberships(Z)[own_terms(model.antecedent)])
