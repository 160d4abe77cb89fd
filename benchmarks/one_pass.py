"""One pass over many rows, cost, gradient and Gauss-Newton, against the bare symmetric product.

The product of the design with itself is what a pass would take if it formed the design (it need
not, see ``skanfis.learning.gram``); its time is the unit.

No large array is freed before the passes: the C library then keeps memory at hand, and spares them
what allocation costs them in a fresh process.
"""

import numpy as np
from scipy.linalg import blas

from skanfis.learning.data import StandardisedData
from skanfis.learning.objective import SeparableProblem
from skanfis.learning.penalty import Penalty
from skanfis.membership import Gaussian
from skanfis.search.grid import Spacing, grid_antecedent

from .report import Measure, Results, Row, Table
from .timing import side_by_side

__all__ = ["run"]

_N_ROWS = 400_000


def make_problem():
    """A smooth surface over three inputs and a grid of 27 rules."""
    X = np.random.default_rng(0).uniform(-1.0, 1.0, (_N_ROWS, 3))
    y = np.multiply(X[:, :1], 3.0)
    np.sin(y, out=y)
    y *= X[:, 1:2]
    rows = StandardisedData.of(X, y)
    antecedent = grid_antecedent([Gaussian] * 3, [3, 3, 3], Spacing(rows))
    return SeparableProblem(rows, antecedent, Penalty(alpha=1e-12, slope=1e-12))


def bare_products(problem):
    """The symmetric product of the design with itself, in either order of memory."""
    by_column = np.empty((_N_ROWS, problem.n_columns), order="F")
    for start in range(0, _N_ROWS, 1000):
        part = slice(start, start + 1000)
        Z = problem.rows.table(part)[:, :3].T
        basis = np.vstack([np.ones(1000), Z])
        strengths = problem.antecedent.strengths(Z)
        by_column[part] = (strengths[:, None] * basis).reshape(problem.n_columns, -1).T
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
    whole = sum(seconds[name] for name in halves) / product
    work = f"one pass, n={_N_ROWS:,}, 27 rules, 3 inputs, in bare products Φ'Φ"
    rows = [Row(work, [Measure("pass", whole, "x", 2.5, 1.5)])]
    lines = [[name, value, value / product] for name, value in seconds.items()]
    return Results(rows, [Table("One pass", ["work", "CPU [s]", "in products"], lines)])
