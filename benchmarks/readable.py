"""How far a fitted model is from what a person reads in its rules."""

from itertools import pairwise

import numpy as np

from .scores import rms

__all__ = ["readability"]


def readability(model, X, y):
    """Figures of a model with Gaussian terms on its training rows.

    "strongest": the strongest rule alone, RMS to the model in deviations of the target. "false" and
    "alike": terms that are nowhere on the rows truer than 0.5, and pairs of a grid's neighbours
    that cross above 0.9; scattered rules have terms of their own, and those may be alike. "cost":
    numerals in the rules' sentences. "text": RMSE of the text over the model's.
    """
    strengths, consequents = model.strengths(X), model.consequents_
    rows = np.arange(X.shape[0])
    outputs = consequents[:, 0] + X @ consequents[:, 1:].T
    alone = outputs[rows, strengths.argmax(axis=1)]
    distance = rms(alone - model.predict(X)) / y.std()
    n_false, n_alike = _terms(model.memberships_, X)
    is_grid = model.model_.antecedent.grid_counts is not None
    return {
        "strongest": distance,
        "false": n_false,
        "alike": n_alike if is_grid else 0,
        "rules": int(model.n_rules_),
        "cost": model.readability_.reading_cost,
        "text": float(model.readability_.summary["text_over_model"]),
    }


def _terms(terms, X):
    """How many are false, and how many pairs alike; the inputs are called x0, x1 and so on."""
    n_false = n_alike = 0
    for j, x in enumerate(X.T):
        mine = sorted((t for t in terms if t["input"] == f"x{j}"), key=lambda t: t["center"])
        n_false += sum(_truth(term, x).max() < 0.5 for term in mine)
        grid = np.linspace(x.min(), x.max(), 1001)
        truths = [_truth(term, grid) for term in mine]
        for left, right in pairwise(truths):
            n_alike += np.minimum(left, right).max() > 0.9
    return int(n_false), int(n_alike)


def _truth(term, x):
    return np.exp(-0.5 * ((x - term["center"]) / term["width"]) ** 2)
