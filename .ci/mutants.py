"""Mutation testing of the kernel and of structure: does every test that should fail, fail?

    python .ci/mutants.py [MODULE ...] [--sample N] [--seed S]

mutmut makes a module's mutants, each a copy of one function with one small change; those drawn
meet the tests that mirror the module, until the first that fails. Survivors are printed with what
was changed. Left alone are properties and other decorated functions, constants of modules (mutmut
changes neither), and the words of messages.
"""

import argparse
import ast
import collections
import difflib
import json
import os
import random
import re
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

from mutmut.mutation.file_mutation import mutate_file_contents

ROOT = Path(__file__).resolve().parent.parent
# Modules, and the tests that mirror them: these are run once for all of a group before any mutant.
GROUPS = {
    "membership/__init__ membership/base membership/bell membership/flanked membership/gaussian "
    "membership/profiles membership/sigmoid": (
        "membership/test_families.py membership/test_flanked.py membership/test_profiles.py "
        "membership/test_sigmoid.py"
    ),
    "antecedent/base antecedent/grid antecedent/rule_table antecedent/scattered": (
        "antecedent/test_antecedent.py"
    ),
    "data": "test_data.py test_extremes.py",
    "consequent gram passes penalty objective": (
        "test_consequent.py test_penalty.py test_objective.py solvers/test_gradient.py "
        "test_posterior.py training/test_many_rows.py"
    ),
    "ordered_terms premise": "test_ordered_terms.py test_premise.py",
    "evidence": "test_evidence.py",
    "faces posterior": "test_posterior.py",
    "dask/keeping": "dask/test_keeping.py",
    "structure/clusters structure/grid structure/sample structure/size": (
        "structure/test_clusters.py structure/test_grid.py structure/test_size.py"
    ),
    "structure/imported structure/request": (
        "structure/test_request.py structure/test_size.py structure/test_imported.py "
        "structure/test_search.py::test_family_is_that_of_the_truth_where_it_is_asked_for"
    ),
    "structure/candidate structure/held_out structure/readable_terms structure/search "
    "structure/terms structure/trials structure/tuning": (
        "structure/test_search.py structure/test_trials.py structure/test_terms.py "
        "structure/test_held_out.py "
        "structure/test_tuning.py structure/test_candidate.py structure/test_readable_terms.py "
        "structure/test_request.py::test_radius_of_clusters_is_reported_and_is_that_of_the_clusterer"
    ),
}
MODULES = " ".join(GROUPS).split()
# pytest's exit status of a mutant's tests, or mutmut's own.
KINDS = {0: "survived", 1: "killed", 3: "killed", 5: "untested", 33: "untested"}
COLUMNS = ("mutants", "drawn", "killed", "timed out", "survived", "untested")


class _WithoutWords(ast.NodeTransformer):
    """Strings with a space in them are for people."""

    def visit_Constant(self, node):
        words = isinstance(node.value, str) and " " in node.value
        return ast.Constant("") if words else node


def path_of(module):
    return Path("skanfis", f"{module}.py")


def mutants(module):
    """What is changed, by the mutants' names; but for those that differ in words alone."""
    path = path_of(module)
    mutated = mutate_file_contents(str(path), (ROOT / path).read_text())
    source, trees = {}, {}
    for node in ast.walk(ast.parse(mutated.code)):
        if isinstance(node, ast.FunctionDef) and "__mutmut_" in node.name:
            name, node.name = node.name, ""
            source[name] = [
                line.replace(name, name.split("__mutmut_")[0])
                for line in mutated.code.splitlines()[node.lineno - 1 : node.end_lineno]
            ]
            trees[name] = ast.dump(_WithoutWords().visit(node))
    found = {}
    for name in mutated.mutant_names:
        original = re.sub(r"\d+$", "orig", name)
        if trees[name] != trees[original]:
            lines = difflib.unified_diff(source[original], source[name], n=1, lineterm="")
            full = ".".join(path.with_suffix("").parts).removesuffix(".__init__")
            found[f"{full}.{name}"] = "\n".join(list(lines)[3:])
    return found


def project(folder, modules, tests):
    """A project of a few modules to mutate, and the tests that their mutants meet."""
    for name in ("skanfis", "tests"):
        (folder / name).symlink_to(ROOT / name)
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]
    own = {
        "only_mutate": [str(path_of(module)) for module in modules],
        "pytest_add_cli_args_test_selection": [f"tests/{name}" for name in tests],
    }
    tables = {
        "tool.pytest.ini_options": settings["pytest"]["ini_options"],
        "tool.mutmut": settings["mutmut"] | own,
    }
    lines = []
    for table, entries in tables.items():
        # Strings, numbers, booleans and lists of these are written alike in JSON and TOML.
        lines += [f"[{table}]", *(f"{key} = {json.dumps(value)}" for key, value in entries.items())]
    (folder / "pyproject.toml").write_text("\n".join(lines))


def exit_codes(folder, modules, names):
    """Run the tests of the named mutants; the exit status of each."""
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    # The order in which a mutant meets its tests is that of a set.
    environment["PYTHONHASHSEED"] = "0"
    run = subprocess.run(
        [sys.executable, "-m", "mutmut", "run", "--max-children", "1", *names],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
    )
    if run.returncode:
        # Before a carriage return stands what its progress overwrites.
        said = re.sub(r".*\r", "", run.stdout + run.stderr)
        sys.exit(f"mutmut failed for {', '.join(modules)}\n{said[-4000:]}")
    codes = {}
    for module in modules:
        found = json.loads((folder / "mutants" / f"{path_of(module)}.meta").read_text())
        codes |= found["exit_code_by_key"]
    return codes


def tried(modules, tests, sample, seed):
    """One line of the table per module."""
    every, drawn = {}, {}
    for module in modules:
        every[module] = mutants(module)
        # A larger sample holds the smaller one, and no module's depends on another's.
        names = list(every[module])
        random.Random(f"{seed} {module}").shuffle(names)
        drawn[module] = sorted(names[:sample])
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        project(folder, modules, tests)
        codes = exit_codes(folder, modules, [name for names in drawn.values() for name in names])
    lines = {}
    for module, names in drawn.items():
        kinds = {name: KINDS.get(codes[name], "timed out") for name in names}
        for name, kind in kinds.items():
            if kind != "killed":
                print(f"{kind}: {name}\n{every[module][name]}\n")
        counts = collections.Counter(kinds.values())
        lines[module] = {"mutants": len(every[module]), "drawn": len(names), **counts}
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("modules", nargs="*", metavar="MODULE", help="all if none is given")
    parser.add_argument("--sample", type=int, default=25, help="mutants drawn of every module")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    if unknown := set(given.modules) - set(MODULES):
        parser.error(f"no {', '.join(sorted(unknown))} among {', '.join(MODULES)}")
    rows = {}
    for modules, tests in GROUPS.items():
        chosen = [module for module in modules.split() if module in (given.modules or MODULES)]
        if chosen:
            rows |= tried(chosen, tests.split(), given.sample, given.seed)
            print("done:", ", ".join(chosen), "\n", flush=True)
    rows["all"] = {c: sum(row.get(c, 0) for row in rows.values()) for c in COLUMNS}
    print("| module |", " | ".join(COLUMNS), "| score |")
    print("|---" * (len(COLUMNS) + 2) + "|")
    for module, row in rows.items():
        score = (row.get("killed", 0) + row.get("timed out", 0)) / max(row["drawn"], 1)
        print(f"| {module} |", " | ".join(str(row.get(c, 0)) for c in COLUMNS), f"| {score:.0%} |")


if __name__ == "__main__":
    main()
