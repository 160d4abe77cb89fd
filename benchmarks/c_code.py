"""Models in C, size and time: ``python -m benchmarks c_code``. Needs gcc and size (binutils)."""

import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from sklearn.cluster import KMeans

from skanfis import ANFISRegressor
from skanfis.datasets import make_ofog
from skanfis.export import export_c

from .report import Results, Table

__all__ = ["run"]

_FLAGS = ["-std=c99", "-O2"]
_MAIN = """
#include <stdio.h>
#include <time.h>
#include "{name}.h"
static const {dtype} rows[][{width}] = {{ {rows} }};
int main(void)
{{
    const int n = (int)(sizeof rows / sizeof rows[0]);
    double best = 1e9, sink = 0.0;
    int round, i;
    for (round = 0; round < 200; ++round) {{
        const clock_t start = clock();
        double seconds;
        int k;
        for (k = 0; k < 20; ++k) {{
            for (i = 0; i < n; ++i) {{
                {dtype} y[1];
                (void){name}_predict(rows[i], y);
                sink += (double)y[0];
            }}
        }}
        seconds = (double)(clock() - start) / CLOCKS_PER_SEC;
        if (seconds < best) {{
            best = seconds;
        }}
    }}
    printf("%.6e %.3e", best / 20 / n * 1e9, sink);
    return 0;
}}
"""


def measured(model, X, dtype, folder):
    """Bytes of constants and of code, nanoseconds of a prediction."""
    name = f"anfis_{dtype}"
    code = export_c(model, name=name, dtype=dtype)
    (folder / f"{name}.h").write_text(code.header, encoding="utf-8")
    (folder / f"{name}.c").write_text(code.source, encoding="utf-8")
    rows = ", ".join("{" + ", ".join(f"{value:.9e}" for value in row) + "}" for row in X)
    main = _MAIN.format(name=name, dtype=dtype, rows=rows, width=X.shape[1])
    (folder / "main.c").write_text(main, encoding="utf-8")
    told(["gcc", *_FLAGS, "-c", f"{name}.c"], folder)
    told(["gcc", *_FLAGS, "main.c", f"{name}.o", "-lm", "-o", "main"], folder)
    sizes = told(["size", "-A", f"{name}.o"], folder)

    def total(section):
        found = re.findall(rf"^\.{section}\S*\s+(\d+)", sizes, re.MULTILINE)
        return sum(map(int, found))

    return total("rodata"), total("text"), float(told(["./main"], folder).split()[0])


def told(command, folder):
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True).stdout


def models():
    """36 rules of a gyro; a tree of 8 leaves and 8 scattered rules of one function of 6 inputs."""
    log = make_ofog(n_devices=1, n_runs=16, random_state=0)
    X, y = log[["temperature", "output"]].to_numpy(), log["error"].to_numpy()
    yield "36 rules", ANFISRegressor(n_mfs=6).fit(X, y), X
    rng = np.random.default_rng(0)
    X = rng.uniform(-1.0, 1.0, (2000, 6))
    y = np.sin(np.pi * X[:, 0] * X[:, 1]) + 2.0 * X[:, 2] ** 2 + X[:, 3] * np.tanh(2.0 * X[:, 4])
    y += 0.3 * X[:, 5] + 0.05 * rng.standard_normal(2000)
    tree = ANFISRegressor(partition="tree", max_rules=8, simplicity=0).fit(X, y)
    yield f"tree of {tree.n_rules_} leaves, 6 inputs", tree, X
    around = KMeans(8, random_state=0)
    yield "8 scattered rules, 6 inputs", ANFISRegressor(partition=around).fit(X, y), X


def run(options):
    if not (shutil.which("gcc") and shutil.which("size")):
        return Results(tables=[Table("C: no compiler here", ["type"], [])])
    lines = []
    for label, model, X in models():
        chosen = np.random.default_rng(0).permutation(len(X))[:1000]
        for dtype in ("double", "float"):
            with tempfile.TemporaryDirectory() as folder:
                lines.append([label, dtype, *measured(model, X[chosen], dtype, Path(folder))])
    head = ["model", "type", "tables [B]", "code [B]", "time [ns]"]
    return Results(tables=[Table(f"C, gcc {' '.join(_FLAGS)}", head, lines)])
