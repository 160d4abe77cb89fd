"""The posterior of a model as the constant tables that its deviation in C reads."""

from dataclasses import dataclass

import numpy as np

from ...deviation import rulers
from ...membership import Trapezoidal, Triangular
from ...policies import SILENT

__all__ = ["Deviation", "deviation_of", "fitting"]

_HAVE_CORNERS = {Triangular, Trapezoidal}
# Steps of differences out of the range, as in Python; in single precision longer, because a
# difference has the fewer digits the shorter it is, and three of them. Before a corner they are
# halved, so many times at the most.
_STEP = {np.dtype(np.float64): 2.0**-14, np.dtype(np.float32): 2.0**-7}
_N_STEPS, _HALVINGS = 3, 3


@dataclass(frozen=True, eq=False)
class Deviation:
    """Tables of a posterior, in the type of the code; and what intervals reach, in deviations.

    ``noise``, ``cross`` are over ``unit``, a power of two near the noise of every output.
    """

    inputs: np.ndarray
    noise: np.ndarray
    unit: np.ndarray
    factor: np.ndarray
    premises: np.ndarray
    cross: np.ndarray
    terms: np.ndarray
    pinned: np.ndarray  # times [u, v]; what is known of the output and taken off
    step: float  # by which differences go out of the range, in what measures the way there
    rulers: np.ndarray | None  # these, below and above every input; None: standard deviations
    reach: np.ndarray | None = None
    coverage: float | None = None

    @property
    def n(self):
        """Columns of the design."""
        return self.factor.shape[0]

    @property
    def q(self):
        """Displacements of the premises."""
        return self.premises.shape[0]


def deviation_of(model, numbers, reach=None, coverage=None):
    """The tables of a model's posterior; ValueError where it has none."""
    posterior = model.posterior
    if posterior is None:
        # Says why there is none.
        model.standard_deviation(model.reference[None])
    step, measures = _STEP[numbers.dtype], rulers(model)
    if numbers.dtype == np.float32 and model.out_of_bounds not in SILENT:
        step = _step_before_corners(model, measures)
    factor, shift = posterior.consequents.copy(), numbers.reference.astype(float) - model.reference
    by_rule = factor.reshape(len(factor), model.n_rules, -1)
    by_rule[:, :, 0] += by_rule[:, :, 1:] @ shift[posterior.inputs]
    unit = np.ldexp(1.0, np.frexp(posterior.noise)[1])
    # Python has parameters group by group and kind by kind; here they are term by term.
    order: list[np.ndarray] = []
    terms: list[np.ndarray] = []
    start = term = 0
    for group in model.antecedent.groups:
        n_parameters, n_terms = group.theta.shape
        places = start + np.arange(group.theta.size).reshape(n_parameters, n_terms)
        order.append(places.T.ravel())
        terms.append(term + np.repeat(np.arange(n_terms), n_parameters))
        start, term = start + group.theta.size, term + n_terms
    return Deviation(
        posterior.inputs,
        posterior.noise / unit,
        unit,
        factor,
        posterior.premises[:, np.concatenate([[], *order]).astype(int)],
        (posterior.cross @ factor) / unit[:, None, None],
        np.concatenate([[], *terms]).astype(int),
        _pinned(posterior, unit),
        step,
        None if (measures == model.spread).all() else measures,
        reach,
        coverage,
    )


def _step_before_corners(model, measures):
    """The longest step, a power of two, of which three meet no corner of a flank inside an edge."""
    nearest, name = np.inf, ""
    for group in model.antecedent.groups:
        if group.family not in _HAVE_CORNERS:
            continue
        numbers = group.family.natural(group.theta)
        half = 0.5 * numbers[3] if len(numbers) > 3 else 0.0
        shoulders = numbers[0] - half, numbers[0] + half
        corners = np.stack([shoulders[0] - numbers[1], *shoulders, shoulders[1] + numbers[2]])
        for j, own in zip(group.inputs, corners.T, strict=True):
            insides = own - model.minimum[j], model.maximum[j] - own
            for inside, measure in zip(insides, measures[:, j], strict=True):
                ahead = inside / measure
                ahead = ahead[ahead > 0.0].min(initial=np.inf)
                if ahead < nearest:
                    nearest, name = ahead, model.input_names[j]
    steps = _STEP[np.dtype(np.float32)] * 2.0 ** -np.arange(_HALVINGS + 1)
    clear = steps[(_N_STEPS + 0.5) * steps < nearest]
    if clear.size:
        return float(clear[0])
    raise ValueError(
        f"deviation=True with dtype='float': out of the range it goes by differences, and a corner "
        f"of a straight flank lies {nearest:.2g} standard deviations inside the range of {name!r}, "
        "within the shortest step that single precision can take. Use dtype='double', or "
        "out_of_bounds='nan' or 'raise'."
    )


def _pinned(posterior, unit):
    """Q_k times [noise u, v], by [u, v]."""
    found = posterior.pinned.copy()
    found[:, :, : posterior.consequents.shape[0]] *= (posterior.noise / unit)[:, None, None]
    return found


def fitting(values, dtype):
    """Values in a type; ValueError where it does not hold them."""
    largest = np.abs(values).max(initial=0.0)
    limits = np.finfo(dtype)
    if not largest <= float(limits.max):
        raise ValueError(
            f"dtype='float' cannot hold the posterior of this model, {largest:g}: scale the data, "
            "or export the deviation in double precision."
        )
    # Subnormal numbers have fewer digits.
    return np.where(np.abs(values) < float(limits.tiny), 0.0, values).astype(dtype)
