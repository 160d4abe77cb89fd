"""What the benchmarks return, and how it is printed."""

import os
import platform
from dataclasses import dataclass, field
from datetime import date
from importlib.metadata import version
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_info

import skanfis

__all__ = ["Measure", "Results", "Row", "Table", "machine", "markdown"]


@dataclass(frozen=True)
class Measure:
    """A figure, and the most that it should be: the bar at least, better the aim."""

    name: str
    value: float
    unit: str = ""
    bar: float | None = None
    aim: float | None = None

    def limit(self, kind):
        """The bar or the aim as text; empty if there is none."""
        limit = getattr(self, kind)
        return "" if limit is None else f"{self.name} ≤ {limit:g}{self._suffix()}"

    def meets(self, kind):
        limit = getattr(self, kind)
        return limit is None or self.value <= limit

    def __str__(self):
        return f"{self.name} {self.value:.3g}{self._suffix()}"

    def _suffix(self):
        return f" {self.unit}" if self.unit else ""


@dataclass(frozen=True)
class Row:
    """A line of the main table."""

    work: str
    measures: list[Measure]

    def cells(self):
        return [
            self.work,
            self._joined("bar"),
            self._joined("aim"),
            ", ".join(map(str, self.measures)),
            self._verdict(),
        ]

    def _joined(self, kind):
        return ", ".join(filter(None, (measure.limit(kind) for measure in self.measures)))

    def _verdict(self):
        missed = {k: [m.name for m in self.measures if not m.meets(k)] for k in ("bar", "aim")}
        if missed["bar"]:
            return f"**no**: {', '.join(missed['bar'])}"
        if missed["aim"]:
            return f"yes; aim no: {', '.join(missed['aim'])}"
        return "yes, aim too" if self._joined("aim") else "yes"


@dataclass(frozen=True)
class Table:
    """Figures that explain a row."""

    title: str
    head: list[str]
    lines: list[list]


@dataclass(frozen=True)
class Results:
    """Lines of the main table, and tables of their own."""

    rows: list[Row] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)

    def __add__(self, other):
        return Results(self.rows + other.rows, self.tables + other.tables)


def machine():
    """What the figures depend on, and when they were taken."""
    packages = ["numpy", "scipy", "scikit-learn"]
    versions = [f"{name} {version(name)}" for name in packages]
    blas = {f"{pool['internal_api']} {pool['version']}" for pool in threadpool_info()}
    python = f"{platform.python_implementation()} {platform.python_version()}"
    return [
        f"date: {date.today().isoformat()}",
        f"machine: {_processor()}, {os.cpu_count()} cores, {platform.system()}; one thread",
        f"versions: skanfis {skanfis.__version__}, {python}, {', '.join(versions)}; "
        f"{', '.join(sorted(blas))}",
    ]


def _processor():
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def markdown(results, facts):
    """The whole report."""
    parts = ["# Benchmarks", "\n".join(f"* {fact}" for fact in facts)]
    if results.rows:
        head = ["work", "bar at least", "aim", "measured", "met?"]
        parts.append(_table(head, [row.cells() for row in results.rows]))
    for table in results.tables:
        parts += [f"## {table.title}", _table(table.head, table.lines)]
    return "\n\n".join(parts)


def _table(head, lines):
    rule = ["---"] * len(head)
    return "\n".join(f"| {' | '.join(map(_cell, line))} |" for line in [head, rule, *lines])


def _cell(value):
    text = f"{value:.3g}" if isinstance(value, float | np.floating) else str(value)
    return text.replace("|", "\\|")
