"""36 rules in C beside a random forest and a neural network: ``python -m benchmarks compiled``.

The model is that of the founding paper, six terms on temperature times six on the rate. The others
are the smallest of a list that are as accurate on rows held out, or the most accurate if none is.
m2cgen and emlearn turn them into C, in an environment of their own. All is compiled with the same
flags into one program, which measures them by turns.
"""

import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import joblib
import numpy as np
import sklearn
from sklearn.compose import TransformedTargetRegressor
from sklearn.ensemble import RandomForestRegressor
from sklearn.model_selection import GridSearchCV, GroupKFold
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skanfis import ANFISRegressor
from skanfis.datasets import make_ofog
from skanfis.export import export_c

from .gyro import SIGMA, surface
from .peers import called, install
from .report import Results, Table

__all__ = ["run"]

FLAGS = ["-std=c99", "-O2"]
_PACKAGES = [f"scikit-learn=={sklearn.__version__}", "m2cgen==0.10.0", "emlearn==0.23.2"]
_ALPHAS = [1e-8, 1e-6, 1e-4, 1e-2]
# As accurate: an error not larger by more than this.
_EQUAL = 1.02
_HIDDEN = [(4,), (8,), (16,), (32,), (16, 16), (32, 32)]
_FORESTS = [(5, 50), (10, 100), (20, 200), (20, 400)]
_ROUNDS, _ROWS = 15, 1000


@dataclass(frozen=True)
class Problem:
    """Rows to train on, their groups, and rows to judge by."""

    title: str
    X: np.ndarray
    y: np.ndarray
    groups: np.ndarray
    X_test: np.ndarray
    y_test: np.ndarray


@dataclass(frozen=True)
class Candidate:
    """A compiled model: what it predicts, its C, what it costs."""

    name: str
    prediction: np.ndarray
    source: str
    call: str  # an expression of type double, of a row: double d[], float f[]
    exponentials: int
    multiply_adds: int
    comparisons: int = 0
    flags: tuple = ()


def run(options):
    compiler = shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        return Results(tables=[Table("Compiled models: no C compiler here", ["model"], [])])
    with tempfile.TemporaryDirectory() as folder:
        python = install(_PACKAGES, Path(folder))
        tables = []
        for k, problem in enumerate([campaign(), gyro_surface()]):
            place = Path(folder) / str(k)
            place.mkdir()
            tables.append(compare(problem, Converters(python, place), compiler, place))
    return Results(tables=tables)


def campaign():
    """One simulated gyro: 16 power-ups at different temperatures, a quarter of them held out."""
    table = make_ofog(n_devices=1, n_runs=16, random_state=0)
    X = table[["temperature", "output"]].to_numpy()
    y, runs = table["error"].to_numpy(), table["run"].to_numpy()
    held_out = runs % 4 == 1
    train, test = ~held_out, held_out
    title = "simulated open-loop gyro, runs held out"
    return Problem(title, X[train], y[train], runs[train], X[test], y[test])


def gyro_surface():
    """The smooth surface of the other benchmarks, an hour after power-on."""
    rng = np.random.default_rng(0)
    X, X_test = rng.uniform([3600.0, -20.0, -100.0], [3600.0, 60.0, 100.0], (2, 2000, 3))
    y = surface(X) + SIGMA * rng.standard_normal(len(X))
    inside = ((X.min(axis=0) <= X_test) & (X.max(axis=0) >= X_test)).all(axis=1)
    groups = np.arange(len(X)) % 4
    title = "gyro-like surface, truth without noise"
    return Problem(title, X[:, 1:], y, groups, X_test[inside, 1:], surface(X_test[inside]))


class Converters:
    """m2cgen and emlearn, in the environment that has them."""

    def __init__(self, python, folder):
        self.python, self.folder = python, folder
        self.script = Path(__file__).with_name("_to_c.py")

    def code(self, model, converter):
        joblib.dump(model, self.folder / "model.joblib")
        return self._answer("model.joblib", converter)

    def headers(self):
        return self._answer().strip()

    def _answer(self, *arguments):
        # emlearn leaves files in the working folder.
        command = [self.python, self.script, *arguments]
        done = subprocess.run(command, cwd=self.folder, capture_output=True, text=True, check=True)
        return done.stdout


def compare(problem, converters, compiler, folder):
    """The table of one problem."""
    model = anfis(problem)
    goal = _EQUAL * rmse(model.predict(problem.X_test), problem)
    candidates = [
        *own(model, problem),
        *forests(problem, goal, converters),
        network(problem, goal, converters),
    ]
    names = [f"c{k}" for k in range(len(candidates))]
    sizes = [
        compile_one(name, candidate, converters, compiler, folder)
        for name, candidate in zip(names, candidates, strict=True)
    ]
    # In no order: a processor learns the branches that a forest takes along a slow drift.
    chosen = np.random.default_rng(0).permutation(len(problem.X_test))[:_ROWS]
    nanoseconds, predictions = measure(names, problem.X_test[chosen], compiler, folder)
    lines = []
    for k, (candidate, (constants, code, state)) in enumerate(zip(candidates, sizes, strict=True)):
        difference = np.abs(predictions[k] - candidate.prediction[chosen]).max()
        lines.append(
            [
                candidate.name,
                rmse(candidate.prediction, problem),
                difference / np.abs(problem.y_test).max(),
                constants,
                code,
                state,
                candidate.exponentials,
                candidate.multiply_adds,
                candidate.comparisons,
                f"{nanoseconds[k]:.0f}",
            ]
        )
    head = [
        "model",
        "RMSE on rows held out [deg/s]",
        "C off Python [full scale]",
        "tables [B]",
        "code [B]",
        "RAM [B]",
        "exponentials",
        "multiply-adds",
        "comparisons",
        "time [ns]",
    ]
    version = called([compiler, "--version"]).splitlines()[0]
    return Table(f"Compiled models, {problem.title} ({version}, {' '.join(FLAGS)})", head, lines)


def rmse(prediction, problem):
    return float(np.sqrt(np.mean((prediction - problem.y_test) ** 2)))


def anfis(problem):
    """36 rules; the ridge from cross-validation over groups."""
    search = GridSearchCV(
        ANFISRegressor(n_mfs=6),
        {"alpha": _ALPHAS},
        cv=GroupKFold(4),
        scoring="neg_mean_squared_error",
    )
    return search.fit(problem.X, problem.y, groups=problem.groups).best_estimator_


def own(model, problem):
    """The ANFIS in double and in single precision."""
    for dtype in ("double", "float"):
        code = export_c(model, name=f"anfis_{dtype}", dtype=dtype)
        header = re.sub(r"#include \"anfis_\w+\.h\"", "", code.source)
        row = {"double": "d", "float": "f"}[dtype]
        source = f"{code.header}{header}static double call(const {dtype} *x) {{ {dtype} y[1]; "
        source += f"(void)anfis_{dtype}_predict(x, y); return (double)y[0]; }}\n"
        yield Candidate(
            f"ANFIS, {model.n_rules_} rules, {dtype}",
            model.predict(problem.X_test),
            source,
            f"call({row})",
            code.cost.exponentials,
            code.cost.multiply_adds,
        )


def smallest(models, problem, goal):
    """The first of the fitted models that reaches the goal, or the most accurate of them."""
    errors = []
    for model in models:
        model.fit(problem.X, problem.y)
        errors.append(rmse(model.predict(problem.X_test), problem))
        if errors[-1] <= goal:
            return model
    return models[int(np.argmin(errors))]


def forests(problem, goal, converters):
    models = [
        RandomForestRegressor(n_estimators=n, max_leaf_nodes=leaves, random_state=0)
        for n, leaves in _FORESTS
    ]
    forest = smallest(models, problem, goal)
    name = f"random forest, {len(forest.estimators_)} trees of {forest.max_leaf_nodes} leaves"
    prediction = forest.predict(problem.X_test)
    steps = [tree.decision_path(problem.X_test.astype(np.float32)) for tree in forest.estimators_]
    # A row passes one node less than its path has, the leaf.
    comparisons = round(sum(path.sum() / path.shape[0] - 1 for path in steps))
    sources = {
        "m2cgen, double": (converters.code(forest, "m2cgen"), "m2cgen_score((double *)d)"),
        "emlearn, float": (
            converters.code(forest, "emlearn"),
            "(double)forest_predict(f, 2)",
        ),
    }
    for converter, (source, call) in sources.items():
        full = f"{name}, {converter}"
        yield Candidate(full, prediction, source, call, 0, len(forest.estimators_), comparisons)


def network(problem, goal, converters):
    models = [
        TransformedTargetRegressor(
            make_pipeline(
                StandardScaler(),
                MLPRegressor(
                    hidden_layer_sizes=sizes,
                    activation="tanh",
                    solver="lbfgs",
                    alpha=0.0,
                    max_iter=5000,
                    max_fun=100_000,
                    tol=1e-10,
                    random_state=0,
                ),
            ),
            transformer=StandardScaler(),
        )
        for sizes in _HIDDEN
    ]
    chosen = smallest(models, problem, goal)
    scaler, mlp = chosen.regressor_
    target = chosen.transformer_
    moves = [
        f"z[{j}] = (f[{j}] - {mean:.9e}f) * {1.0 / scale:.9e}f;"
        for j, (mean, scale) in enumerate(zip(scaler.mean_, scaler.scale_, strict=True))
    ]
    n_inputs = scaler.n_features_in_
    source = converters.code(mlp, "emlearn")
    source += f"""
static double call(const float *f)
{{
    float z[{n_inputs}];
    {" ".join(moves)}
    const double scaled = (double)mlp_regress1(z, {n_inputs});
    return {target.mean_[0]:.17e} + {target.scale_[0]:.17e} * scaled;
}}
"""
    sizes = "-".join(map(str, mlp.hidden_layer_sizes))
    products = sum(weights.size for weights in mlp.coefs_) + n_inputs + 1
    name = f"neural network, {sizes} hidden, tanh, emlearn, float"
    hidden = sum(mlp.hidden_layer_sizes)
    flags = (f"-I{converters.headers()}",)
    prediction = chosen.predict(problem.X_test)
    return Candidate(name, prediction, source, "call(f)", hidden, products, flags=flags)


# Repeats over all rows in one call, so that what is timed is the model and a loop.
_LOOP = """
#include <stddef.h>
double {name}_all(const double *x, const float *xf, double *y, int n_rows, int n_inputs);
double {name}_all(const double *x, const float *xf, double *y, int n_rows, int n_inputs)
{{
    double sum = 0.0;
    int i;
    for (i = 0; i < n_rows; ++i) {{
        const double *d = x + (size_t)i * (size_t)n_inputs;
        const float *f = xf + (size_t)i * (size_t)n_inputs;
        (void)d;
        (void)f;
        y[i] = {call};
        sum += y[i];
    }}
    return sum;
}}
"""

_MAIN = """
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <time.h>
{declarations}
#define N_ROWS {n_rows}
#define N_INPUTS {n_inputs}
#define REPEATS 20
typedef double (*model)(const double *, const float *, double *, int, int);
static const model models[] = {{ {functions} }};
static double x[N_ROWS * N_INPUTS], y[N_ROWS];
static float xf[N_ROWS * N_INPUTS];
int main(void)
{{
    const int n = (int)(sizeof models / sizeof models[0]);
    double best[{n_models}], sink = 0.0;
    int k, round, i;
    if (fread(x, sizeof x[0], N_ROWS * N_INPUTS, stdin) != N_ROWS * N_INPUTS) {{
        return 1;
    }}
    for (i = 0; i < N_ROWS * N_INPUTS; ++i) {{
        xf[i] = (float)x[i];
    }}
    for (round = 0; round < {rounds}; ++round) {{
        for (k = 0; k < n; ++k) {{
            struct timespec start, end;
            double seconds;
            clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &start);
            for (i = 0; i < REPEATS; ++i) {{
                sink += models[k](x, xf, y, N_ROWS, N_INPUTS);
            }}
            clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &end);
            seconds = (double)(end.tv_sec - start.tv_sec);
            seconds += 1e-9 * (double)(end.tv_nsec - start.tv_nsec);
            if (round == 0 || seconds < best[k]) {{
                best[k] = seconds;
            }}
        }}
    }}
    for (k = 0; k < n; ++k) {{
        models[k](x, xf, y, N_ROWS, N_INPUTS);
        printf("%.6e", best[k] / REPEATS / N_ROWS * 1e9);
        for (i = 0; i < N_ROWS; ++i) {{
            printf(" %.17e", y[i]);
        }}
        printf("\\n");
    }}
    return sink == 1e300;
}}
"""


def compile_one(name, candidate, converters, compiler, folder):
    """Bytes of constants, code and writable data of a model's object file."""
    source = candidate.source + _LOOP.format(name=name, call=candidate.call)
    (folder / f"{name}.c").write_text(source, encoding="utf-8")
    gcc(compiler, [*candidate.flags, "-c", f"{name}.c", "-o", f"{name}.o"], folder)
    sections = subprocess.run(
        ["size", "-A", f"{name}.o"], cwd=folder, capture_output=True, text=True, check=True
    ).stdout
    size = {".rodata": 0, ".text": 0, ".data": 0, ".bss": 0}
    for section, n_bytes in re.findall(r"^(\.\w+)\S*\s+(\d+)", sections, re.MULTILINE):
        if section in size:
            size[section] += int(n_bytes)
    return size[".rodata"], size[".text"], size[".data"] + size[".bss"]


def gcc(compiler, arguments, folder):
    subprocess.run(
        [compiler, *FLAGS, *arguments], cwd=folder, capture_output=True, text=True, check=True
    )


def measure(names, rows, compiler, folder):
    """Nanoseconds per evaluation of each model, the least of several rounds; its answers."""
    functions = [f"{name}_all" for name in names]
    arguments = "(const double *, const float *, double *, int, int);"
    main = _MAIN.format(
        declarations="\n".join(f"double {function}{arguments}" for function in functions),
        functions=", ".join(functions),
        n_models=len(names),
        n_rows=rows.shape[0],
        n_inputs=rows.shape[1],
        rounds=_ROUNDS,
    )
    (folder / "main.c").write_text(main, encoding="ascii")
    gcc(compiler, ["main.c", *(f"{name}.o" for name in names), "-o", "main", "-lm"], folder)
    answer = subprocess.run(
        [folder / "main"], input=rows.astype(float).tobytes(), capture_output=True, check=True
    ).stdout.decode()
    values = np.array([line.split() for line in answer.splitlines()], dtype=float)
    return values[:, 0], values[:, 1:]
