"""The self-test in C: rows with known answers, and a function that checks them, on request."""

import numpy as np
from scipy.stats import qmc

from ...policies import SILENT
from .dialect import literals, status_word

# Rows of a test, in the box, out of it and on its edges: a table of a few kB.
ROWS = 32
# Relative to the size of the summands: the rounding errors of the algorithm, and no more.
TOLERANCE = {np.dtype(np.float64): 1e-12, np.dtype(np.float32): 1e-5}

_CODE = """
#ifdef $NAME_SELF_TEST

static const $real $name_test_x[$n][$NAME_N_INPUTS] =
$x;

static const $real $name_test_y[$n][$NAME_N_OUTPUTS] =
$y;

static const unsigned char $name_test_status[$n] =
$status;

/* By how much an output may differ. */
static const $real $name_test_tolerance[$NAME_N_OUTPUTS] =
$tolerance;

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
        if (status != (int)$name_test_status[i]) {
            return i + 1;
        }
        for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
            if ((status & $NAME_NO_OUTPUT) == 0
                && !(y[o] <= $name_test_y[i][o] + $name_test_tolerance[o]
                    && y[o] >= $name_test_y[i][o] - $name_test_tolerance[o])) {
                return i + 1;
            }
        }
    }
    return 0;
}

#ifdef $NAME_SELF_TEST_MAIN
int main(void)
{
    return $name_self_test() == 0 ? 0 : 1;
}
#endif

#endif /* $NAME_SELF_TEST */
"""


def self_test(answers, dialect):
    """The C code, with answers as from :func:`known_answers`."""
    X, y, status, tolerance = answers
    tables = {"x": X, "y": y, "status": status, "tolerance": tolerance}
    texts = {name: literals(values) for name, values in tables.items()}
    return dialect.write(_CODE, n=len(X), **texts)


def known_answers(source):
    """Rows, outputs and status of the model of a source, and the tolerance of every output.

    Half of the rows lie in the box, the others up to half its width beyond. Rows are left out if
    rounding decides their coverage, or, in a gap between all terms, their strongest rule.
    """
    numbers, model = source.numbers, source.model
    policy = "linear" if model.out_of_bounds == "linear" else "clip"
    held = (-np.inf, np.inf) if source.limits is None else source.limits.T.astype(float)

    def outputs(rows):
        return np.clip(model.with_out_of_bounds(policy).predict(rows), *held)

    points = qmc.Halton(model.n_inputs, scramble=False).random(4 * ROWS)
    width = model.maximum - model.minimum
    reach = np.where(np.arange(len(points)) % 2, 1.0, 2.0)[:, None]
    X = (model.minimum + width * (0.5 + reach * (points - 0.5))).astype(numbers.dtype)
    X = np.vstack([numbers.low, numbers.high, X])
    Z = X.astype(float)
    # As in C, to the last bit; ``in_bounds`` allows for rounding.
    outside = ((model.minimum > Z) | (model.maximum < Z)).any(axis=1)
    silent = outside & (model.out_of_bounds in SILENT)
    # Without a least coverage, every row is covered.
    asked = -1.0 if source.min_coverage is None else source.min_coverage
    coverage = model.coverage(Z)
    status = status_word(outside, silent, coverage < asked)
    sure = np.abs(coverage - asked) > 1e-3 * asked
    y = outputs(Z)
    tolerance = TOLERANCE[numbers.dtype] * size_of_sum(model, Z, y)
    step = 4.0 * np.finfo(numbers.dtype).eps * (np.abs(Z - numbers.reference) + model.spread)
    steady = (np.abs(outputs(Z + step) - y) <= 0.25 * tolerance).all(axis=1)
    chosen = np.flatnonzero(sure & steady if (sure & steady).any() else sure)[:ROWS]
    y[silent] = 0.0
    y, tolerance = y[chosen].astype(numbers.dtype), tolerance.astype(numbers.dtype)
    return X[chosen], y, status[chosen], tolerance


def size_of_sum(model, X, y):
    """Size of each output's summands: sum_r w_r (|a_r| + sum_j |b_rj (x_j - x0_j)|)."""
    inside = np.clip(X, model.minimum, model.maximum)
    parts = [model.strengths(X), np.abs(model.basis(inside.T)), np.abs(model.coefficients)]
    sizes = np.einsum("nr,bn,rbo->no", *parts)
    return np.maximum(sizes.max(axis=0), np.abs(y).max(axis=0))
