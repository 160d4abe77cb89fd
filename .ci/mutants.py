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
KERNEL = ["test_objective.py", "test_penalty.py", "test_consequent.py"]
FAMILIES = [f"membership/test_{name}.py" for name in ("families", "flanked", "profiles", "sigmoid")]
STRUCTURE = [f"structure/test_{name}.py" for name in ("search", "terms", "request")]
# Every module with the tests that mirror it.
TESTS = {
    "membership/__init__": FAMILIES,
    "membership/base": FAMILIES,
    "membership/bell": FAMILIES,
    "membership/flanked": FAMILIES,
    "membership/gaussian": FAMILIES,
    "membership/profiles": FAMILIES,
    "membership/sigmoid": FAMILIES,
    "antecedent/base": ["antecedent/test_antecedent.py"],
    "antecedent/grid": ["antecedent/test_antecedent.py"],
    "antecedent/rule_table": ["antecedent/test_antecedent.py"],
    "antecedent/scattered": ["antecedent/test_antecedent.py"],
    "consequent": KERNEL,
    "gram": KERNEL,
    "rows": ["test_rows.py", "test_extremes.py"],
    "passes": KERNEL,
    "penalty": ["test_penalty.py"],
    "objective": KERNEL,
    "premise": ["test_premise.py"],
    "evidence": ["test_evidence.py"],
    "posterior": ["test_posterior.py"],
    "structure/candidate": STRUCTURE,
    "structure/clusters": ["structure/test_clusters.py"],
    "structure/grid": ["structure/test_grid.py"],
    "structure/held_out": STRUCTURE,
    "structure/imported": STRUCTURE,
    "structure/request": ["structure/test_request.py", "structure/test_size.py"],
    "structure/sample": ["structure/test_size.py", "structure/test_clusters.py"],
    "structure/search": STRUCTURE,
    "structure/size": ["structure/test_size.py"],
    "structure/terms": STRUCTURE,
    "structure/tuning": STRUCTURE,
}
# pytest's exit status of a mutant's tests, or mutmut's own.
KILLED, SURVIVED, WITHOUT_TESTS = (1, 3), (0,), (5, 33)
COLUMNS = ("mutants", "drawn", "killed", "timed out", "survived", "untested")


class _WithoutWords(ast.NodeTransformer):
    """Strings with a space in them are for people."""

    def visit_Constant(self, node):  # noqa: N802
        words = isinstance(node.value, str) and " " in node.value
        return ast.Constant("") if words else node


def mutants(path):
    """Names of the module's mutants, but for those that differ in words alone."""
    mutated = mutate_file_contents(str(path), (ROOT / path).read_text())
    bodies = {}
    for node in ast.walk(ast.parse(mutated.code)):
        if isinstance(node, ast.FunctionDef) and "__mutmut_" in node.name:
            name, node.name = node.name, ""
            bodies[name] = ast.dump(_WithoutWords().visit(node))
    module = ".".join(path.with_suffix("").parts).removesuffix(".__init__")
    return [
        f"{module}.{name}"
        for name in mutated.mutant_names
        if bodies[name] != bodies[re.sub(r"\d+$", "orig", name)]
    ]


def project(folder, path, tests):
    """A project of one module to mutate, and the tests that it meets."""
    for name in ("skanfis", "tests"):
        (folder / name).symlink_to(ROOT / name)
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]
    own = {
        "source_paths": ["skanfis"],
        "only_mutate": [str(path)],
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


def mutmut(folder, *arguments):
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    # The order in which a mutant meets its tests is that of a set.
    environment |= {"PYTHONHASHSEED": "0", "COLUMNS": "100"}
    return subprocess.run(
        [sys.executable, "-m", "mutmut", *arguments],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
    )


def tried(module, sample, seed):
    """One line of the table."""
    path = Path("skanfis", f"{module}.py")
    every = mutants(path)
    # A larger sample holds the smaller one, and no module's depends on another's.
    random.Random(f"{seed} {module}").shuffle(every)
    drawn = sorted(every[:sample])
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        project(folder, path, TESTS[module])
        run = mutmut(folder, "run", "--max-children", "1", *drawn)
        found = folder / "mutants" / f"{path}.meta"
        if run.returncode or not found.exists():
            sys.exit(f"{module}: mutmut failed\n{run.stdout[-4000:]}{run.stderr[-4000:]}")
        codes = json.loads(found.read_text())["exit_code_by_key"]
        counts = collections.Counter(_kind(codes[mutant]) for mutant in drawn)
        for mutant in drawn:
            if _kind(codes[mutant]) != "killed":
                print(mutmut(folder, "show", mutant).stdout, flush=True)
    return {"mutants": len(every), "drawn": len(drawn), **counts}


def _kind(code):
    for kind, codes in (("killed", KILLED), ("survived", SURVIVED), ("untested", WITHOUT_TESTS)):
        if code in codes:
            return kind
    return "timed out"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("modules", nargs="*", help=f"of {', '.join(TESTS)}; all if none is given")
    parser.add_argument("--sample", type=int, default=25, help="mutants drawn of every module")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    rows = {}
    for module in given.modules or TESTS:
        rows[module] = tried(module, given.sample, given.seed)
        print(module, rows[module], flush=True)
    rows["all"] = {c: sum(row.get(c, 0) for row in rows.values()) for c in COLUMNS}
    print("| module |", " | ".join(COLUMNS), "| score |")
    print("|---" * (len(COLUMNS) + 2) + "|")
    for module, row in rows.items():
        score = (row.get("killed", 0) + row.get("timed out", 0)) / max(row["drawn"], 1)
        print(f"| {module} |", " | ".join(str(row.get(c, 0)) for c in COLUMNS), f"| {score:.0%} |")


if __name__ == "__main__":
    main()
