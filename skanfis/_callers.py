"""What the calls above know: whether a cross-validation is running, what the user calls a column.

An estimator inside a Pipeline sees scaled columns without names, and one inside a cross-validation
predicts rows that were left out on purpose. Neither is told to it. The frames of the calls above
say it, and are read only where there is something to warn of.
"""

import sys
import warnings
from types import FrameType

from sklearn.pipeline import Pipeline

__all__ = ["is_silent", "names_in_pipeline", "pipelines_above"]

# The functions of cross_validate, cross_val_predict and every search run in this module.
_CROSS_VALIDATION = "sklearn.model_selection._validation"
_PACKAGE = "skanfis"


def is_silent(category):
    """Whether a warning of this package is not worth a word: it comes from a cross-validation.

    What is left out of a fold leaves the range of the rest, or a column of it constant, fold after
    fold. A search would say so for every candidate and fold, and about none that is kept; the fit
    to all rows says what holds of that. A filter that names the category, or another of this
    package, asks for every single one: ``warnings.simplefilter("always", OutOfBoundsWarning)``.
    Categories of others, such as ConvergenceWarning, are never silent.
    """
    if not _is_own(category):
        return False
    named = [entry[2] for entry in warnings.filters if _is_own(entry[2])]
    asked = any(issubclass(category, one) for one in named)
    return not asked and any(_module(frame) == _CROSS_VALIDATION for frame in _frames())


def pipelines_above():
    """Pipelines whose methods are being called, from the innermost, with the X each was given."""
    return [
        (frame.f_locals["self"], frame.f_locals.get("X"))
        for frame in _frames()
        if _module(frame) == "sklearn.pipeline" and isinstance(frame.f_locals.get("self"), Pipeline)
    ]


def names_in_pipeline(names):
    """What the steps in front, in the pipeline being fitted, call the columns; None without one.

    Parameters
    ----------
    names : sequence of str
        What the estimator at the end calls them.
    """
    for pipeline, X in pipelines_above()[:1]:
        if len(pipeline) < 2:
            continue
        try:
            found = pipeline[:-1].get_feature_names_out(getattr(X, "columns", None))
        except (AttributeError, TypeError, ValueError):
            # Not every step can say what it puts out.
            return None
        return [str(name) for name in found] if len(found) == len(names) else None
    return None


def _frames():
    """The frames of the calls above, from the caller of whoever asks."""
    frame: FrameType | None = sys._getframe(2)
    while frame is not None:
        yield frame
        frame = frame.f_back


def _module(frame):
    return frame.f_globals.get("__name__", "")


def _is_own(category):
    # A filter's category may be a tuple of several.
    return isinstance(category, type) and category.__module__.partition(".")[0] == _PACKAGE
