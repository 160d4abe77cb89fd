"""Fits one other package, in that package's own environment: ``python _peer.py NAME DATA.npz``.

Imports nothing of skanfis or of these benchmarks, which are not installed there.
"""

import io
import json
import sys
from contextlib import redirect_stdout
from time import process_time

import numpy as np


def anfis_toolbox():
    from anfis_toolbox import ANFISRegressor

    return ANFISRegressor()


def highfis(epochs=100):
    """The best kind found: rules on a grid, and least squares for the consequents at the end."""
    from highfis import InputConfig, TSKRegressor

    inputs = [InputConfig(name, n_mfs=4) for name in ("time", "temperature", "rate")]
    return TSKRegressor(
        input_configs=inputs, mf_init="grid", use_lse=True, epochs=epochs, random_state=0
    )


MODELS = {
    "anfis-toolbox, defaults (27 rules)": anfis_toolbox,
    "highfis, grid of 64 rules, use_lse=True": highfis,
    "highfis, the same, 1,000 epochs": lambda: highfis(1000),
}


def main(name, path):
    data = np.load(path)
    X, y = data["X"], data["y"]
    offset, scale, center, spread = X.mean(axis=0), X.std(axis=0), y.mean(), y.std()
    model = MODELS[name]()
    start = process_time()
    with redirect_stdout(io.StringIO()):
        model.fit((X - offset) / scale, (y - center) / spread)
    seconds = process_time() - start
    prediction = center + spread * np.asarray(model.predict((data["X_test"] - offset) / scale))
    return {"seconds": seconds, "prediction": prediction.ravel().tolist()}


if __name__ == "__main__":
    print(json.dumps(main(*sys.argv[1:])))
