"""Solvers find the premises: small objects with the settings that are theirs alone.

A string such as ``ANFISRegressor(solver="hybrid")`` stands for the object with its defaults.
"""

from .gradient import GradientDescent
from .hybrid import Hybrid
from .lse import LeastSquares
from .solver import Solver
from .solver_result import MESSAGES, SolverResult
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

# The words for them, as parameters have them.
SOLVERS = {
    "varpro": VariableProjection,
    "hybrid": Hybrid,
    "gradient": GradientDescent,
    "lse": LeastSquares,
}
