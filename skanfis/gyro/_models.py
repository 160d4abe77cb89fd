"""The models of a calibration: law, rules, and what is simpler than rules."""

from sklearn.linear_model import LinearRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler

from .. import ANFISRegressor
from ..options import LinearExtrapolation
from .compose import ResidualRegressor
from .physics import OpenLoopArcsineRegressor

__all__ = ["make_estimator", "make_law", "make_law_and_line", "make_polynomial"]

# Of law and rules by turns: what dies away after power-on would bend the law that is fitted first.
_ROUNDS = 3


def make_estimator(recipe, choice):
    """The estimator of a recipe; ``choice`` is the degree of the law and the numbers of terms."""
    degree, terms = choice
    outside = recipe.outside
    if outside == "linear":
        outside = LinearExtrapolation(recipe.max_extrapolation)
    anfis = ANFISRegressor(
        "auto" if terms is None else list(terms), out_of_bounds=outside, n_jobs=recipe.n_jobs
    )
    pipeline = make_pipeline(StandardScaler(), anfis)
    if not recipe.physics:
        return pipeline
    law = make_law(recipe.inputs, degree, recipe.outside)
    return ResidualRegressor(law, pipeline, n_rounds=_ROUNDS)


def make_law(inputs, degree, outside):
    """The arcsine law on the inputs that it can use."""
    knows_lag = {"temperature", "temperature_rate"} <= set(inputs)
    return OpenLoopArcsineRegressor(
        "output",
        "temperature" if "temperature" in inputs else None,
        # The lag of the thermometer is part of the law where it can be known.
        temperature_rate="temperature_rate" if knows_lag else None,
        amplitude_degree=degree,
        bias_degree=degree,
        out_of_bounds=outside,
    )


def make_law_and_line(inputs):
    """The law and a straight line in all inputs, in turns, as a single rule beside it is fitted."""
    law = make_law(inputs, 1, "linear")
    return ResidualRegressor(law, make_polynomial(1), n_rounds=_ROUNDS)


def make_polynomial(degree):
    """All products of the inputs up to a degree."""
    return make_pipeline(
        StandardScaler(), PolynomialFeatures(degree, include_bias=False), LinearRegression()
    )
