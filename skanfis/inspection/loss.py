"""The error during training."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from ..export import last_step
from ..model import TSKModel
from ._common import one_axes
from .labels import as_label

__all__ = ["LossCurveDisplay"]


@dataclass(kw_only=True, eq=False, repr=False)
class LossCurveDisplay:
    """The error in training, iteration by iteration, and that of the rows held out if any.

    Make it with :meth:`from_estimator`; parameters are stored as attributes.

    Parameters
    ----------
    loss : ndarray of shape (n_iter + 1,)
        Mean squared error of the standardised target: 1 is as good as the mean.
    validation_loss : ndarray of shape (n_iter,), default=None
        That of the rows held out for early stopping, from the first iteration on.
    name : str, default=None
        Label of the curve.
    status : str, default=None
        Why training stopped.

    Attributes
    ----------
    figure_, ax_ : matplotlib Figure, matplotlib Axes
        Once drawn.
    line_ : matplotlib Line2D
        The curve, once drawn.
    validation_line_ : matplotlib Line2D or None
        That of the rows held out, dashed in the same colour.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import LossCurveDisplay
    >>> X, y = make_jang_sinc()
    >>> model = ANFISRegressor(n_mfs=3, solver="hybrid", max_iter=50).fit(X, y)
    >>> display = LossCurveDisplay.from_estimator(model)
    >>> bool(display.loss[-1] < display.loss[0])
    True
    """

    loss: np.ndarray
    validation_loss: np.ndarray | None = None
    name: str | None = None
    status: str | None = None

    @classmethod
    def from_estimator(
        cls, estimator: Any, *, name: str | None = None, ax: Any = None, **line_kw: Any
    ) -> Self:
        """Draw the training error of a fitted estimator.

        Parameters
        ----------
        estimator : fitted estimator
            As :func:`skanfis.export.last_step` takes it; a model alone remembers no training.
        name : str, default=None
            Label of the curve; None is the solver's name.
        ax : matplotlib Axes, default=None
            Where to draw; None makes a figure. Curves of several estimators can share axes.
        **line_kw : dict
            For matplotlib's ``plot``.

        Returns
        -------
        display : LossCurveDisplay

        Raises
        ------
        TypeError
            If ``estimator`` has no rules, or has not been trained here.
        ImportError
            Without matplotlib.
        """
        last = estimator if isinstance(estimator, TSKModel) else last_step(estimator)
        loss = getattr(last, "loss_curve_", None)
        if loss is None:
            raise TypeError(f"{type(last).__name__} has not been trained here: no loss_curve_.")
        display = cls(
            loss=np.asarray(loss),
            validation_loss=getattr(last, "validation_loss_curve_", None),
            name=_solver_of(last) if name is None else name,
            status=getattr(last, "status_", None),
        )
        return display.plot(ax=ax, **line_kw)

    def plot(self, *, ax: Any = None, **line_kw: Any) -> Self:
        """Draw the curve.

        Parameters
        ----------
        ax, **line_kw
            As :meth:`from_estimator` takes them.

        Returns
        -------
        display : LossCurveDisplay
        """
        self.ax_ = one_axes(ax)
        self.figure_ = self.ax_.figure
        iterations = np.arange(len(self.loss))
        name = None if self.name is None else as_label(self.name)
        style = {"label": name, "marker": ".", "markersize": 4, "linewidth": 1.5} | line_kw
        (self.line_,) = self.ax_.plot(iterations, self.loss, **style)
        self.validation_line_ = None
        if self.validation_loss is not None:
            (self.validation_line_,) = self.ax_.plot(
                np.arange(1, len(self.validation_loss) + 1),
                self.validation_loss,
                "--",
                color=self.line_.get_color(),
                linewidth=self.line_.get_linewidth(),
                label=None if name is None else f"{name}, rows held out",
            )
        self.ax_.set(xlabel="iteration", ylabel="mean squared error, standardised target")
        if np.all(self.loss > 0.0):
            self.ax_.set_yscale("log")
        self.ax_.xaxis.get_major_locator().set_params(integer=True)
        self.ax_.grid(True, alpha=0.3)
        if self.name is not None:
            self.ax_.legend(frameon=False)
        return self


def _solver_of(estimator):
    """The solver's word, or the class of the object that is given in its place."""
    solver = getattr(estimator, "solver", None)
    return solver if solver is None or isinstance(solver, str) else type(solver).__name__
