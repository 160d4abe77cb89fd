"""Questions to the last step of a Pipeline, about rows as the Pipeline takes them."""

from sklearn.pipeline import Pipeline

__all__ = ["ask"]


def ask(estimator, method, X):
    """``estimator.method(X)``, or for a Pipeline that of its last step for what it is given."""
    if isinstance(estimator, Pipeline):
        X = estimator[:-1].transform(X) if len(estimator) > 1 else X
        return ask(estimator[-1], method, X)
    if not hasattr(estimator, method):
        raise ValueError(f"{type(estimator).__name__} has no method {method!r}.")
    return getattr(estimator, method)(X)
