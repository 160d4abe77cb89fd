"""Runs a benchmark in a process of its own, so that none profits from what ran before it."""

from concurrent.futures import ProcessPoolExecutor
from importlib import import_module
from multiprocessing import get_context

__all__ = ["run_alone"]


def run_alone(name, options):
    """The results of the benchmark of this name, from a fresh process."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
        return process.submit(_run, name, options).result()


def _run(name, options):
    return import_module(f"benchmarks.{name}").run(options)
