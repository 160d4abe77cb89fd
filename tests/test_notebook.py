"""A fitted estimator shows its rules below scikit-learn's diagram."""

import numpy as np
from sklearn import config_context

from skanfis import ANFISRegressor
from skanfis.inspection import rules_html


def test_representation_of_a_fitted_estimator_has_the_rules():
    X = np.linspace(0, 1, 20)[:, None]
    estimator = ANFISRegressor(n_mfs=2, solver="lse")
    for show in (
        lambda: estimator._repr_html_(),
        lambda: estimator._repr_mimebundle_()["text/html"],
    ):
        assert "<b>2 rules</b>" not in show()
        assert "sk-container" in show()
    estimator.fit(X, X[:, 0])
    rules = rules_html(estimator)
    assert "<b>2 rules</b>" in rules
    assert estimator._repr_html_().endswith(rules)
    assert estimator._repr_mimebundle_()["text/html"].endswith(rules)
    assert "sk-container" in estimator._repr_html_()


def test_no_html_where_text_is_asked_for():
    X = np.linspace(0, 1, 20)[:, None]
    estimator = ANFISRegressor(n_mfs=2, solver="lse").fit(X, X[:, 0])
    with config_context(display="text"):
        assert not hasattr(estimator, "_repr_html_")
        assert list(estimator._repr_mimebundle_()) == ["text/plain"]
