"""Runs a benchmark in a process of its own, so that none profits from what ran before it."""

import warnings
from concurrent.futures import ProcessPoolExecutor
from importlib import import_module
from multiprocessing import get_context

__all__ = ["alone", "run_benchmark"]


def alone(function, *args):
    """What a function returns in a fresh process."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
        return process.submit(function, *args).result()


def run_benchmark(name, options):
    """The results of the benchmark of this name."""
    # Rows outside the training data, iterations cut short: on purpose here.
    warnings.simplefilter("ignore")
    return import_module(f"benchmarks.{name}").run(options)
