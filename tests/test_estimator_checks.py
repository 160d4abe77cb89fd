"""scikit-learn's own checks, on the default and on every family × partition × order."""

from itertools import product

import pytest
from sklearn.cluster import KMeans
from sklearn.utils.estimator_checks import estimator_checks_generator

from skanfis import ANFISRegressor
from skanfis.membership import MEMBERSHIPS

# The checks fit a few random rows, constant columns among them, and predict others. skanfis says
# what is wrong with that; to the checks, and under this project's settings, a warning is an error.
pytestmark = [
    pytest.mark.filterwarnings("ignore::skanfis.exceptions.ConstantInputWarning"),
    pytest.mark.filterwarnings("ignore::skanfis.exceptions.OutOfBoundsWarning"),
    pytest.mark.filterwarnings("ignore::skanfis.exceptions.UnderdeterminedWarning"),
    # Many short fits: MAX_ITER below, and KMeans on fewer distinct rows than clusters.
    pytest.mark.filterwarnings("ignore::sklearn.exceptions.ConvergenceWarning"),
]

# The checks ask about the contract, not about the minimum: fifty checks on a dozen settings.
MAX_ITER = 5
PARTITIONS = {
    "auto": "auto",
    "grid": "grid",
    "kmeans": KMeans(n_clusters=2, n_init=1, random_state=0),
}
# Checks on 10 inputs, the first on 30: a full grid has 2^10 rules or more there. That it is refused
# before any memory is taken is asserted in test_bad_input.py.
TOO_MANY_INPUTS_FOR_A_GRID = {
    "check_sample_weight_equivalence_on_dense_data",
    "check_dtype_object",
    "check_regressors_train",
    "check_regressor_data_not_an_array",
    "check_regressor_multioutput",
    "check_regressors_int",
}


def name_of(check):
    return getattr(check, "func", check).__name__


def estimators():
    """Label, estimator and the names of checks that cannot be asked of it."""
    yield "default", ANFISRegressor(), set()
    for (label, partition), mf, order in product(PARTITIONS.items(), sorted(MEMBERSHIPS), (0, 1)):
        estimator = ANFISRegressor(partition=partition, mf=mf, order=order, max_iter=MAX_ITER)
        left_out = TOO_MANY_INPUTS_FOR_A_GRID if label == "grid" else set()
        yield f"{label}-{mf}-{order}", estimator, left_out


# Not parametrize_with_checks: scikit-learn 1.6 hands pytest a generator, of which pytest 9 warns.
@pytest.mark.parametrize(
    ("estimator", "check"),
    [
        pytest.param(clone, check, id=f"{label}-{name_of(check)}")
        for label, estimator, left_out in estimators()
        for clone, check in estimator_checks_generator(estimator)
        if name_of(check) not in left_out
    ],
)
def test_estimator_passes_the_checks_of_scikit_learn(estimator, check):
    check(estimator)


def test_checks_left_out_for_the_grid_exist():
    known = {name_of(check) for _, check in estimator_checks_generator(ANFISRegressor())}
    assert known >= TOO_MANY_INPUTS_FOR_A_GRID
