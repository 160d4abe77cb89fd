"""What stands at the end of pipelines, wrappers and searches."""

from typing import Any

from sklearn.compose import TransformedTargetRegressor
from sklearn.pipeline import Pipeline
from sklearn.utils.validation import check_is_fitted

from ..model import TSKModel
from ..options import policy_of

__all__ = ["described", "found_by_search", "last_step", "model_of", "steps_of", "target_steps"]


def last_step(estimator: Any) -> Any:
    """Return the ANFIS estimator itself at the end of pipelines, wrappers and searches.

    Parameters
    ----------
    estimator : fitted estimator
        As :func:`fold` takes it, but for the steps in front, which may be any.

    Returns
    -------
    last : estimator
        With a ``model_`` of rules.

    Raises
    ------
    TypeError
        If ``estimator`` does not end in an ANFIS estimator.

    Examples
    --------
    >>> from sklearn.model_selection import GridSearchCV
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.export import last_step
    >>> search = GridSearchCV(ANFISRegressor(), {"n_mfs": [2]}, cv=2).fit(*make_jang_sinc())
    >>> last_step(search).model_.n_rules
    4
    """
    label, last = steps_of("", estimator)[-1]
    model_of(label, last)
    return last


def found_by_search(estimator: Any) -> Any:
    """Return the estimator that a search has kept, or one that is no search as it is.

    Parameters
    ----------
    estimator : estimator
        A fitted search such as GridSearchCV, or any other.

    Returns
    -------
    found : estimator
        Its ``best_estimator_``, of a search over searches that of the innermost.

    Examples
    --------
    >>> from sklearn.model_selection import GridSearchCV
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.export import found_by_search
    >>> search = GridSearchCV(ANFISRegressor(), {"n_mfs": [2]}, cv=2).fit(*make_jang_sinc())
    >>> found_by_search(search).n_mfs
    2
    """
    while hasattr(estimator, "best_estimator_"):
        estimator = estimator.best_estimator_
    return estimator


def steps_of(label, estimator):
    """The steps of nested pipelines one after the other, the model's estimator last."""
    estimator = found_by_search(estimator)
    if isinstance(estimator, TransformedTargetRegressor):
        check_is_fitted(estimator)
        return steps_of(label, estimator.regressor_)
    if isinstance(estimator, Pipeline):
        return [part for name, step in estimator.steps for part in steps_of(name, step)]
    return [(label, estimator)]


def target_steps(label, estimator):
    """The transformers of the target from the outermost to the innermost."""
    estimator = found_by_search(estimator)
    if isinstance(estimator, TransformedTargetRegressor):
        return [(label, estimator.transformer_), *target_steps(label, estimator.regressor_)]
    if isinstance(estimator, Pipeline):
        return target_steps(*estimator.steps[-1])
    return []


def model_of(label, estimator):
    """The frozen model of the last step, with the policy that its parameters ask for now."""
    if isinstance(estimator, type) or not hasattr(estimator, "fit"):
        raise TypeError(
            f"estimator must be a fitted ANFIS estimator, a Pipeline that ends in one, or a "
            f"TSKModel; got {estimator!r}."
        )
    model = getattr(estimator, "model_", None)
    if not isinstance(model, TSKModel):
        check_is_fitted(estimator)
        raise TypeError(
            f"estimator must be or end in an ANFIS estimator; {described(label, estimator)} has no "
            "rules."
        )
    if not hasattr(estimator, "out_of_bounds"):
        return model
    return model.with_out_of_bounds(*policy_of(estimator.out_of_bounds))


def described(label, step):
    """A step for a message, by its name and class."""
    return f"step {label!r} ({type(step).__name__})" if label else type(step).__name__
