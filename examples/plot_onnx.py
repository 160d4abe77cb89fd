"""
A pipeline in ONNX
==================

This page converts a scaler and an ANFIS together to ONNX, runs the graph with onnxruntime, and
compares it with ``predict`` in either precision. ``pip install ".[onnx]"`` has what it takes;
:doc:`/onnx` says more.
"""

import warnings

import matplotlib.pyplot as plt
import numpy as np
import onnxruntime
import skl2onnx
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skanfis import ANFISRegressor
from skanfis.datasets import make_jang_sinc
from skanfis.exceptions import OutOfBoundsWarning
from skanfis.export import register_onnx_converter

X, y = make_jang_sinc()
pipeline = make_pipeline(StandardScaler(), ANFISRegressor(n_mfs=4, out_of_bounds="linear"))
pipeline.fit(X, y)

# %%
# Conversion
# ----------
#
# One call makes the estimator known to skl2onnx. The type of the sample row is the precision of the
# graph.

register_onnx_converter()


def session(dtype):
    """The pipeline, ready to run."""
    graph = skl2onnx.to_onnx(pipeline, X[:1].astype(dtype))
    print(f"{np.dtype(dtype).name}: {len(graph.SerializeToString())} bytes")
    return onnxruntime.InferenceSession(graph.SerializeToString())


sessions = {dtype: session(dtype) for dtype in (np.float64, np.float32)}

# %%
# Answers
# -------
#
# Along a line through the data and on beyond its edges, where the policy of this pipeline is to
# continue linearly.

line = np.linspace(-14.0, 14.0, 401)
rows = np.column_stack([line, 0.3 * line])
with warnings.catch_warnings():
    warnings.simplefilter("ignore", OutOfBoundsWarning)
    expected = pipeline.predict(rows)

figure, (above, below) = plt.subplots(2, 1, figsize=(7, 5), sharex=True, layout="constrained")
above.plot(line, expected, label="predict", linewidth=4, alpha=0.4)
for dtype, style in [(np.float64, "-"), (np.float32, "--")]:
    (answer,) = sessions[dtype].run(None, {"X": rows.astype(dtype)})
    label = f"onnxruntime, {np.dtype(dtype).name}"
    above.plot(line, answer, label=label, color="black", linewidth=1, linestyle=style)
    difference = np.abs(answer[:, 0] - expected)
    below.plot(line, difference, label=label, color="black", linewidth=1, linestyle=style)
    print(f"{label}: largest difference {difference.max():.1e}")
above.set_ylabel("y")
above.legend()
below.set_yscale("log")
below.set_ylabel("difference")
below.set_xlabel("$x_1 = x_2 / 0.3$")
for panel in (above, below):
    panel.axvspan(-14.0, -10.0, color="0.9")
    panel.axvspan(10.0, 14.0, color="0.9")
