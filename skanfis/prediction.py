"""What a fitted estimator predicts, and what it says of rows outside its training data."""

from typing import Any, Literal, overload

import numpy as np
from numpy.typing import ArrayLike

from ._callers import is_silent, pipelines_above
from ._validation import warn_user
from .exceptions import OutOfBoundsWarning
from .export import fold_with_rows, last_step
from .model import TSKModel
from .options import policy_of

__all__ = ["PredictsMixin"]


class PredictsMixin:
    """Adds to the estimator the predictions of its ``model_``, by arrays of any library."""

    # What the estimator brings.
    model_: TSKModel
    out_of_bounds: Any
    _single_output: Any
    _check_inputs: Any

    @overload
    def predict(self, X: ArrayLike, return_std: Literal[False] = False) -> np.ndarray: ...

    @overload
    def predict(self, X: ArrayLike, return_std: Literal[True]) -> tuple[np.ndarray, np.ndarray]: ...

    @overload
    def predict(
        self, X: ArrayLike, return_std: bool
    ) -> np.ndarray | tuple[np.ndarray, np.ndarray]: ...

    def predict(
        self, X: ArrayLike, return_std: bool = False
    ) -> np.ndarray | tuple[np.ndarray, np.ndarray]:
        """Predict the target.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
        return_std : bool, default=False
            Whether to return the standard deviation of a new row of mean weight as well: of the
            noise, the consequents and, by Laplace's method, the premises, in the target's units. It
            is that of the rows' common noise; it takes the structure and the weights of the penalty
            for known. Outside the training range it grows with the distance, whatever the policy;
            where the prediction is NaN, so is it. It is right to a thousandth, mostly to one part
            in ten thousand, which is far better than the noise is known; beyond the range to three
            or four digits. ``model_.standard_deviation(X)`` gives it in double precision, in about
            twice the time.

        Returns
        -------
        y : ndarray of shape (n_samples,) or (n_samples, n_outputs)
        std : ndarray of the shape of y
            Only with ``return_std=True``.

        Raises
        ------
        ValueError
            If X is not finite; or, with ``out_of_bounds="raise"``, lies outside the training data;
            or, with ``return_std=True``, if the model was taken as given and not fitted, or is too
            large to keep the factor of a posterior (2,000 parameters).

        Warns
        -----
        OutOfBoundsWarning
            With ``out_of_bounds="linear"``, if rows lie outside the training data.
        """
        X = self._check_inputs(X)
        model = self.model_.with_out_of_bounds(*policy_of(self.out_of_bounds))
        inside = model.in_bounds(X)
        if return_std:
            outputs, deviations = model.predict_with_deviation(X, inside)
        else:
            outputs = model.predict(X, inside)
        if not inside.all():
            self._warn_out_of_bounds(model, X)
        single = self._single_output
        if return_std:
            return (outputs[:, 0], deviations[:, 0]) if single else (outputs, deviations)
        return outputs[:, 0] if single else outputs

    def _warn_out_of_bounds(self, model, X):
        if model.out_of_bounds == "linear" and not is_silent(OutOfBoundsWarning):
            message = self._describe_out_of_bounds(model, X)
            warn_user(f"{message} Policy: {model.policy}.", OutOfBoundsWarning)

    def _deviations(self, X):
        return self.predict(X, return_std=True)[1]

    def _describe_out_of_bounds(self, model, X):
        """Which columns leave the box: those of the outermost pipeline that can be folded."""
        for pipeline, given in reversed(pipelines_above()):
            try:
                if last_step(pipeline) is self:
                    model, X = fold_with_rows(pipeline, given)
                    break
            except (TypeError, ValueError):
                # A step that mixes columns: the columns that it makes are all that can be named.
                continue
        return model.describe_out_of_bounds(X)
