"""What a C function costs: arithmetic per evaluation, memory."""

from dataclasses import dataclass, replace

import numpy as np

from ._families import BODIES
from ._text import index_type

__all__ = ["INDEX_BYTES", "CCost", "cost", "with_deviation", "with_learner"]

# What C promises at least, and what there is nearly everywhere.
_INT_BYTES = 4
INDEX_BYTES = {"unsigned char": 1, "unsigned short": 2, "unsigned long": 8}


@dataclass(frozen=True)
class CCost:
    """What one evaluation inside the box takes, and the memory of the function.

    Parameters
    ----------
    exponentials : int
        Calls of ``exp``, at most, coverage aside.
    logarithms : int
        Calls of ``log``, at most; zero for Gaussians.
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

    learn_multiply_adds, learn_divisions, learn_stack_bytes : int
        What it takes to learn a row, at most, beside an evaluation. Zero without a learner.
    learner_bytes : int
        What is learnt, in memory of the caller; zero without a learner.
    deviation_multiply_adds, deviation_stack_bytes : int
        What a standard deviation in range takes, and its arrays on the stack; beyond the range it
        takes four times as much. Its tables are among ``table_bytes``. Zero without it.

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
    learn_multiply_adds: int = 0
    learn_divisions: int = 0
    learn_stack_bytes: int = 0
    learner_bytes: int = 0
    deviation_multiply_adds: int = 0
    deviation_stack_bytes: int = 0


def cost(code):
    """CCost of ``code``, a Source, for a row in the box."""
    numbers = code.numbers
    n_rules, n_outputs, n_basis = numbers.coefficients.shape
    exponentials = logarithms = multiply_adds = 0
    for terms in numbers.terms:
        n_terms, family = len(terms.constants), BODIES[terms.family]
        exponentials += n_terms * family.exponentials
        logarithms += n_terms * family.logarithms
        multiply_adds += n_terms * family.multiplications
    if numbers.counts is None:
        n_shares, divisions = n_rules, 1
    else:
        n_shares, divisions = numbers.n_terms, len(numbers.counts)
        products, n_products = 1, 0
        for k, count in enumerate(numbers.counts):
            products *= count
            n_products += products if k else 0
        multiply_adds += n_products
    exponentials += n_shares
    multiply_adds += n_shares + n_rules * n_outputs * n_basis
    asked, of_coverage = 0, 0
    if code.judges_coverage:
        # The strongest, then all that have data.
        asked = 1 + int(np.count_nonzero(numbers.support[:, 0]))
        n_inputs = numbers.n_inputs
        # The factor's triangle, its square, share and strength; and the row in standard deviations.
        of_coverage = n_inputs + asked * (n_inputs * (n_inputs + 1) // 2 + n_inputs + 5)
    return CCost(
        exponentials,
        logarithms,
        multiply_adds,
        divisions,
        table_bytes(code),
        stack(code),
        asked,
        asked,
        of_coverage,
    )


def with_learner(price, source):
    """The cost with that of a LearningSource's learner besides."""
    learner, numbers = source.learning, source.numbers
    n, n_outputs, size = learner.n, numbers.n_outputs, numbers.dtype.itemsize
    # Per column: the product with phi, two for every entry above, and four.
    observation = 3 * n * (n - 1) // 2 + 4 * n
    # Of forgetting, with its made-up observation: the variance, three per column.
    observations, others = (2, 3 * n) if learner.forgets else (1, 0)
    n_slopes = numbers.slope_inputs.size
    evaluation = price.multiply_adds - numbers.coefficients.size + numbers.n_rules * 2 * n_slopes
    tables = source.learning_tables().values()
    return replace(
        price,
        learn_multiply_adds=evaluation + observations * observation + others + n * n_outputs,
        learn_divisions=price.divisions + 2 * n * observations + n_outputs + observations - 1,
        learn_stack_bytes=(2 * n + n_outputs) * size,
        learner_bytes=(learner.packed.size + n * (1 + n_outputs)) * size + 2 * _INT_BYTES,
        table_bytes=price.table_bytes + sum(table.nbytes for table in tables),
    )


def with_deviation(price, source):
    """The cost with that of a DeviationSource besides."""
    found, numbers = source.found, source.numbers
    n, n_outputs, n_rules = found.n, numbers.n_outputs, numbers.n_rules
    n_parameters = found.terms.size if found.q else 0
    per_output = n + found.q * (n_parameters + n) + n_parameters + found.q
    per_output += 2 * found.pinned.shape[1] * (n + found.q)
    values = n + (source.n_logarithms if source.has_shares else 0)
    values += 0 if source.is_grid else n_rules
    if found.q:
        values += 2 * n_parameters + source.n_logarithms + n_outputs * (1 + n_rules)
        values += numbers.n_inputs if source.has_slopes else 0
    values += numbers.n_inputs + source.size
    if source.answers_beyond:
        values += 2 * source.size + numbers.n_inputs + n_outputs
    tables = sum(table.nbytes for table in source.deviation_tables().values())
    tables += sum(
        table.size * INDEX_BYTES[index_type(table)] for table in source.index_tables().values()
    )
    return replace(
        price,
        deviation_multiply_adds=price.multiply_adds + n + n * (n + 1) // 2 + n_outputs * per_output,
        deviation_stack_bytes=values * numbers.dtype.itemsize,
        table_bytes=price.table_bytes + tables,
    )


def table_bytes(code):
    """Of all constant tables, with the widths of types that nearly every machine has."""
    numbers = code.numbers
    real = [numbers.low, numbers.high, numbers.offset, numbers.coefficients]
    real += [numbers.reference] if code.has_slopes or code.judges_coverage else []
    real += [terms.constants for terms in numbers.terms]
    real += [numbers.inverse_spread, numbers.support] if code.judges_coverage else []
    real += [numbers.reach] if code.has_limit else []
    if numbers.output_low is not None:
        real += [numbers.output_low, numbers.output_high]
    real += [] if code.limits is None else [code.limits]
    positions = [numbers.term_inputs] if numbers.n_terms else []
    positions += [] if numbers.rule_terms is None else [numbers.rule_terms]
    positions += [numbers.slope_inputs] if code.selects_slopes else []
    return sum(table.nbytes for table in real) + sum(
        table.size * INDEX_BYTES[index_type(table)] for table in positions
    )


def stack(code):
    """Of the arrays of the main function, and of the one that it may call."""
    numbers = code.numbers
    n_arrays = 1 + code.has_slopes + code.judges_coverage
    n_values = numbers.n_inputs * n_arrays + numbers.n_outputs
    n_values += code.n_logarithms if code.has_shares else 0
    n_values += 0 if code.is_grid else numbers.n_rules
    if code.is_linear:
        n_values += numbers.n_inputs + numbers.n_outputs
        n_values += numbers.n_terms if code.is_grid else code.n_logarithms + numbers.n_rules
    return n_values * numbers.dtype.itemsize
