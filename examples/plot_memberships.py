"""
Families of membership functions
================================

Ten families can be the terms of a model; ``mf`` chooses one. This page draws them, shows what their
normalised strengths look like, and trains each on the same data. :doc:`/memberships` has the
formulas.
"""

import matplotlib.pyplot as plt
import numpy as np

from skanfis import ANFISRegressor
from skanfis.datasets import make_jang_sinc
from skanfis.membership import MEMBERSHIPS

# %%
# Shapes
# ------
#
# Families with flanks may be wider on one side than on the other, and have a plateau. Each panel
# shows two terms of one family: as it is at the start of training, and after its parameters have
# moved.


def two_terms(family):
    """Parameters of a term as it starts, and of one that has moved to the right of it."""
    theta = family.start(np.array([-2.0, 2.0]), np.array([3.0, 3.0]), 0.5)
    names = [parameter.name for parameter in family.parameters]
    for name, factor in {"left": 0.4, "flank": 0.4, "slope": 3.0, "plateau": 2.0}.items():
        if name in names:
            theta[names.index(name), 1] += np.log(factor)
    return theta


x = np.linspace(-6.0, 6.0, 601)
n_lines = -(-len(MEMBERSHIPS) // 5)
figure, panels = plt.subplots(
    n_lines, 5, figsize=(10, 2 * n_lines), sharex=True, sharey=True, layout="constrained"
)
for panel, (name, family) in zip(panels.flat, MEMBERSHIPS.items(), strict=False):
    panel.plot(x, family.value(x, two_terms(family)).T)
    panel.set_title(name, fontsize="medium")
for panel in panels.flat[len(MEMBERSHIPS) :]:
    panel.axis("off")
figure.supxlabel("input")
figure.supylabel("membership")

# %%
# Strengths
# ---------
#
# A rule counts by its share of all strengths. These are the shares of three terms on one input, as
# training starts. With S-shaped terms, which read "at least low", "at least middle" and "at least
# high", several terms hold at once, and share alike where they all do.


def shares(family):
    """Normalised memberships of three terms."""
    theta = family.start(np.array([-4.0, 0.0, 4.0]), np.full(3, 4.0), 0.6)
    log_mu = family.log_value(x, theta)
    mu = np.exp(log_mu - log_mu.max(axis=0))
    return mu / mu.sum(axis=0)


chosen = ["gaussian", "triangular", "pi_shaped", "s_shaped"]
figure, panels = plt.subplots(1, 4, figsize=(9, 2.2), sharey=True, layout="constrained")
for panel, name in zip(panels, chosen, strict=True):
    panel.plot(x, shares(MEMBERSHIPS[name]).T)
    panel.set_title(name, fontsize="medium")
figure.supxlabel("input")
panels[0].set_ylabel("share")

# %%
# Training
# --------
#
# Jang's product of two sinc functions, from its grid of 121 points, with three terms per input; the
# error is judged between the points too. What is best here need not be so elsewhere: try
# ``GridSearchCV`` with ``{"mf": [...]}``.

X, y = make_jang_sinc()
line = np.linspace(-10.0, 10.0, 61)
between = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
truth = np.sinc(between / np.pi).prod(axis=1)

print("RMS error           training points   between them")
for name in MEMBERSHIPS:
    model = ANFISRegressor(n_mfs=3, mf=name).fit(X, y)
    errors = [model.predict(X) - y, model.predict(between) - truth]
    rms = [np.sqrt(np.mean(error**2)) for error in errors]
    print(f"{name:<20}{rms[0]:>15.3f}{rms[1]:>15.3f}")

plt.show()
