"""Random functions of inputs of many distributions: what several benchmarks are made of.

Everything is drawn from a case's own seed. A function acts on standardised inputs, by medians and
quartiles so that heavy tails stay heavy, and on some of them only where there are several. Inputs
and target are then given units of their own.
"""

from dataclasses import dataclass

import numpy as np

__all__ = ["INPUTS", "OTHERS", "SMOOTH", "Case", "make_data", "outside"]


@dataclass(frozen=True)
class Case:
    """What is known of a case before it is drawn."""

    seed: int
    n_inputs: int
    n_rows: int
    noise: float  # over the deviation of the function
    inputs: str
    function: str

    def __str__(self):
        return (
            f"{self.seed}: {self.function}, {self.inputs}, {self.n_rows} x {self.n_inputs}, "
            f"noise {self.noise:.1%}"
        )


@dataclass(frozen=True)
class Data:
    """Rows to train on, and rows to test on with the truth and without noise."""

    X: np.ndarray
    y: np.ndarray
    X_test: np.ndarray
    truth: np.ndarray
    noise: float  # standard deviation, in the target's units


def make_data(case, n_test=2000, n_scale=4000):
    """The rows of a case; further rows give the scales of inputs and function."""
    rng = np.random.default_rng(case.seed)
    raw = INPUTS[case.inputs](rng, case.n_rows + n_test + n_scale, case.n_inputs)
    scale = raw[-n_scale:]
    low, middle, high = np.quantile(scale, [0.25, 0.5, 0.75], axis=0)
    # Two values, of which one is rare, have no quartiles apart.
    spread = np.where(high > low, (high - low) / 1.35, scale.std(axis=0))
    Z = (raw - middle) / np.where(spread > 0, spread, 1.0)
    n_active = case.n_inputs if case.n_inputs < 3 else rng.integers(2, case.n_inputs + 1)
    active = rng.choice(case.n_inputs, n_active, replace=False)
    values = FUNCTIONS[case.function](rng, Z[:, active])
    values = values / values[-n_scale:].std()
    noisy = values + case.noise * rng.standard_normal(len(values))
    # Units: a fit must not depend on them.
    unit, offset = 10.0 ** rng.uniform(-3, 3, case.n_inputs), rng.normal(0, 3, case.n_inputs)
    X = (raw + offset) * unit
    y_unit, y_offset = 10.0 ** rng.uniform(-3, 3), rng.normal(0, 3)
    train, test = slice(case.n_rows), slice(case.n_rows, case.n_rows + n_test)
    return Data(
        X[train],
        (noisy[train] + y_offset) * y_unit,
        X[test],
        (values[test] + y_offset) * y_unit,
        case.noise * y_unit,
    )


def outside(values, y, factor):
    """Which values lie beyond the range of y by more than so many of it."""
    low, high = y.min(), y.max()
    return (values < low - factor * (high - low)) | (values > high + factor * (high - low))


# Inputs ---------------------------------------------------------------------------------------


def uniform(rng, n, d):
    return rng.uniform(-1, 1, (n, d))


def correlated(rng, n, d):
    """Normal, with a common part of 50 to 98 % of the variance."""
    common = rng.uniform(0.5, 0.98)
    signs = rng.choice([-1.0, 1.0], d)
    shared = rng.standard_normal((n, 1)) * signs
    return np.sqrt(common) * shared + np.sqrt(1 - common) * rng.standard_normal((n, d))


def clusters(rng, n, d):
    n_clusters = rng.integers(3, 7)
    centers = rng.uniform(-2, 2, (n_clusters, d))
    widths = rng.uniform(0.1, 0.3, n_clusters)
    of = rng.integers(n_clusters, size=n)
    return centers[of] + widths[of, np.newaxis] * rng.standard_normal((n, d))


def integer(rng, n, d):
    """Equally likely levels, from two to a dozen of each input."""
    return rng.integers(rng.integers(2, 13, d), size=(n, d)).astype(float)


def t3(rng, n, d):
    return rng.standard_t(3, (n, d))


def lognormal(rng, n, d):
    return rng.lognormal(0, 1, (n, d))


INPUTS = {f.__name__: f for f in (uniform, correlated, clusters, integer, t3, lognormal)}

# Functions ------------------------------------------------------------------------------------


def _curve(rng):
    """A smooth function of one variable, bounded or of linear growth."""
    slope, shift = rng.uniform(0.5, 2.0), rng.normal(0, 0.5)
    curves = (
        lambda z: z,
        lambda z: np.tanh(slope * (z - shift)),
        lambda z: np.sin(slope * (z - shift)),
        lambda z: np.exp(-0.5 * (slope * (z - shift)) ** 2),
        lambda z: np.logaddexp(0, slope * (z - shift)),
    )
    return curves[rng.integers(len(curves))]


def _direction(rng, d):
    """Of an input, or across all, of length one."""
    if rng.random() < 0.5:
        return np.eye(d)[rng.integers(d)] * rng.choice([-1.0, 1.0])
    direction = rng.standard_normal(d)
    return direction / np.linalg.norm(direction)


def fourier(rng, Z, n_waves=50):
    """A draw of a Gaussian process with a squared exponential, nearly."""
    length = rng.uniform(1.0, 3.0) * np.sqrt(Z.shape[1])
    waves = rng.standard_normal((Z.shape[1], n_waves)) / length
    return np.cos(Z @ waves + rng.uniform(0, 2 * np.pi, n_waves)) @ rng.standard_normal(n_waves)


def additive(rng, Z):
    return sum(rng.uniform(0.3, 1.0) * _curve(rng)(z) for z in Z.T)


def products(rng, Z):
    """Products of two or three curves of one input each, and a linear part."""
    d = Z.shape[1]
    total = 0.3 * Z @ rng.standard_normal(d)
    for _ in range(max(1, d // 2)):
        chosen = rng.choice(d, min(d, rng.integers(2, 4)), replace=False)
        total = total + rng.normal() * np.prod([_curve(rng)(Z[:, j]) for j in chosen], axis=0)
    return total


def ridges(rng, Z):
    """Curves along directions across the inputs."""
    directions = rng.standard_normal((rng.integers(1, 4), Z.shape[1])) / np.sqrt(Z.shape[1])
    return sum(rng.normal() * _curve(rng)(Z @ direction) for direction in directions)


def kinked(rng, Z):
    """The greatest of some planes, and hinges."""
    d = Z.shape[1]
    planes = Z @ rng.standard_normal((d, rng.integers(2, 5))) / np.sqrt(d)
    total = np.max(planes + rng.normal(0, 0.5, planes.shape[1]), axis=1)
    for _ in range(rng.integers(0, 3)):
        hinge = np.maximum(Z @ _direction(rng, d) - rng.normal(0, 0.5), 0.0)
        total = total + rng.normal() * hinge
    return total


def stepped(rng, Z):
    """One to three steps on a slight slope."""
    total = 0.2 * Z @ rng.standard_normal(Z.shape[1])
    for _ in range(rng.integers(1, 4)):
        step = Z @ _direction(rng, Z.shape[1]) > rng.normal(0, 0.5)
        total = total + rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 2.0) * step
    return total


def peaked(rng, Z):
    """One to three bells where rows are, on a slight slope."""
    d = Z.shape[1]
    total = 0.2 * Z @ rng.standard_normal(d)
    for _ in range(rng.integers(1, 4)):
        center, width = Z[rng.integers(len(Z))], rng.uniform(0.3, 0.8) * np.sqrt(d)
        distance = np.sum((Z - center) ** 2, axis=1)
        total = total + rng.uniform(1.0, 3.0) * np.exp(-0.5 * distance / width**2)
    return total


SMOOTH = {"fourier": fourier, "additive": additive, "products": products, "ridges": ridges}
OTHERS = {"kinked": kinked, "stepped": stepped, "peaked": peaked}
FUNCTIONS = SMOOTH | OTHERS
