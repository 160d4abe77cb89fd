r"""The trained model, frozen and in the user's units: every fit ends in it, all else reads it.

A first-order Takagi-Sugeno-Kang model (Jang 1993),

    y(x) = sum_r w_r(x) f_r(x) ,    f_r(x) = a_r + sum_j b_rj (x_j - x0_j) ,

with normalised firing strengths w and consequents about x0, the mean of the training data, so that
a column far from the origin (a time stamp, a raw count) loses no digits. Outside the box of the
training data, the nearest point c of the box decides: the model holds the value there (clip), or
follows the tangent as far as L standard deviations h_j of each input (linear),

    y(c) + sum_j dy/dx_j(c) clip(x_j - c_j, -L h_j, L h_j) .

If there are monotonic constraints, the slope by a constrained input x_j is taken with the other
constrained inputs at their medians. So it does not depend on them, and no slope changes its sign.
Outputs are held within limits as well, see :class:`~skanfis.policies.TargetRange`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from ._validation import rows_by_name
from .antecedent import Antecedent, RuleTableAntecedent, by_group, strongest_rules
from .blocks import BLOCK_BYTES, FEWEST_ROWS, row_blocks
from .consequent import outputs_of_rules, rule_outputs
from .digits import counted
from .naming import default_output_names, default_term_names, listed
from .policies import (
    FARTHEST_ROW,
    MAX_EXTRAPOLATION,
    TargetRange,
    check_policy,
    describe_out_of_bounds,
    is_outside,
)
from .posterior import MOST_PARAMETERS, Posterior
from .support import RuleSupport

__all__ = ["TSKModel"]

_ROUNDING = 1e-9  # relative error of a variance, and of values 0 and 1


@dataclass(frozen=True, eq=False, repr=False)
class TSKModel:
    """A frozen Takagi-Sugeno-Kang model.

    Attributes
    ----------
    antecedent : Antecedent
        Rule base after training.
    initial_antecedent : Antecedent
        Rule base before training.
    coefficients : ndarray of shape (n_rules, n_basis, n_outputs)
        a_r, then b_rj where the order is 1.
    reference : ndarray of shape (n_inputs,)
        x0, the weighted mean of the training inputs.
    spread : ndarray of shape (n_inputs,)
        Weighted standard deviation of the training inputs.
    minimum, maximum : ndarray of shape (n_inputs,)
        The box of the training data.
    rule_weights : ndarray of shape (n_rules,)
        Mean strength of each rule over the training rows, by their weights; the sum is one.
    rule_rows : ndarray of shape (n_rules,)
        Number of training rows on which each rule is the strongest. A row of weight two counts as
        two.
    input_names : tuple of str
    out_of_bounds : {"clip", "linear", "nan", "raise"}
    max_extrapolation : float
        L of "linear", zero or positive. If it is infinite, outputs are held only within the limits
        that the user has set.
    support, posterior, target : RuleSupport, Posterior, TargetRange or None
        Sources of coverage, deviations and limits of the outputs; None without data.
    term_names, output_names : tuple of str
        Default names (see ``naming``) if not given.
    tangent_at : ndarray of shape (n_inputs,) or None
        Medians of the inputs with a monotonic constraint, NaN for the others.
    levels : dict
        Meaning of the indicators of a ``OneHotEncoder``, by name, in a model from ``fold``; see
        ``export.columns``.
    """

    antecedent: Antecedent
    initial_antecedent: Antecedent
    coefficients: np.ndarray
    reference: np.ndarray
    spread: np.ndarray
    minimum: np.ndarray
    maximum: np.ndarray
    rule_weights: np.ndarray
    rule_rows: np.ndarray
    input_names: tuple[str, ...]
    out_of_bounds: str = "linear"
    max_extrapolation: float = MAX_EXTRAPOLATION
    support: RuleSupport | None = None
    term_names: tuple[str, ...] = ()
    output_names: tuple[str, ...] = ()
    target: TargetRange | None = None
    posterior: Posterior | None = None
    tangent_at: np.ndarray | None = None
    levels: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self):
        if not self.term_names:
            object.__setattr__(self, "term_names", default_term_names(self))
        if not self.output_names:
            object.__setattr__(self, "output_names", default_output_names(self.n_outputs))

    def __repr__(self):
        inputs, outputs = listed(self.input_names, "input"), listed(self.output_names, "output")
        return f"TSKModel({counted(self.n_rules, 'rule')}, {inputs} -> {outputs})"

    @property
    def n_rules(self) -> int:
        """Number of rules."""
        return self.coefficients.shape[0]

    @property
    def n_inputs(self) -> int:
        """Number of inputs."""
        return self.reference.size

    @property
    def n_outputs(self) -> int:
        """Number of outputs."""
        return self.coefficients.shape[2]

    @property
    def order(self) -> int:
        """Order of the consequents, 0 or 1."""
        return int(self.coefficients.shape[1] > 1)

    @property
    def consequents(self):
        """Coefficients on [1, x_1, ..., x_d] of every rule, (n_rules, 1 + n_inputs, n_outputs)."""
        textbook = np.zeros((self.n_rules, 1 + self.n_inputs, self.n_outputs))
        textbook[:, : self.coefficients.shape[1]] = self.coefficients
        textbook[:, 0] -= np.einsum("j,rjo->ro", self.reference, textbook[:, 1:])
        return textbook

    @property
    def common_slopes(self) -> np.ndarray:
        """Whether a rule has the nonzero slope that most rules share, (n_rules, n_inputs)."""
        found = np.zeros((self.n_rules, self.n_inputs), dtype=bool)
        for j, slopes in enumerate(self.coefficients[:, 1:].transpose(1, 0, 2)):
            values, which, counts = np.unique(
                slopes, axis=0, return_inverse=True, return_counts=True
            )
            most = counts.argmax()
            if counts[most] > 1 and values[most].any():
                found[:, j] = which.ravel() == most
        return found

    @property
    def rule_centers(self) -> np.ndarray:
        """Strength-weighted mean of each rule's rows, else the mean of all, (n_rules, n_inputs)."""
        if self.support is None:
            return np.tile(self.reference, (self.n_rules, 1))
        return np.where(self.support.share[:, None] > 0.0, self.support.center, self.reference)

    @property
    def seen_values(self) -> list:
        """For every input, quantiles of the training rows and the values next to its terms."""
        marginals = () if self.support is None else self.support.marginals
        scales = zip(self.reference, self.spread, marginals, strict=False)
        return [[offset + scale * z for z in values] for offset, scale, (_, *values) in scales]

    @property
    def two_valued(self) -> np.ndarray:
        """Whether an input is 0 or 1 on all training rows, (n_inputs,).

        Of all values from 0 to 1 with mean m, only these have the variance m (1 - m).
        """
        from_0_to_1 = np.maximum(np.abs(self.minimum), np.abs(self.maximum - 1.0)) <= _ROUNDING
        most = self.reference * (1.0 - self.reference)
        return from_0_to_1 & (np.abs(self.spread**2 - most) <= _ROUNDING * most)

    @property
    def output_limits(self) -> np.ndarray:
        """Lower and upper limits of the outputs, (2, n_outputs); infinite if there are none."""
        if self.target is None:
            return np.full((2, self.n_outputs), [[-np.inf], [np.inf]])
        return self.target.limits(self.max_extrapolation, is_line=self.n_rules == 1)

    def memberships(self, trained=True) -> list[dict]:
        """Memberships in the user's units, after training or before it.

        One dict per term, with keys "input" (a name), "name", "function" and one per parameter.
        """
        antecedent = self.antecedent if trained else self.initial_antecedent
        terms: list[dict] = []
        for name, (j, family, theta) in zip(self.term_names, antecedent.terms, strict=True):
            keys = [parameter.name for parameter in family.parameters]
            natural = family.natural(theta).tolist()
            term = {"input": self.input_names[j], "name": name, "function": family.name}
            terms.append(term | dict(zip(keys, natural, strict=True)))
        return terms

    def in_bounds(self, X) -> np.ndarray:
        """Whether each row is in the range of the training data, up to rounding, (n_rows,)."""
        X = rows_by_name(X, self.input_names)
        return ~is_outside(X, self.minimum, self.maximum).any(axis=1)

    def strengths(self, X) -> np.ndarray:
        """Normalised firing strengths at the nearest point of the box, shape (n_rows, n_rules)."""
        X = rows_by_name(X, self.input_names)
        return self._by_block(X, lambda Z: self.antecedent.strengths(self._clip(Z)), self.n_rules)

    def apply(self, X) -> np.ndarray:
        """The strongest rule of every row, (n_rows,); of equally strong ones the first."""
        return strongest_rules(self.strengths(X).T)

    def predict(self, X, inside=None) -> np.ndarray:
        """Outputs (n_rows, n_outputs) by the policy; ``inside`` comes from :meth:`in_bounds`."""
        if inside is None:
            X = rows_by_name(X, self.input_names)
            inside = self.in_bounds(X)
        if inside.all():
            return self._by_block(X, self._outputs, self.n_outputs)
        if self.out_of_bounds == "raise":
            raise ValueError(self.describe_out_of_bounds(X))
        if self.out_of_bounds == "linear" and self.max_extrapolation > 0.0:
            return self._by_block(X, self._outputs_linear, self.n_outputs, self._n_slopes)
        outputs = self._by_block(X, lambda Z: self._outputs(self._clip(Z)), self.n_outputs)
        if self.out_of_bounds == "nan":
            outputs[~inside] = np.nan
        return outputs

    def standard_deviation(self, X) -> np.ndarray:
        """Standard deviation of every output, shape (n_rows, n_outputs); see ``posterior``."""
        return self.predict_with_deviation(X)[1]

    def predict_with_deviation(self, X, inside=None) -> tuple[np.ndarray, np.ndarray]:
        """Outputs and their standard deviations, each of shape (n_rows, n_outputs).

        NaN where the policy is "nan"; ValueError where it raises, or the model has no posterior.
        """
        posterior, n_values = self.posterior, 2 * self.n_outputs
        if posterior is None:
            raise ValueError(self._why_no_posterior())
        if inside is None:
            X = rows_by_name(X, self.input_names)
            inside = self.in_bounds(X)
        if self.out_of_bounds == "raise" and not inside.all():
            raise ValueError(self.describe_out_of_bounds(X))

        def within(Z):
            return np.vstack([self._outputs(Z), posterior.inside(self, Z)])

        def beyond(Z):
            nearest = self._clip(Z)
            way = self._way(Z, nearest)
            values, slopes = self._tangent(nearest)
            followed = self._followed(way) if self.out_of_bounds == "linear" else 0.0 * way
            outputs = self._hold(values + np.einsum("ji,joi->oi", followed, slopes))
            # The deviation is that of the whole tangent. The part that the prediction does not
            # follow counts in full, but for what the user's limits rule out.
            whole = values + np.einsum("ji,joi->oi", way, slopes)
            if self.target is not None:
                whole = np.clip(whole, *self.target.limits(np.inf, is_line=False)[:, :, None])
            left = whole - outputs
            return np.vstack([outputs, np.hypot(posterior.tangent(self, nearest, way), left)])

        found = np.full((X.shape[0], n_values), np.nan)
        n_more = posterior.n_values + self._n_slopes
        for rows, of_block in ((inside, within), (~inside, beyond)):
            if rows.any() and (of_block is within or self.out_of_bounds != "nan"):
                found[rows] = self._by_block(X[rows], of_block, n_values, n_more)
        return found[:, : self.n_outputs], found[:, self.n_outputs :]

    def gradient(self, X) -> np.ndarray:
        """Derivative of every output by every input, shape (n_rows, n_inputs, n_outputs).

        Rows outside the box are taken at its nearest point, and outputs before the limits.
        """
        return self._slopes(X, self._linearised)

    def tangent_slopes(self, X) -> np.ndarray:
        """Slopes that "linear" follows from the nearest point of the box, shaped as a gradient."""
        return self._slopes(X, self._tangent)

    def _slopes(self, X, linearised):
        def of_block(Z):
            return linearised(self._clip(Z))[1].reshape(-1, Z.shape[1])

        X, n_values = rows_by_name(X, self.input_names), self.n_inputs * self.n_outputs
        by_row = self._by_block(X, of_block, n_values, self._n_slopes)
        return by_row.reshape(-1, self.n_inputs, self.n_outputs)

    def coverage(self, X) -> np.ndarray:
        r"""How well the training data cover each row, from 0 (not at all) to 1, (n_rows,).

        With c the nearest point of the box and delta the way there in standard deviations::

            exp(-delta^2 / 2) sum_r w_r(c) min(1, N_r / P) exp(-max(0, d_r(c) - D_r)^2 / 2)

        N_r counts distinct inputs on which rule r is the strongest, P counts its coefficients. d_r
        is a distance from its rows (:doc:`/mathematics`), D_r the largest there. Zero without data.
        """
        X, support = rows_by_name(X, self.input_names), self.support
        if support is None:
            return np.zeros(X.shape[0])

        def of_block(Z):
            nearest = self._clip(Z)
            distance = self._way(Z, nearest) / self.spread[:, None]
            near = np.exp(-0.5 * np.sum(distance**2, axis=0))
            by_rule = self.antecedent.strengths(nearest) * support.by_rule(nearest)
            # Strengths may sum to a rounding error more than one.
            return (np.minimum(by_rule.sum(axis=0), 1.0) * near)[None]

        n_distances = 2 * self.n_rules * (1 + self.n_inputs)
        return self._by_block(X, of_block, 1, n_distances)[:, 0]

    def _why_no_posterior(self):
        n_basis = 1 + np.count_nonzero(self.coefficients[:, 1:].any(axis=(0, 2)))
        n_parameters = self.n_rules * n_basis + self.antecedent.parameters.size
        if n_parameters > MOST_PARAMETERS:
            return (
                f"The model has {n_parameters} parameters, and models with more than "
                f"{MOST_PARAMETERS} have no standard deviations. Use fewer rules, or "
                "ConformalRegressor(..., scaled=False)."
            )
        return (
            "The model has no posterior, and so no standard deviations: it was read from a .fis "
            "file or from JSON without a posterior, it lost rules, or it has seen a single row. "
            "Fit it to data (solver='lse' keeps its premises)."
        )

    def way_out(self, X) -> np.ndarray:
        """How far "linear" goes from the box towards each row, (n_rows, n_inputs)."""
        X = rows_by_name(X, self.input_names)
        return self._followed(self._way(X.T, self._clip(X.T))).T

    def describe_out_of_bounds(self, X) -> str:
        """Say which inputs leave the box of the training data, in how many rows, and how far."""
        return describe_out_of_bounds(X, self.minimum, self.maximum, self.input_names)

    def as_rule_table(self) -> Self:
        """Return the same model as rules with one term on an input, such as .fis files hold.

        Two cuts of an input on one path of a tree become one term, a product of two sigmoids.
        ValueError where there are three. The result has no posterior, and its memberships before
        training are those after it.
        """
        if not isinstance(self.antecedent, RuleTableAntecedent):
            return self
        table, made = self.antecedent.with_one_term_each(self.input_names)
        if type(self.antecedent) is RuleTableAntecedent and max(map(len, made), default=1) == 1:
            return self
        names = tuple(" and ".join(self.term_names[t] for t in terms) for terms in made)
        changes = {"antecedent": table, "initial_antecedent": table, "term_names": names}
        support = self.support and self.support.without_moments()
        return replace(self, **changes, support=support, posterior=None)

    @property
    def policy(self) -> str:
        """The policy out of bounds as parameters, like "out_of_bounds='clip'"."""
        text = f"out_of_bounds={self.out_of_bounds!r}"
        if self.out_of_bounds == "linear":
            text += f", max_extrapolation={float(self.max_extrapolation)!r}"
        return text

    def with_out_of_bounds(self, policy, max_extrapolation=None) -> Self:
        """Return the same model with another policy, and another limit if given."""
        limit = self.max_extrapolation if max_extrapolation is None else max_extrapolation
        check_policy(policy, limit)
        if limit == "auto":
            limit = MAX_EXTRAPOLATION
            if self.target is not None and self.posterior is not None:
                limit = self.target.supported_extrapolation(self.posterior.noise)
        if policy == self.out_of_bounds and limit == self.max_extrapolation:
            return self
        return replace(self, out_of_bounds=policy, max_extrapolation=float(limit))

    def _by_block(self, X, of_block, n_columns, n_more=0):
        """Apply a function of Z (n_inputs, n_rows) to blocks of rows; (n_rows, n_columns).

        The function needs memory for ``n_more`` values per row besides strengths and outputs.
        """
        n_rows = X.shape[0]
        values_per_row = self.n_rules * (2 + self.n_outputs) + 3 * self.antecedent.n_terms + n_more
        step = max(BLOCK_BYTES // (8 * values_per_row), FEWEST_ROWS)
        if 0 < n_rows <= step:
            return of_block(np.array(X.T, dtype=float, order="C")).T
        result = np.empty((n_rows, n_columns))
        for part in row_blocks(n_rows, step):
            result[part] = of_block(np.array(X[part].T, dtype=float, order="C")).T
        return result

    @property
    def _n_slopes(self):
        """Values per row that :meth:`_linearised` holds in memory."""
        return 2 * self.antecedent.parameters.size + self.n_inputs * self.n_outputs

    def _clip(self, Z):
        return np.clip(Z, self.minimum[:, None], self.maximum[:, None])

    def _way(self, Z, nearest):
        """The way from the nearest point in the box, no further than ``FARTHEST_ROW``."""
        with np.errstate(over="ignore"):
            reach = (FARTHEST_ROW * self.spread)[:, None]
            return np.clip(Z - nearest, -reach, reach)

    def _followed(self, way):
        """The part of the way out of the box on which the tangent is followed."""
        reach = (self.max_extrapolation * self.spread)[:, None]
        return np.clip(way, -reach, reach)

    def _hold(self, outputs):
        """Outputs (n_outputs, n_rows) within their limits."""
        if self.target is None:
            return outputs
        low, high = self._limits_of_columns
        return np.minimum(np.maximum(outputs, low), high)

    @cached_property
    def _limits_of_columns(self):
        """The limits as columns; cached, because they take a sixth of the time of a single row."""
        return self.output_limits[:, :, None]

    def _outputs(self, Z):
        strengths, basis_rows = self.antecedent.strengths(Z), self.basis(Z)
        by_output = self.coefficients.transpose(2, 0, 1)
        return self._hold(outputs_of_rules(by_output, strengths, basis_rows))

    def _outputs_linear(self, Z):
        """Outputs by the tangent at the nearest point of the box."""
        nearest = self._clip(Z)
        values, slopes = self._tangent(nearest)
        followed = self._followed(self._way(Z, nearest))
        return self._hold(values + np.einsum("ji,joi->oi", followed, slopes))

    @property
    def tangent_groups(self):
        """Groups of inputs whose slopes are taken at one point, as masks, and these points.

        Both are (n_groups, n_inputs). NaN in a point stands for the row's own value.
        """
        if self.tangent_at is None:
            return np.ones((1, self.n_inputs), dtype=bool), np.full((1, self.n_inputs), np.nan)
        held = np.isfinite(self.tangent_at)
        own = np.vstack([~held, np.eye(self.n_inputs, dtype=bool)[held]])
        return own, np.where(own, np.nan, self.tangent_at)

    def _tangent(self, Z):
        """As :meth:`_linearised`, with the slopes that "linear" follows."""
        values, slopes = self._linearised(Z)
        for own, at in zip(*self.tangent_groups, strict=True):
            if own.any() and np.isfinite(at).any():
                there = np.where(np.isfinite(at)[:, None], at[:, None], Z)
                slopes[own] = self._linearised(there)[1][own]
        return values, slopes

    def _linearised(self, Z):
        """y (n_outputs, n_rows) and dy/dx (n_inputs, n_outputs, n_rows).

        A membership depends on x and its location only through their difference. So the derivative
        of log mu by x is minus that by the location.
        """
        log_mu, gradients = self.antecedent.log_memberships_and_gradient(Z)
        strengths, shares = self.antecedent.normalise(log_mu)
        basis_rows = self.basis(Z)
        values, slopes = [], np.zeros((self.n_inputs, self.n_outputs, Z.shape[1]))
        for k, one in enumerate(self.coefficients.transpose(2, 0, 1)):
            by_rule, output = rule_outputs(one, strengths, basis_rows)
            by_term = self.antecedent.term_sensitivity(by_rule, output, shares)
            pairs = by_group(gradients, by_term)
            for group, (gradient, own) in zip(self.antecedent.groups, pairs, strict=True):
                np.subtract.at(slopes[:, k], group.inputs, own * gradient[0])
            slopes[: one.shape[1] - 1, k] += one[:, 1:].T @ strengths
            values.append(output)
        return np.stack(values), slopes

    def basis(self, Z):
        """1 and the inputs about the reference, (n_basis, n_rows)."""
        basis_rows = np.ones((self.coefficients.shape[1], Z.shape[1]))
        if self.order == 1:
            np.subtract(Z, self.reference[:, None], out=basis_rows[1:])
        return basis_rows
