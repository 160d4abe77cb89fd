"""The self-test of the deviations, and what it allows."""

import numpy as np

from ._deviation_code import TEST
from ._deviation_rounding import deviation_rounding, longer_steps
from ._text import literals

__all__ = ["deviation_test"]

# As parts of a deviation: what is allowed beside what rounding and longer steps may do, and what
# the steps may at most.
_LEAST_TOLERANCE = {np.dtype(np.float64): 1e-10, np.dtype(np.float32): 1e-4}
_MOST_OFF = 0.02


def deviation_test(model, dialect, X, source):
    """The test of the deviations at the rows of the self-test; ``model`` as it is held.

    ValueError where the steps that single precision takes do not tell what goes on at an edge.
    """
    policy = "linear" if model.out_of_bounds == "linear" else "clip"
    model, Z = model.with_out_of_bounds(policy), X.astype(float)
    wanted = model.standard_deviation(Z)
    tolerance = deviation_rounding(model, Z, wanted, dialect.dtype, source.differences)
    if source.moves_terms:
        off = np.abs(longer_steps(model, Z, wanted, source.differences) - wanted)
        _check_steps(model, Z, off / wanted, source.differences.step)
        tolerance += off
    tolerance += _LEAST_TOLERANCE[dialect.dtype] * wanted
    factor = " * $NAME_TEST_FACTOR" if dialect.real == "double" else ""
    return dialect.write(
        TEST.replace("$factor", factor),
        n_test=len(X),
        deviations=literals(wanted.astype(dialect.dtype)),
        tolerance=literals(tolerance.astype(dialect.dtype)),
    )


def _check_steps(model, Z, off, step):
    """Refuse steps by which deviations at rows Z are ``off`` by too large a part."""
    worst = int(np.argmax(off.max(axis=1)))
    if off[worst].max() <= _MOST_OFF:
        return
    beyond = np.flatnonzero((Z[worst] < model.minimum) | (Z[worst] > model.maximum))
    names = " and ".join(repr(model.input_names[j]) for j in beyond)
    raise ValueError(
        "deviation=True with dtype='float': out of the range it goes by differences over "
        f"{step:.2g} standard deviations, and is off by {off[worst].max():.0%} beyond that of "
        f"{names}, where memberships change too quickly. Use dtype='double', or "
        "out_of_bounds='nan' or 'raise'."
    )
