"""What a C function costs: arithmetic per evaluation, memory."""

from dataclasses import dataclass

import numpy as np

from ._families import BODIES

__all__ = ["CCost", "cost_of"]

# What there is nearly everywhere.
_INDEX_BYTES = {"unsigned char": 1, "unsigned short": 2, "unsigned long": 8}


@dataclass(frozen=True)
class CCost:
    """What one evaluation inside the box takes, and the memory of the function.

    Parameters
    ----------
    exponentials, logarithms : int
        Calls of ``exp`` and ``log``, at most, coverage aside.
    multiply_adds : int
        Multiplications, most of them with an addition to follow.
    divisions : int
    table_bytes : int
        Constant tables, which may lie in read-only memory.
    stack_bytes : int
        Arrays on the stack.
    coverage_exponentials, coverage_square_roots, coverage_multiply_adds : int
        What the judgement of the coverage takes besides, at most. Where the strongest rule alone
        covers the row, which is nearly everywhere amid data, it is one quadratic form, without
        exponential or root. Zero with ``min_coverage=None``.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.export import export_c
    >>> model = ANFISRegressor(n_mfs=4).fit(*make_jang_sinc())
    >>> export_c(model, name="sinc").cost.exponentials  # 2 inputs of 4 terms, not 16 rules
    8
    """

    exponentials: int
    logarithms: int
    multiply_adds: int
    divisions: int
    table_bytes: int
    stack_bytes: int
    coverage_exponentials: int = 0
    coverage_square_roots: int = 0
    coverage_multiply_adds: int = 0


def cost_of(source):
    """CCost of a Source, for a row in the box."""
    numbers, itemsize = source.numbers, source.numbers.dtype.itemsize
    used = [(len(terms.constants), BODIES[terms.family]) for terms in numbers.terms]
    # Of a grid, products of shares: after two inputs, after three, ...
    products = np.cumprod(numbers.counts or (), dtype=int)[1:].sum()
    n_shares = numbers.n_terms if source.is_grid else numbers.n_rules
    asked, n_inputs = 0, numbers.n_inputs
    if "covers" in source.facts:
        # The strongest, then all that have data.
        asked = 1 + int(np.count_nonzero(numbers.support[:, 0]))
    main, tangent = source.arrays()
    n_values = sum(main.values()) + ("linear" in source.facts) * sum(tangent.values())
    return CCost(
        exponentials=sum(n * family.exponentials for n, family in used) + n_shares,
        logarithms=sum(n * family.logarithms for n, family in used),
        multiply_adds=int(
            sum(n * family.multiplications for n, family in used)
            + products
            + n_shares
            + numbers.coefficients.size
        ),
        divisions=len(numbers.counts) if source.is_grid else 1,
        table_bytes=sum(
            values.size * (_INDEX_BYTES[kind] if kind else itemsize)
            for values, kind in source.tables().values()
        ),
        stack_bytes=n_values * itemsize,
        coverage_exponentials=asked,
        coverage_square_roots=asked,
        # The factor's triangle, its square, share and strength.
        coverage_multiply_adds=asked * (n_inputs * (n_inputs + 1) // 2 + n_inputs + 5),
    )
