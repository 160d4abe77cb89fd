"""Rows with known answers, and the function that compares them; compiled on request."""

import numpy as np
from scipy.stats import qmc

from ...policies import SILENT
from .._numbers import as_held
from ._text import literals

__all__ = ["ROWS", "TOLERANCE", "known_answers", "self_test", "size_of_sum"]

# Of a test: in the box, out of it and on its edges, in a table of a few kB.
ROWS = 32
# As part of the size of what is summed: what the algorithm loses, and no more.
TOLERANCE = {np.dtype(np.float64): 1e-12, np.dtype(np.float32): 1e-5}

# Logarithms of memberships that this takes in, and the share from which on a term counts.
_USUAL, _FIRES = 32.0, 1e-6

_CODE = """
#ifdef $NAME_SELF_TEST

static const $real $name_test_x[$n][$NAME_N_INPUTS] =
$x;

static const $real $name_test_y[$n][$NAME_N_OUTPUTS] =
$y;

static const unsigned char $name_test_status[$n] =
$status;

/* As much as an output may be off. */
static const $real $name_test_tolerance[$NAME_N_OUTPUTS] =
$tolerance;
$coarse$learner_test
int $name_self_test(void)
{
    int i, o;
    for (i = 0; i < $n; ++i) {
        $real y[$NAME_N_OUTPUTS];
        int status;
        for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
            y[o] = 0.0R;
        }
        status = $name_predict($name_test_x[i], y);
        if (status != $name_test_status[i]) {
            return i + 1;
        }
        for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
            const $real off = y[o] - $name_test_y[i][o];
            if (!(status & $NAME_NO_OUTPUT)
                && !(off <= $allowed && -off <= $allowed)) {
                return i + 1;
            }
        }
    }
    return $rest;
}

#ifdef $NAME_SELF_TEST_MAIN
int main(void)
{
    return $name_self_test() == 0 ? 0 : 1;
}
#endif

#endif /* $NAME_SELF_TEST */
"""

_COARSE = """
/* Where double has no more digits than float elsewhere. */
#if DBL_DIG >= 15
#define $NAME_TEST_FACTOR 1.0
#else
#define $NAME_TEST_FACTOR 1e7
#endif
"""


def self_test(answers, dialect, learner_test="", call="learner_test"):
    """The code, with what comes from :func:`known_answers`, and with a further test."""
    X, y, status, tolerance = answers
    is_double = dialect.real == "double"
    allowed = "$name_test_tolerance[o]" + (" * $NAME_TEST_FACTOR" if is_double else "")
    template = _CODE.replace("$coarse", _COARSE if is_double else "").replace("$allowed", allowed)
    return dialect.write(
        template,
        learner_test=learner_test,
        rest=f"{dialect.name}_{call}()" if learner_test else "0",
        n=len(X),
        x=literals(X),
        y=literals(y),
        status=literals(status),
        tolerance=literals(tolerance),
    )


def known_answers(model, numbers, min_coverage, bits, limits=None):
    """Rows, outputs, status and the tolerance of every output.

    Half of the rows lie in the box, the others up to half its width beyond; the first two are its
    corners. Rows so near to the coverage asked for that rounding decides are left out. Outputs are
    held between ``limits``, if there are any.
    """
    model = as_held(model, numbers)
    points = qmc.Halton(model.n_inputs, scramble=False).random(4 * ROWS)
    low, width = numbers.low.astype(float), (numbers.high - numbers.low).astype(float)
    reach = np.where(np.arange(len(points)) % 2, 1.0, 2.0)[:, None]
    X = (low + width * (0.5 + reach * (points - 0.5))).astype(numbers.dtype)
    X = np.vstack([numbers.low, numbers.high, X])
    Z = X.astype(float)
    outside = ~((numbers.low <= X) & (numbers.high >= X)).all(axis=1)
    coverage = model.coverage(Z)
    status = np.where(outside, bits["OUT_OF_RANGE"], 0)
    if model.out_of_bounds in SILENT:
        status |= np.where(outside, bits["NO_OUTPUT"], 0)
    if min_coverage is not None:
        judged = ~(status & bits["NO_OUTPUT"]).astype(bool)
        status |= np.where(judged & (coverage < min_coverage), bits["UNCOVERED"], 0)
    sure = np.full(len(X), True)
    if min_coverage is not None:
        sure = np.abs(coverage - min_coverage) > 1e-3 * min_coverage
    chosen = np.flatnonzero(sure)[:ROWS]
    policy = "linear" if model.out_of_bounds == "linear" else "clip"
    y = model.with_out_of_bounds(policy).predict(Z[chosen])
    if limits is not None:
        y = np.clip(y, *limits.T.astype(float))
    y = np.where((status[chosen] & bits["NO_OUTPUT"]).astype(bool)[:, None], 0.0, y)
    tolerance = TOLERANCE[numbers.dtype] * size_of_sum(model, Z[chosen], y)
    tolerance *= max(_largest_logarithm(model, Z[chosen]) / _USUAL, 1.0)
    return X[chosen], y.astype(numbers.dtype), status[chosen], tolerance.astype(numbers.dtype)


def _largest_logarithm(model, X):
    """Of a membership by which some rule fires; what it is rounded by a share is off by."""
    inside = np.ascontiguousarray(np.clip(X, model.minimum, model.maximum).T)
    log_mu = model.antecedent.log_memberships(inside)
    shares = model.antecedent.sum_over_rules(model.antecedent.strengths(inside))
    return np.abs(log_mu[shares > _FIRES]).max(initial=0.0)


def size_of_sum(model, X, y):
    """The size of what is summed for each output: sum_r w_r (|a_r| + sum_j |b_rj (x_j - x0_j)|)."""
    inside = np.clip(X, model.minimum, model.maximum)
    basis = np.ones((len(X), model.coefficients.shape[1]))
    if model.order:
        basis[:, 1:] = np.abs(inside - model.reference)
    sizes = np.einsum("nr,nb,rbo->no", model.strengths(X), basis, np.abs(model.coefficients))
    return np.maximum(sizes.max(axis=0), np.abs(y).max(axis=0))
