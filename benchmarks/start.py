"""How wide the terms of a grid start: the measurement behind ``structure.request.OVERLAP``."""

from unittest.mock import patch

from skanfis import ANFISRegressor
from skanfis.search import request as start

from .gyro import measure, summary
from .jang import PROBLEMS
from .report import Results, Table

__all__ = ["run"]

_OVERLAPS = [0.5, 0.6, 0.7]
_SEEDS = range(10)


def run(options):
    lines = []
    for overlap in _OVERLAPS:
        with patch.object(start, "OVERLAP", overlap):
            lines += [[overlap, *line] for line in figures()]
    lines.sort(key=lambda line: line[1:3])
    head = ["overlap", "problem", "mf", "error, train", "error, check", "iterations"]
    return Results(tables=[Table("Overlap of neighbours at the start", head, lines)])


def figures():
    for problem in PROBLEMS:
        for mf in ("gaussian", "bell"):
            model = problem.fit(mf)
            yield [problem.name, mf, *problem.errors(model), model.n_iter_]
    for mf in ("gaussian", "bell"):
        inside, worst, *_ = summary(measure(lambda mf=mf: ANFISRegressor(3, mf=mf), _SEEDS))
        yield ["gyro-like, 27 rules, in the box: median, worst [σ]", mf, inside, worst, ""]
