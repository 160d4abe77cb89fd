"""Solvers find the premises: functions of a problem, a premise and a stopping rule."""

from .gradient import gradient
from .hybrid import hybrid
from .lbfgs import lbfgs
from .lse import lse
from .result import MESSAGES, SolverResult
from .varpro import varpro

__all__ = ["MESSAGES", "SOLVERS", "SolverResult", "gradient", "hybrid", "lbfgs", "lse", "varpro"]

SOLVERS = {
    "varpro": varpro,
    "hybrid": hybrid,
    "gradient": gradient,
    "lbfgs": lbfgs,
    "lse": lse,
}
