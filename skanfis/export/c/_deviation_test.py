"""The self-test of the deviations, and what it allows."""

import numpy as np

from ...deviation import rulers
from ._deviation_code import TEST
from ._deviation_rounding import deviation_rounding, longer_steps
from ._text import literals

__all__ = ["deviation_test"]

# As parts of a deviation: what is allowed beside what rounding and longer steps may do, and what
# the steps may at most, and in the range rounding.
_LEAST_TOLERANCE = {np.dtype(np.float64): 1e-10, np.dtype(np.float32): 1e-4}
_MOST_OFF, _MOST_ROUNDED = 0.02, 1.0


def deviation_test(model, dialect, X, source):
    """The test of the deviations at the rows of the self-test; ``model`` as it is held.

    ValueError where single precision loses all digits, or its steps do not tell what goes on at an
    edge.
    """
    policy = "linear" if model.out_of_bounds == "linear" else "clip"
    model, Z = model.with_out_of_bounds(policy), X.astype(float)
    wanted = model.standard_deviation(Z)
    tolerance = deviation_rounding(model, Z, wanted, dialect.dtype, source.differences)
    # Of an output that never changed there is no deviation to speak of.
    noisy = np.flatnonzero(model.posterior.noise > 0.0)
    if dialect.dtype == np.float32 and noisy.size:
        within = model.in_bounds(Z)[:, None] & (model.posterior.noise > 0.0)
        _check_rounding(model, (tolerance[within] / wanted[within]).max(initial=0.0))
    if source.moves_terms:
        off = np.abs(longer_steps(model, Z, wanted, source.differences) - wanted)
        if noisy.size:
            _check_steps(model, Z, (off / wanted)[:, noisy], source.differences.step)
        tolerance += off
    tolerance += _LEAST_TOLERANCE[dialect.dtype] * wanted
    factor = " * $NAME_TEST_FACTOR" if dialect.real == "double" else ""
    return dialect.write(
        TEST.replace("$factor", factor),
        n_test=len(X),
        deviations=literals(wanted.astype(dialect.dtype)),
        tolerance=literals(tolerance.astype(dialect.dtype)),
    )


def _check_rounding(model, off):
    """Refuse deviations that rounding may put ``off`` by more than all of them."""
    if off <= _MOST_ROUNDED:
        return
    terms = np.argmax((model.maximum - model.minimum) / rulers(model).min(axis=0))
    raise ValueError(
        "deviation=True with dtype='float': rounding may leave no digit of it in the range, which "
        f"of {model.input_names[terms]!r} is many times as wide as its terms, as a row far off "
        "makes it; or there is next to no noise. Use dtype='double', or fit without that row."
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
