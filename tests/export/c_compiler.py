"""Compiles exported files with every warning an error and runs them under the sanitizers."""

import os
import shutil
import subprocess

import numpy as np
import pytest

COMPILER = shutil.which("gcc") or shutil.which("clang")
needs_compiler = pytest.mark.skipif(
    COMPILER is None, reason="NO C COMPILER (gcc or clang): EXPORTED C IS NOT COMPILED OR RUN"
)

STRICT = ["-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wshadow", "-Wundef"]
SANITIZE = [
    "-fsanitize=address,undefined,float-divide-by-zero,float-cast-overflow",
    "-fno-sanitize-recover=all",
    "-g0",
]

REALS = {"float32": "float", "float64": "double"}
REALS |= {"int32": "int_least32_t", "int16": "int_least16_t"}

# Reads rows from one file, and writes to another what the functions make of them.
_DRIVER = """
#include <stdio.h>
#include <stdlib.h>

{includes}

typedef {real} real;
static real x[{n_rows}][{n_inputs}];
static real y[{n_rows}][{most_outputs}];
static int status[{n_rows}];

int main(void)
{{
    FILE *in = fopen("rows", "rb"), *out = fopen("answers", "wb");
    int i, o;
    if (!in || !out || fread(x, sizeof x, 1, in) != 1) {{
        return 2;
    }}
    {calls}
    fclose(in);
    return fclose(out) == 0 ? 0 : 2;
}}
"""
_CALL = """
    if ({name}_self_test() != 0) {{
        printf("self-test of {name}: row %d\\n", {name}_self_test());
        return 3;
    }}
    for (i = 0; i < {n_rows}; ++i) {{
        for (o = 0; o < {n_outputs}; ++o) {{
            y[i][o] = (real)-12345.0;
        }}
        status[i] = {name}_predict(x[i], y[i]);
    }}
    for (i = 0; i < {n_rows}; ++i) {{
        fwrite(y[i], sizeof(real), {n_outputs}, out);
    }}
    fwrite(status, sizeof status, 1, out);
"""
UNTOUCHED = -12345.0


def gcc(arguments, folder, compiler=COMPILER):
    """It compiles without a message; else these are the failure's."""
    command = [compiler, *arguments]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[:4000]


def told(header):
    """The first comment of a header as one line."""
    return " ".join(header.partition("*/\n")[0].replace("\n *", " ").split())


def run(command, folder):
    # Address space that the leak check asks for is not to be had in every container.
    environment = os.environ | {"ASAN_OPTIONS": "detect_leaks=0"}
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False, env=environment
    )


def evaluate_all(codes, X, folder, std, n_outputs, flags=SANITIZE):
    """What compiled models answer: per model outputs (n_rows, n_outputs) and status (n_rows,).

    Each comes after the model's self-test. All models are in one translation unit: nothing of one
    may clash with another. The sanitizers make compiling six times as long.
    """
    for code in codes:
        (folder / f"{code.name}.h").write_text(code.header, encoding="ascii")
        (folder / f"{code.name}.c").write_text(code.source, encoding="ascii")
    driver = _DRIVER.format(
        includes="".join(
            f'#define {code.name.upper()}_SELF_TEST\n#include "{code.name}.c"\n' for code in codes
        ),
        real=REALS[X.dtype.name],
        n_rows=len(X),
        n_inputs=X.shape[1],
        most_outputs=max(n_outputs),
        calls="".join(
            _CALL.format(name=code.name, n_rows=len(X), n_outputs=n)
            for code, n in zip(codes, n_outputs, strict=True)
        ),
    )
    (folder / "driver.c").write_text(driver, encoding="ascii")
    X.tofile(folder / "rows")
    gcc([f"-std={std}", *STRICT, *flags, "driver.c", "-o", "driver", "-lm"], folder)
    done = run(["./driver"], folder)
    assert done.returncode == 0, (done.stdout + done.stderr)[:4000]
    data, answers, place = (folder / "answers").read_bytes(), [], 0
    for n in n_outputs:
        y = np.frombuffer(data, X.dtype, len(X) * n, place).reshape(-1, n)
        place += y.nbytes
        status = np.frombuffer(data, np.intc, len(X), place)
        place += status.nbytes
        answers.append((y, status))
    assert place == len(data)
    return answers
