"""scikit-learn's own checks of the clusterers, without exception."""

import inspect

import pytest
from sklearn.utils.estimator_checks import estimator_checks_generator

from skanfis import cluster

# In the columns of noise that the checks make, all centres of fuzzy c-means coincide, and it says
# so; under this project's settings a warning is an error.
pytestmark = pytest.mark.filterwarnings("ignore:Only:sklearn.exceptions.ConvergenceWarning")

ESTIMATORS = [
    cluster.SubtractiveClustering(),
    cluster.FuzzyCMeans(),
    cluster.FuzzyCMeans(n_clusters=2, m="auto", n_init=1),
]


def name_of(check):
    return getattr(check, "func", check).__name__


# Not parametrize_with_checks: scikit-learn 1.6 hands pytest a generator, of which pytest 9 warns.
@pytest.mark.parametrize(
    ("estimator", "check"),
    [
        pytest.param(clone, check, id=f"{estimator}-{name_of(check)}")
        for estimator in ESTIMATORS
        for clone, check in estimator_checks_generator(estimator)
    ],
)
def test_clusterer_passes_the_checks_of_scikit_learn(estimator, check):
    check(estimator)


def test_every_clusterer_is_checked():
    assert {type(estimator).__name__ for estimator in ESTIMATORS} == set(cluster.__all__)


@pytest.mark.parametrize("name", cluster.__all__)
def test_docstring_describes_every_parameter_and_attribute(name, rng):
    clusterer = getattr(cluster, name)
    heads = [line.strip() for line in clusterer.__doc__.splitlines() if " : " in line]
    described = [name for head in heads for name in head.partition(" : ")[0].split(", ")]
    parameters = list(inspect.signature(clusterer).parameters)
    assert described[: len(parameters)] == parameters
    fitted = clusterer().fit(rng.normal(size=(20, 2)))
    public = {key for key in vars(fitted) if key.endswith("_") and not key.startswith("_")}
    assert public <= set(described)
