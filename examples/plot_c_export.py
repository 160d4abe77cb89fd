"""
A compensator in C
==================

Six terms on the temperature times six on the rate, as in the founding paper, are 36 rules. This
page trains them on one simulated fibre-optic gyro, writes them as C, compiles that and compares it
with Python. A C compiler named ``gcc`` or ``clang`` is all it takes; :doc:`/c_export` says what the
files promise.
"""

import shutil
import subprocess
import tempfile
import warnings
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skanfis import ANFISRegressor
from skanfis.datasets import make_ofog
from skanfis.exceptions import OutOfBoundsWarning
from skanfis.export import export_c

gyro = make_ofog(n_devices=1, random_state=0)
X, error = gyro[["temperature", "output"]], gyro["error"]
compensator = make_pipeline(StandardScaler(), ANFISRegressor(n_mfs=6, alpha=1e-4))
compensator.fit(X, error)

# %%
# Two files
# ---------
#
# The scaler is folded in: the function takes degrees Celsius and degrees per second. In single
# precision and C89, it suits a signal processor of the paper's time.

folder = Path(tempfile.mkdtemp())
code = export_c(compensator, folder / "gyro", dtype="float", std="c89")
print(code.header)

# %%
# The cost is at hand for a program too.

code.cost

# %%
# The function itself
# -------------------

print(code.source[code.source.index("int gyro_predict") : code.source.index("#ifdef GYRO_SELF")])

# %%
# Compiled
# --------
#
# The file holds rows with known answers. With ``GYRO_SELF_TEST_MAIN`` it is a program that checks
# them.

compiler = shutil.which("gcc") or shutil.which("clang")
if compiler is None:
    raise SystemExit("This example needs a C compiler named gcc or clang.")


def build(*arguments):
    """Compile with all warnings as errors."""
    flags = ["-std=c89", "-O2", "-Wall", "-Wextra", "-Werror", "-pedantic"]
    subprocess.run([compiler, *flags, *arguments, "-lm"], cwd=folder, check=True)


build("-DGYRO_SELF_TEST", "-DGYRO_SELF_TEST_MAIN", "gyro.c", "-o", "self_test")
status = subprocess.run([folder / "self_test"], check=False).returncode
print("self-test:", "passed" if status == 0 else "failed")

# %%
# Beside Python
# -------------
#
# A small program reads rows and writes answers. The temperatures go 20 degrees beyond the data,
# where both follow the tangent. What single precision loses is far below what the gyro can resolve.

main = """
#include <stdio.h>
#include "gyro.h"
int main(void)
{
    float x[GYRO_N_INPUTS], y[GYRO_N_OUTPUTS];
    while (scanf("%f %f", &x[0], &x[1]) == 2) {
        const int status = gyro_predict(x, y);
        printf("%.9g %d\\n", y[0], status);
    }
    return 0;
}
"""
(folder / "main.c").write_text(main, encoding="ascii")
build("main.c", "gyro.c", "-o", "gyro")

temperature = np.linspace(X["temperature"].min() - 20.0, X["temperature"].max() + 20.0, 400)
rows = np.column_stack([temperature, np.full(400, 60.0)]).astype(np.float32)
text = "\n".join(f"{a:.9g} {b:.9g}" for a, b in rows)
done = subprocess.run([folder / "gyro"], input=text, capture_output=True, text=True, check=True)
in_c, status = np.array([line.split() for line in done.stdout.splitlines()], dtype=float).T

with warnings.catch_warnings():
    # The status tells which rows are out of range.
    warnings.simplefilter("ignore", OutOfBoundsWarning)
    in_python = compensator.predict(pd.DataFrame(rows, columns=X.columns))

figure, (above, below) = plt.subplots(2, 1, figsize=(7, 5), sharex=True, layout="constrained")
above.plot(temperature, in_python, label="Python", linewidth=4, alpha=0.4)
above.plot(temperature, in_c, label="C, float", color="black", linewidth=1)
above.set_ylabel("error at 60 °/s [°/s]")
above.legend()
below.plot(temperature, np.abs(in_c - in_python), color="black", linewidth=1)
below.set_yscale("log")
below.set_ylabel("difference [°/s]")
below.set_xlabel("temperature [°C]")
for panel in (above, below):
    # GYRO_OUT_OF_RANGE is the lowest bit of the status.
    across = {"transform": panel.get_xaxis_transform(), "color": "0.9"}
    panel.fill_between(temperature, 0.0, 1.0, where=status % 2 == 1, **across)
below.text(0.02, 0.06, "out of range", color="0.4", transform=below.transAxes)

shutil.rmtree(folder)
