"""Solvers find the premises: functions of a problem, a premise and a stopping rule."""

from .result import SolverResult
from .varpro import varpro

__all__ = ["SOLVERS", "SolverResult", "varpro"]

SOLVERS = {"varpro": varpro}
