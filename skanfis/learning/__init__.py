"""Learning as one separable least-squares problem, and the solvers that find the premises.

A string, as in ``ANFISRegressor(solver="hybrid")``, stands for the solver with its defaults.
"""

from .descent import GradientDescent, Hybrid
from .solver import MESSAGES, LeastSquares, Solver, SolverResult
from .varpro import VariableProjection

__all__ = [
    "MESSAGES",
    "SOLVERS",
    "GradientDescent",
    "Hybrid",
    "LeastSquares",
    "Solver",
    "SolverResult",
    "VariableProjection",
]

# The solvers by the strings that parameters take.
SOLVERS = {
    "varpro": VariableProjection,
    "hybrid": Hybrid,
    "gradient": GradientDescent,
    "lse": LeastSquares,
}
