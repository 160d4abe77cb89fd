"""How far a fitted model is from what a person reads in its rules."""

from itertools import pairwise

import numpy as np

__all__ = ["readability"]


def readability(model, X, y):
    """Figures of a model with Gaussian terms on its training rows.

    "strongest": the strongest rule alone, RMS to the model in deviations of the target. "false" and
    "alike": terms that are nowhere on the rows truer than 0.5, and pairs of neighbours that cross
    above 0.9. "cost": numerals in the rules' sentences. "text": RMSE of the text over the model's.
    """
    strengths, consequents = model.strengths(X), model.consequents_
    rows = np.arange(X.shape[0])
    outputs = consequents[:, 0] + X @ consequents[:, 1:].T
    alone = outputs[rows, strengths.argmax(axis=1)]
    distance = np.sqrt(np.mean((alone - model.predict(X)) ** 2)) / y.std()
    n_false, n_alike = _terms(model.memberships_, X, list(_names(model)))
    return {
        "strongest": float(distance),
        "false": n_false,
        "alike": n_alike,
        "rules": int(model.n_rules_),
        "cost": model.readability_.reading_cost,
        "text": float(model.readability_.summary["text_over_model"]),
    }


def _names(model):
    names = getattr(model, "feature_names_in_", None)
    return [f"x{j}" for j in range(model.n_features_in_)] if names is None else names


def _terms(terms, X, names):
    n_false = n_alike = 0
    for j, name in enumerate(names):
        mine = sorted((t for t in terms if t["input"] == name), key=lambda t: t["center"])
        n_false += sum(_truth(term, X[:, j]).max() < 0.5 for term in mine)
        grid = np.linspace(X[:, j].min(), X[:, j].max(), 1001)
        truths = [_truth(term, grid) for term in mine]
        for left, right in pairwise(truths):
            n_alike += np.minimum(left, right).max() > 0.9
    return int(n_false), int(n_alike)


def _truth(term, x):
    return np.exp(-0.5 * ((x - term["center"]) / term["width"]) ** 2)
