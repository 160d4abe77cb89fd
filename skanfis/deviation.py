r"""Rows of the design and of the derivatives by the premises, and what they are multiplied with.

What ``posterior`` finds the variance of a row with. Products are in single precision where that is
enough: they take half the time. Derivatives along a way out of the box are differences over small
steps, taken in double precision before anything is rounded.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from math import prod

import numpy as np

from .consequent import rule_outputs
from .quadratic import QuadraticForm, row_products, summed_with

__all__ = ["DerivativeRows", "DeviationTables", "inner_products", "narrowed", "rulers"]

# Widths of a term that ways out of the range are measured by at the most, and the logarithm of the
# part of the largest membership that a term has at an edge where it still counts.
_WIDEST, _TRACE = 4.0, -40.0
# The least share or strength in single precision. Of less, products of four are no normal numbers,
# with which some processors take so long that a whole prediction with its deviation takes up to
# three times as long (benchmarks/deviation.py, 6 x 6 terms); beside one it is no digit.
_LEAST_SHARE = 1e-9


def narrowed(shares, dtype):
    """Shares or strengths in some precision, none of them too small for it."""
    if shares.dtype == dtype:
        return shares
    return np.maximum(shares, _LEAST_SHARE, dtype=dtype, casting="same_kind")


def rulers(model):
    """What ways out of the range are measured by, below every input and above it, (2, n_inputs).

    Its standard deviation; less at an edge where memberships change while an outlier makes the
    deviation much longer than they are wide.
    """
    antecedent, found = model.antecedent, np.tile(model.spread, (2, 1))
    widths = [np.empty(0)]
    for group in antecedent.groups:
        natural = group.family.natural(group.theta)
        kinds = np.array([parameter.kind for parameter in group.family.parameters])
        widths.append(natural[kinds == "log_width"].min(axis=0, initial=np.inf))
    width, edges = np.concatenate(widths), np.stack([model.minimum, model.maximum], axis=1)
    with np.errstate(all="ignore"):
        log_mu = antecedent.log_memberships(edges)
    for j in np.unique(antecedent.term_inputs):
        own = np.flatnonzero(antecedent.term_inputs == j)
        for end, of_terms in enumerate(log_mu[own].T):
            alive = own[of_terms > of_terms.max() + _TRACE]
            # A single one has all of the share, and keeps it.
            if alive.size > 1:
                found[end, j] = min(found[end, j], _WIDEST * width[alive].min())
    return found


@dataclass(frozen=True, eq=False)
class DeviationTables:
    """F and B_k F for inputs in standard deviations: squares of others might be beyond floats.

    ``factor`` is F, ``form`` the quadratic form of F' F; ``joint`` is T beside
    -B_k F, and under them Q_k times the whole half, whose squares are taken off: (n_outputs,
    n_displacements + n_pinned, n_premises + n_columns). ``unit`` is a power of two near the noise
    of every output, (n_outputs, 1), in which squares stay finite; ``rulers`` measure ways out.
    ``constant`` (n_outputs, 1) is the mean of what halves that are left out add; ``is_narrow`` says
    that derivatives by terms may be summed up in the tables' precision too.
    """

    form: QuadraticForm
    factor: np.ndarray
    joint: np.ndarray
    unit: np.ndarray
    n_added: int
    rulers: np.ndarray
    constant: np.ndarray
    is_narrow: bool = False

    @property
    def n_premises(self):
        """Derivatives by premises that ``joint`` takes, none where these were not learnt."""
        return self.joint.shape[2] - self.factor.shape[1]

    def without_weak_halves(self, row, weights, tol):
        """The same with fewer halves for every output, rotated so that the last count least.

        Of rows all over the range, squares of what is left out are within ``tol`` over ``weights``
        (n_outputs, n_rows) of their mean, which is the constant.
        """
        n, found = self.n_added, []
        if not n:
            return self
        for k, weight in enumerate(weights):
            half = self.of_design(k, row.shares, row.basis)
            if self.n_premises:
                self.add_premises(k, row.changes(k, self.unit), half)
            half = half[:n]
            turn = np.linalg.svd(half * np.sqrt(weight), full_matrices=False)[0].T
            left = np.cumsum(((turn @ half) ** 2)[::-1], axis=0)[::-1]
            mean = np.average(left, axis=1, weights=weight)
            wrong = (np.abs(left - mean[:, None]) * weight).max(axis=1)
            found.append((turn, np.append(mean, 0.0), np.flatnonzero(wrong > tol)))
        n_kept = max(int(counts.max(initial=-1)) + 1 for _, _, counts in found)
        joint = [
            np.vstack([turn[:n_kept] @ joint[:n], joint[n:]])
            for joint, (turn, _, _) in zip(self.joint, found, strict=True)
        ]
        constant = np.array([[mean[n_kept]] for _, mean, _ in found])
        return replace(self, joint=np.stack(joint), n_added=n_kept, constant=constant)

    def signed(self, one, other):
        """Inner products of ``joint`` times rows: those added less those taken off, (n_rows,)."""
        n = self.n_added
        found = np.einsum("qn,qn->n", one[:n], other[:n])
        if len(one) > n:
            found -= np.einsum("qn,qn->n", one[n:], other[n:])
        return found

    @cached_property
    def _by_basis(self):
        """Of ``joint`` what the design is multiplied with, one basis function after the other."""
        n_outputs, n_halves, _ = self.joint.shape
        n_basis = self.form.counts[-1]
        consequents = self.joint[:, :, self.n_premises :]
        by_rule = consequents.reshape(n_outputs, n_halves, -1, n_basis)
        by_basis = by_rule.transpose(0, 3, 1, 2).reshape(n_outputs, n_basis * n_halves, -1)
        return np.ascontiguousarray(by_basis)

    def by_basis(self, k, row):
        """What ``joint`` makes of strengths, for each basis function, (n_basis, n_halves, n_rows).

        Summed with the basis, it is what ``joint`` makes of the design, which is not formed.
        """
        found = self._by_basis[k] @ row.strengths
        return found.reshape(row.basis.shape[0], -1, found.shape[1])

    @cached_property
    def _factors(self):
        """Where the shares of every factor are."""
        edges = np.cumsum([0, *self.form.counts[:-1]]).tolist()
        return [slice(*ends) for ends in pairwise(edges)]

    @cached_property
    def _n_formed(self):
        """Of how many factors shares are multiplied with the basis: fewest numbers are formed."""
        *counts, n_basis = self.form.counts
        n_halves = self.joint.shape[1]
        n_numbers = [
            n_basis * prod(counts[:n]) + n_halves * prod(counts[n:]) for n in range(len(counts) + 1)
        ]
        return int(np.argmin(n_numbers))

    @cached_property
    def _by_formed(self):
        """Of ``joint`` what these products take, (n_outputs, n_halves * n_left, n_products)."""
        n_outputs, n_halves, _ = self.joint.shape
        *counts, n_basis = self.form.counts
        formed, left = prod(counts[: self._n_formed]), prod(counts[self._n_formed :])
        consequents = self.joint[:, :, self.n_premises :]
        by_share = consequents.reshape(n_outputs, n_halves, formed, left, n_basis)
        by_share = by_share.transpose(0, 1, 3, 2, 4)
        return by_share.reshape(n_outputs, n_halves * left, formed * n_basis)

    def of_design(self, k, shares, basis):
        """What ``joint`` makes of the design of shares and basis, which is not formed."""
        groups, n = [shares[own] for own in self._factors], self._n_formed
        return summed_with(
            self._by_formed[k] @ row_products([*groups[:n], basis], basis), groups[n:]
        )

    def add_premises(self, k, changes, half):
        """Add what ``joint`` makes of derivatives by the premises to a half, in place."""
        half += self.joint[k][:, : self.n_premises] @ changes.astype(self.dtype, copy=False)

    @property
    def dtype(self):
        """The precision of products."""
        return self.factor.dtype

    def astype(self, dtype):
        """The same in another precision."""
        with np.errstate(over="ignore", under="ignore"):
            return replace(
                self,
                form=self.form.astype(dtype),
                factor=self.factor.astype(dtype),
                joint=self.joint.astype(dtype),
                constant=self.constant.astype(dtype),
            )

    @classmethod
    def of(cls, posterior, model):
        """Tables of a model's posterior, in double precision."""
        widths = np.concatenate([[1.0], model.spread[posterior.inputs]])
        factor = posterior.consequents * np.tile(widths, model.n_rules)
        counts = model.antecedent.share_counts
        unit = np.ldexp(1.0, np.frexp(posterior.noise)[1])[:, None]
        n_added, n_columns = posterior.premises.shape[0], factor.shape[0]
        premises = posterior.premises if n_added else np.zeros((0, 0))
        joint = []
        for k, one in enumerate(unit):
            own = np.hstack([premises, -posterior.cross[k] @ factor / one])
            pinned = posterior.pinned[k, :, n_columns:] @ own
            of_factor = posterior.pinned[k, :, :n_columns] @ factor
            pinned[:, premises.shape[1] :] += of_factor * (posterior.noise[k] / one)
            joint.append(np.vstack([own, pinned]))
        form = QuadraticForm.of(factor.T @ factor, counts, widths.size)
        none = np.zeros(unit.shape)
        return cls(form, factor, np.stack(joint), unit, n_added, rulers(model), none)


@dataclass(frozen=True, eq=False)
class DerivativeRows:
    """Rows of the design and of the derivatives by the premises, about to be written.

    ``basis`` is of inputs in standard deviations from the reference; ``is_scaled`` says that
    ``by_term`` is in units of the tables' already.
    """

    strengths: np.ndarray
    shares: np.ndarray
    basis: np.ndarray
    outputs: np.ndarray
    by_term: list[np.ndarray]  # of every output; none where the premises were not learnt
    gradients: list[np.ndarray]
    is_scaled: bool = False

    @classmethod
    def of(cls, model, Z, inputs, is_learnt, tables=None):
        """Rows at Z (n_inputs, n_rows); ``inputs`` are those that consequents are linear in.

        In double precision; or, but for outputs and strengths, in that of narrow ``tables``.
        """
        antecedent = model.antecedent
        log_mu, gradients = antecedent.log_memberships_and_gradient(Z)
        strengths, shares = antecedent.normalise(log_mu)
        own = Z if _is_every(inputs, len(Z)) else Z[inputs]
        basis_rows = np.ones((1 + inputs.size, Z.shape[1]))
        np.subtract(own, model.reference[inputs, None], out=basis_rows[1:])
        columns = np.concatenate([[0], 1 + inputs]) if model.order == 1 else [0]
        is_narrow = tables is not None and tables.is_narrow
        dtype = tables.dtype if is_narrow else np.float64
        shares = narrowed(shares, dtype)
        outputs, by_term = [], []
        for k, one in enumerate(model.coefficients[:, columns].transpose(2, 0, 1)):
            by_rule, output = rule_outputs(one, strengths, basis_rows)
            outputs.append(output)
            if is_learnt:
                if is_narrow:
                    by_rule *= 1.0 / tables.unit[k]
                    output = (output / tables.unit[k]).astype(dtype)
                by_rule = by_rule.astype(dtype, copy=False)
                by_term.append(antecedent.term_sensitivity(by_rule, output, shares))
        basis_rows[1:] *= 1.0 / model.spread[inputs, None]
        basis_rows = basis_rows.astype(dtype, copy=False)
        found = np.stack(outputs)
        return cls(strengths, shares, basis_rows, found, by_term, gradients, is_narrow)

    @classmethod
    def of_parts(cls, model, inputs, is_learnt, outputs, parts):
        """Rows whose parts are at hand: strengths, shares, basis, derivatives by terms."""
        strengths, shares, basis_rows, by_term, gradients = parts
        if not _is_every(inputs, len(basis_rows) - 1):
            basis_rows = basis_rows[np.append(0, 1 + inputs)]
        scaled = basis_rows / np.concatenate([[1.0], model.spread[inputs]])[:, None]
        by_term = by_term if is_learnt else []
        return cls(strengths, shares, scaled, outputs, by_term, gradients)

    def design(self, out):
        """Strengths times the basis, rule by rule, into (n_columns, n_rows)."""
        by_rule = out.reshape(-1, *self.basis.shape)
        by_rule[:, 0] = self.strengths
        np.multiply(self.strengths[:, None], self.basis[1:], out=by_rule[:, 1:])

    def part(self, part):
        """Some of the rows; all of them as they are."""
        if isinstance(part, slice):
            return self
        return DerivativeRows(
            self.strengths[:, part],
            self.shares[:, part],
            self.basis[:, part],
            self.outputs[:, part],
            [one[:, part] for one in self.by_term],
            [one[:, :, part] for one in self.gradients],
        )

    def astype(self, dtype):
        """The same in another precision, but for outputs and ``changes``."""
        if dtype == np.float64:
            return self
        return replace(
            self,
            strengths=narrowed(self.strengths, dtype),
            shares=narrowed(self.shares, dtype),
            basis=self.basis.astype(dtype),
        )

    def write_change_from(self, other, out):
        """What the design changes by from other rows, into (n_columns, n_rows) of any precision.

        By the changes of strengths and basis: of two designs no digits would be left.
        """
        dtype, by_rule = out.dtype, out.reshape(-1, *self.basis.shape)
        strengths = (self.strengths - other.strengths).astype(dtype, copy=False)
        slopes = (self.basis[1:] - other.basis[1:]).astype(dtype, copy=False)
        by_rule[:, 0] = strengths
        np.multiply(strengths[:, None], self.basis[1:].astype(dtype), out=by_rule[:, 1:])
        by_rule[:, 1:] += other.strengths.astype(dtype)[:, None] * slopes

    def changes(self, k, unit, dtype=np.float64):
        """Derivatives of output k by the antecedent's parameters, (n_parameters, n_rows).

        In units of ``unit``, in some precision.
        """
        by_term, parts, term = self.by_term[k], [], 0
        if not self.is_scaled:
            by_term = (by_term / unit[k]).astype(dtype, copy=False)
        for gradient in self.gradients:
            own = by_term[term : term + gradient.shape[1]]
            part = np.multiply(gradient, own, dtype=dtype, casting="same_kind")
            parts.append(part.reshape(-1, own.shape[1]))
            term += own.shape[0]
        return np.concatenate(parts) if len(parts) > 1 else parts[0]


def _is_every(inputs, n_inputs):
    """Whether these are all inputs, in order; another model's columns may be in another."""
    return inputs.size == n_inputs and bool((inputs == np.arange(n_inputs)).all())


def _inner(one, other):
    return np.einsum("pn,pn->n", one, other)


def inner_products(one, other, product=_inner):
    """Of every row the products of one with itself, with the other, of the other with itself."""
    return [product(a, b) for a, b in ((one, one), (one, other), (other, other))]
