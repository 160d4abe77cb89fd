"""One pass over many rows, cost, gradient and Gauss-Newton, against the bare symmetric product.

The product of the design with itself is what a pass was once thought unable to avoid (it need not
form the design, see ``skanfis.gram``); its time is the unit.
"""

from unittest.mock import patch

import numpy as np
from scipy.linalg import blas

from skanfis import objective
from skanfis.membership import Gaussian
from skanfis.objective import SeparableProblem
from skanfis.partition import grid_antecedent
from skanfis.rows import Rows

from .report import Measure, Results, Row, Table
from .timing import profile, side_by_side

__all__ = ["run"]

_N_ROWS = 400_000
_BLOCK_BYTES = [2**k for k in range(18, 25)]
_HALVES = ["evaluate", "linearise"]


def make_problem():
    """A smooth surface over three inputs and a grid of 27 rules."""
    X = np.random.default_rng(0).uniform(-1.0, 1.0, (_N_ROWS, 3))
    rows = Rows.standardised(X, np.sin(3.0 * X[:, :1]) * X[:, 1:2])
    low, high = ((edge - rows.inputs.offset) / rows.inputs.scale for edge in (X.min(0), X.max(0)))
    antecedent = grid_antecedent([Gaussian] * 3, [3, 3, 3], low, high, overlap=0.6)
    return SeparableProblem(rows, antecedent, order=1, alpha=1e-12)


def bare_products(problem):
    """The symmetric product of the design with itself, in either order of memory."""
    Z = np.ascontiguousarray((problem.rows.X - problem.rows.inputs.offset).T)
    Z /= problem.rows.inputs.scale[:, None]
    strengths = problem.antecedent.strengths(Z)
    basis = np.vstack([np.ones(_N_ROWS), Z])
    by_column = (strengths[:, None] * basis).reshape(-1, _N_ROWS).T
    by_row = np.ascontiguousarray(by_column)
    return {
        "product, by column": lambda: blas.dsyrk(1.0, by_column, trans=1, lower=1),
        "product, by row": lambda: blas.dsyrk(1.0, by_row.T, lower=1),
    }


def passes(problem):
    """The two halves of a pass, at the start."""
    parameters = problem.antecedent.parameters
    evaluation = problem.evaluate(parameters)
    return {
        "evaluate": lambda: problem.evaluate(parameters, evaluation.coefficients),
        "linearise": lambda: problem.linearise(evaluation),
    }


def run(options):
    problem = make_problem()
    products, halves = bare_products(problem), passes(problem)
    seconds = side_by_side({**products, **halves})
    product = min(seconds[name] for name in products)
    ratio = sum(seconds[half] for half in _HALVES) / product
    work = f"one pass, n={_N_ROWS:,}, 27 rules, 3 inputs, in bare products Φ'Φ"
    row = Row(work, [Measure("pass", ratio, "x", 2.5, 1.5)])
    lines = [[name, value, value / product] for name, value in seconds.items()]
    tables = [Table("One pass", ["work", "CPU [s]", "in products"], lines)]
    if options.details:
        tables.append(block_sizes(problem, products))
        tables += [profile(halves[half], calls=3, title=f"{half} in full") for half in _HALVES]
    return Results([row], tables)


def block_sizes(problem, products):
    """The measurement behind ``objective._BLOCK_BYTES``."""
    functions, blocks = dict(products), {}
    for size in _BLOCK_BYTES:
        with patch.object(objective, "_BLOCK_BYTES", size):
            blocks[size] = problem._block_rows(problem.antecedent)
            other = SeparableProblem(problem.rows, problem.antecedent, problem.order, problem.alpha)
        functions |= {(size, half): function for half, function in passes(other).items()}
    seconds = side_by_side(functions)
    product = min(seconds[name] for name in products)
    lines = []
    for size in _BLOCK_BYTES:
        halves = [seconds[size, half] / product for half in _HALVES]
        lines.append([f"{size // 1024} KiB", blocks[size], *halves, sum(halves)])
    head = ["block", "rows", *_HALVES, "pass, in products"]
    return Table("Size of a block (objective._BLOCK_BYTES)", head, lines)
