"""The error during training."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from ..export import last_step
from ..model import TSKModel
from ._display import Display
from .labels import as_label

__all__ = ["LossCurveDisplay"]


@dataclass(kw_only=True, eq=False, repr=False)
class LossCurveDisplay(Display):
    """The error in training, iteration by iteration, and that of the rows held out if any.

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
    line_, validation_line_ : matplotlib Line2D
        The curve, once drawn, and that of the rows held out, dashed, or None.

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
        """
        last = estimator if isinstance(estimator, TSKModel) else last_step(estimator)
        loss = getattr(last, "loss_curve_", None)
        if loss is None:
            raise TypeError(f"{type(last).__name__} has not been trained here: no loss_curve_.")
        solver = getattr(last, "solver", None)
        if name is None and solver is not None:
            name = solver if isinstance(solver, str) else type(solver).__name__
        display = cls(
            loss=np.asarray(loss),
            validation_loss=getattr(last, "validation_loss_curve_", None),
            name=name,
            status=getattr(last, "status_", None),
        )
        return display.plot(ax=ax, **line_kw)

    def plot(self, *, ax: Any = None, **line_kw: Any) -> Self:
        """Draw the curve; parameters are those of :meth:`from_estimator`."""
        axes = self._begin(ax)
        name = None if self.name is None else as_label(self.name)
        style = {"label": name, "marker": ".", "markersize": 4, "linewidth": 1.5} | line_kw
        (self.line_,) = axes.plot(self.loss, **style)
        self.validation_line_ = None
        if self.validation_loss is not None:
            (self.validation_line_,) = axes.plot(
                np.arange(1, len(self.validation_loss) + 1),
                self.validation_loss,
                "--",
                color=self.line_.get_color(),
                linewidth=self.line_.get_linewidth(),
                label=None if name is None else f"{name}, rows held out",
            )
        axes.set(xlabel="iteration", ylabel="mean squared error, standardised target")
        if np.all(self.loss > 0.0):
            axes.set_yscale("log")
        axes.xaxis.get_major_locator().set_params(integer=True)
        axes.grid(True, alpha=0.3)
        if name is not None:
            axes.legend(frameon=False)
        return self
