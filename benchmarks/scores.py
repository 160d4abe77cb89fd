"""How errors are summed up."""

import numpy as np

__all__ = ["geometric_mean", "in_box", "in_deviations", "median", "rms", "rms_error"]


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def rms_error(model, X, y):
    """RMS of the differences between a model's predictions and what they should be."""
    return rms(model.predict(X) - y)


def in_deviations(squares, y):
    """The RMS error over all rows, from sums of squares, in standard deviations of the target."""
    return float(np.sqrt(np.sum(squares) / len(y)) / y.std())


def geometric_mean(values):
    return float(np.exp(np.mean(np.log(values))))


def median(found, key):
    """Of the figures with this name in a list of dicts."""
    return float(np.median([figures[key] for figures in found]))


def in_box(X_new, X):
    """Which new rows lie within the range of the training rows in every input."""
    return ((X.min(axis=0) <= X_new) & (X_new <= X.max(axis=0))).all(axis=1)
