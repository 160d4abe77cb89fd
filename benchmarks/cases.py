"""Many cases of one kind: fitted in several processes, rivals remembered, results kept.

What other packages make of a case does not depend on this one. It is computed once and kept in
``.cache/rivals``. The results of the last run of each benchmark are kept in ``.cache/last``, or in
``.cache/NAME`` with ``--keep NAME``: ``python -m benchmarks.compare`` puts two side by side.
"""

import json
import os
import subprocess
import sys
from hashlib import sha1
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from time import perf_counter

import numpy as np
from joblib import Parallel, delayed
from sklearn.model_selection import KFold

import skanfis
from skanfis import ANFISRegressor

from .report import Measure
from .timing import timed

__all__ = [
    "evaluate",
    "fitted",
    "fitted_in_folds",
    "folds",
    "kept",
    "remembered",
]

CACHE = Path(os.environ.get("SKANFIS_BENCHMARKS_CACHE", Path(__file__).with_name(".cache")))
_VERSIONS = ("numpy", "scipy", "scikit-learn")
_FAILED = "failed"
# Seconds that this process has spent on fitting rivals.
_spent = {"rivals": 0.0}


def evaluate(name, function, cases, options):
    """Call a function for each case, and write what it finds to a file.

    Parameters
    ----------
    name : str
        Of the benchmark, and of the file.
    function : callable
        Of a case and the options; returns a dict of figures, and the case's name as "case". With
        ``options.jobs`` above 1, other processes call it.
    cases : iterable
        Every ``options.every``-th of those with ``options.only`` in their names is taken.
    options : Namespace

    Returns
    -------
    found : list of dict
        In the order of the cases. A case that raised is in the file only.
    failed : Measure
        How many cases raised.
    """
    chosen = [case for case in cases if options.only in str(case)][:: options.every]
    tasks = (delayed(_guarded)(function, k, case, options) for k, case in enumerate(chosen))
    start, found = perf_counter(), []
    parallel = Parallel(n_jobs=options.jobs, batch_size=1, return_as="generator_unordered")
    try:
        for done in parallel(tasks):
            found.append(done)
            _tell(name, len(found), len(chosen), done)
    finally:
        found.sort(key=lambda figures: figures["number"])
        _write(name, found, perf_counter() - start, options)
    failed = [figures for figures in found if _FAILED in figures]
    for figures in failed:
        print(f"  {name}: {figures['case']}: {figures[_FAILED]}", file=sys.stderr)
    seconds = sum(figures["wall"] for figures in found)
    print(
        f"  {name}: {len(found)} cases, {len(failed)} failed; {seconds:.0f} s in one process "
        "without the rivals",
        file=sys.stderr,
        flush=True,
    )
    ended = [figures for figures in found if _FAILED not in figures]
    return ended, Measure("cases that failed", float(len(failed)), "", 0)


def _guarded(function, number, case, options):
    """A case's figures, or what it raised: one case must not end the run."""
    start, before = perf_counter(), _spent["rivals"]
    try:
        figures = function(case, options)
    except Exception as error:
        figures = {"case": str(case), _FAILED: f"{type(error).__name__}: {error}"}
    # Without the rivals, which take no time once they are remembered.
    wall = perf_counter() - start - (_spent["rivals"] - before)
    return figures | {"wall": wall, "number": number}


def _tell(name, n_done, n_cases, figures):
    ratio = f" {figures['ratio']:.3f}" if "ratio" in figures else ""
    print(f"  {name} {n_done}/{n_cases}: {figures['case']}{ratio}", file=sys.stderr, flush=True)


def _write(name, found, wall, options):
    path = CACHE / (options.keep or "last") / f"{name}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    content = {
        "benchmark": name,
        "commit": _commit(),
        "estimator_params": options.estimator_params,
        "every": options.every,
        "only": options.only,
        "wall": wall,
        "cases": found,
    }
    _replace(path, json.dumps(content, indent=1, default=float))
    print(f"  {name}: written to {path}", file=sys.stderr)


def _commit():
    """Of the sources that are measured; "-dirty" where they have been changed since."""
    folder = Path(skanfis.__file__).parent
    command = ["git", "describe", "--always", "--dirty"]
    found = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    return found.stdout.strip() or str(folder)


def remembered(folder, name, function, *data, packages=(), fit=True):
    """What a function of arrays returned the last time with the same data and versions.

    Parameters
    ----------
    folder, name : str
        Of the file in ``.cache/rivals``.
    function : callable
        Of ``data``; returns what JSON can hold.
    *data : arrays
    packages : sequence of str
        Whose versions count too, beside NumPy's, SciPy's and scikit-learn's.
    fit : bool
        Whether to call the function where nothing is remembered.

    Returns
    -------
    found : object, or None where a package is not installed, or nothing is remembered
    """
    try:
        digest = sha1(" ".join(f"{p} {version(p)}" for p in (*_VERSIONS, *packages)).encode())
    except PackageNotFoundError:
        return None
    for array in data:
        digest.update(np.ascontiguousarray(array).tobytes())
    name = name.replace("/", "-").replace(" ", "_")
    path = CACHE / "rivals" / folder / f"{name}-{digest.hexdigest()[:12]}.json"
    if path.exists():
        return json.loads(path.read_text(encoding="utf-8"))
    if not fit:
        return None
    start = perf_counter()
    found = function(*data)
    _spent["rivals"] += perf_counter() - start
    path.parent.mkdir(parents=True, exist_ok=True)
    _replace(path, json.dumps(found, default=float))
    return found


def _replace(path, text):
    """No half-written file, whoever else writes it."""
    draft = path.with_name(f"{path.name}.{os.getpid()}")
    draft.write_text(text, encoding="utf-8")
    draft.replace(path)


def fitted(X, y, options, groups=None, **params):
    """An ANFISRegressor with these parameters and the options', and seconds of its fit."""
    regressor = ANFISRegressor(**params | options.estimator_params)
    return timed(regressor.fit, X, y, groups=groups)


def folds(X, n_folds=5):
    return KFold(n_folds, shuffle=True, random_state=0).split(X)


def fitted_in_folds(X, y, options, n_folds=5, **params):
    """Of each fold: the model, seconds of its fit, its rows, and its errors on the others."""
    for train, test in folds(X, n_folds):
        model, seconds = fitted(X[train], y[train], options, **params)
        yield model, seconds, train, model.predict(X[test]) - y[test]


def kept(path):
    """A file that ``evaluate`` wrote, the cases by name."""
    content = json.loads(Path(path).read_text(encoding="utf-8"))
    return content | {"cases": {figures["case"]: figures for figures in content["cases"]}}
