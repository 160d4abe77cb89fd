"""scikit-learn's own checks: the default, every partition, every family and every solver."""

import pytest
from sklearn.cluster import KMeans
from sklearn.utils.estimator_checks import estimator_checks_generator

from skanfis import ANFISRegressor
from skanfis.membership import MEMBERSHIPS
from skanfis.options import EarlyStopping, LinearExtrapolation
from skanfis.solvers import SOLVERS, VariableProjection

# The checks fit a few random rows, constant columns among them, and predict others. skanfis says
# what is wrong with that; to the checks, and under this project's settings, a warning is an error.
pytestmark = [
    pytest.mark.filterwarnings("ignore::skanfis.exceptions.ConstantInputWarning"),
    # A check calls partial_fit after fit.
    pytest.mark.filterwarnings("ignore::skanfis.exceptions.ForgottenRowsWarning"),
    pytest.mark.filterwarnings("ignore::skanfis.exceptions.OutOfBoundsWarning"),
    pytest.mark.filterwarnings("ignore::skanfis.exceptions.UnderdeterminedWarning"),
    # Many short fits: MAX_ITER below, and KMeans on fewer distinct rows than clusters.
    pytest.mark.filterwarnings("ignore::sklearn.exceptions.ConvergenceWarning"),
]

# The checks ask about the contract, not about the minimum.
MAX_ITER = 5
KMEANS = KMeans(n_clusters=2, n_init=1, random_state=0)


def estimators():
    """Label and estimator.

    Families, solvers and partitions do not know of each other: each is seen, and either order with
    both grids and clusters, but not every combination, which would be 300 times fifty checks. Nor
    is the structure sought every time, at some dozens of fits each. warm_start is not here: the
    checks fit one estimator twice and expect the same, which it is there to prevent.
    """
    yield "default", ANFISRegressor()
    yield "auto, order 0", ANFISRegressor(order=0, mf="bell", max_iter=MAX_ITER)
    for partition in ("grid", "subtractive", "fcm"):
        yield partition, ANFISRegressor(partition=partition, max_iter=MAX_ITER)
    for place, mf in enumerate(sorted(MEMBERSHIPS)):
        settings = {"mf": mf, "order": place % 2, "max_iter": MAX_ITER}
        yield mf, ANFISRegressor(partition=KMEANS, **settings)
    for solver in sorted(set(SOLVERS) - {"varpro"}):
        yield solver, ANFISRegressor(partition=KMEANS, solver=solver, max_iter=MAX_ITER)
    around = {
        # With weights of its own it passes through half of these few rows: which is chance.
        "huber": {"loss": "huber", "alpha": 0.01},
        "early stopping": {"early_stopping": EarlyStopping(validation_fraction=0.3)},
        "restarts": {"n_init": 2},
        "weights that are given": {
            "agreement": 0.1,
            "alpha": 0.01,
            "solver": VariableProjection(stiffness=1e-3),
        },
        "another distance": {"out_of_bounds": LinearExtrapolation(1.0)},
        "nothing iterated": {"max_iter": 0},
    }
    for label, settings in around.items():
        yield label, ANFISRegressor(**({"partition": KMEANS, "max_iter": MAX_ITER} | settings))


def name_of(check):
    return getattr(check, "func", check).__name__


# Not parametrize_with_checks: scikit-learn 1.6 hands pytest a generator, of which pytest 9 warns.
@pytest.mark.parametrize(
    ("estimator", "check"),
    [
        pytest.param(clone, check, id=f"{label}-{name_of(check)}")
        for label, estimator in estimators()
        for clone, check in estimator_checks_generator(estimator)
    ],
)
def test_estimator_passes_the_checks_of_scikit_learn(estimator, check):
    check(estimator)
