"""
How a model is trained
======================

Three solvers on one problem; training that stops before it learns the noise; and a loss to which
outliers do little. :doc:`/training` describes these options and the others, :doc:`/choosing` says
which to choose.
"""

import matplotlib.pyplot as plt
import numpy as np
from sklearn.base import clone

from skanfis import ANFISRegressor
from skanfis.datasets import make_jang_sinc
from skanfis.learning import GradientDescent, Hybrid, VariableProjection
from skanfis.options import EarlyStopping

# %%
# Solvers
# -------
#
# Four terms on each of two inputs, from the same start, and without the penalties that the default
# finds, so that all three minimise the same. Variable projection gets further in a dozen iterations
# than Jang's hybrid rule in five hundred. Plain gradient descent on premises and consequents
# together gets almost nowhere: they move along a curved valley, and without eliminating one of them
# it has to be followed step by step.

X, y = make_jang_sinc()
solvers = {
    "variable projection": VariableProjection(stiffness=0.0),
    "Jang's hybrid rule": Hybrid(step_size=0.003, stiffness=0.0),
    "gradient descent": GradientDescent(step_size=0.1, stiffness=0.0),
}
free = ANFISRegressor(n_mfs=4, agreement=0.0, alpha=0.0)
models = {name: clone(free).set_params(solver=s).fit(X, y) for name, s in solvers.items()}

figure, panel = plt.subplots(figsize=(6, 3.5), layout="constrained")
for name, model in models.items():
    panel.loglog(1 + np.arange(model.loss_curve_.size), np.sqrt(model.loss_curve_), label=name)
panel.set_xlabel("1 + iterations")
panel.set_ylabel("RMS error [deviations of the target]")
panel.legend()

# %%
# What they did to the memberships of one input: dashed as they started, solid as they ended. The
# default, which finds its penalties by the evidence, ends in a far better place than any of them.

models["all defaults"] = ANFISRegressor(n_mfs=4).fit(X, y)


def draw(panel, memberships, **style):
    """The Gaussian terms of the first input."""
    x = np.linspace(-10.0, 10.0, 401)
    own = [term for term in memberships if term["input"] == "x0"]
    for number, term in enumerate(own):
        z = (x - term["center"]) / term["width"]
        panel.plot(x, np.exp(-0.5 * z**2), color=f"C{number}", **style)


figure, panels = plt.subplots(1, 4, figsize=(11, 2.6), sharey=True, layout="constrained")
for panel, (name, model) in zip(panels, models.items(), strict=True):
    draw(panel, model.initial_memberships_, linestyle="--", alpha=0.5)
    draw(panel, model.memberships_)
    rms = np.sqrt(np.mean((model.predict(X) - y) ** 2))
    panel.set_title(f"{name}: RMS {rms:.1e}", fontsize="medium")
figure.supxlabel("input x0")
panels[0].set_ylabel("membership")

# %%
# Early stopping
# --------------
#
# Six terms on one input, for a hundred noisy rows of a step, with nothing that holds the rules
# together. The training error falls all the way. The error on the rows held out does not, and the
# model of its minimum is the one that is kept.

rng = np.random.default_rng(7)
x_noisy = rng.uniform(0.0, 10.0, (100, 1))
y_noisy = np.tanh(4.0 * (x_noisy[:, 0] - 3.2)) + 0.3 * rng.standard_normal(100)
stopped = ANFISRegressor(
    n_mfs=6,
    agreement=0.0,
    alpha=0.0,
    solver=VariableProjection(tol=1e-5, stiffness=0.0),
    early_stopping=EarlyStopping(validation_fraction=0.3, tol=1e-4),
).fit(x_noisy, y_noisy)

figure, panel = plt.subplots(figsize=(6, 4), layout="constrained")
panel.semilogy(stopped.loss_curve_, label="rows of training")
held_out = stopped.validation_loss_curve_
panel.semilogy(np.arange(1, 1 + len(held_out)), held_out, "--", label="rows held out")
panel.set(xlabel="iteration", ylabel="mean squared error, standardised target")
panel.legend()
panel.axvline(1 + held_out.argmin(), color="grey", linestyle=":")

# %%
# Outliers
# --------
#
# A tenth of the targets are off by 1 to 4; the truth has a range of 2. Least squares follows them;
# Huber's loss gives them the weight that is left in ``robust_weights_``.

x = np.sort(rng.uniform(0.0, 10.0, (300, 1)), axis=0)
truth = np.sin(x[:, 0])
measured = truth + 0.1 * rng.standard_normal(300)
hit = rng.random(300) < 0.1
measured[hit] += rng.uniform(1.0, 4.0, hit.sum())

figure, panel = plt.subplots(figsize=(7, 3.5), layout="constrained")
for loss in ("squared_error", "huber"):
    model = ANFISRegressor(loss=loss).fit(x, measured)
    error = np.sqrt(np.mean((model.predict(x) - truth) ** 2))
    panel.plot(x, model.predict(x), label=f'"{loss}": {error:.3f} from the truth')
panel.plot(x, truth, color="black", linestyle=":", label="truth")
dots = panel.scatter(x, measured, c=model.robust_weights_, s=9, cmap="viridis", vmin=0.0, vmax=1.0)
figure.colorbar(dots, label="weight left by Huber's loss")
panel.set_xlabel("input")
panel.set_ylabel("target")
panel.set_ylim(top=7.5)
panel.legend(loc="upper right")

plt.show()
