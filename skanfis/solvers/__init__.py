"""Solvers find the premises: functions of a problem, a premise and a stopping rule."""

from collections.abc import Callable

from .gradient import gradient
from .hybrid import hybrid
from .lbfgs import lbfgs
from .lse import lse
from .result import SolverResult
from .varpro import varpro

__all__ = ["SOLVERS", "SolverResult", "gradient", "hybrid", "lbfgs", "lse", "varpro"]

SOLVERS: dict[str, Callable] = {
    "varpro": varpro,
    "hybrid": hybrid,
    "gradient": gradient,
    "lbfgs": lbfgs,
    "lse": lse,
}
