r"""The functional ANOVA of a sum of rules under the product of the distributions of its inputs.

Inputs come in blocks, of one or of several that enter as one. On grids and trees the strength of
rule r is a product of a function of each block, w_r = prod_g p_rg, and its consequent is a sum,
a_r + sum_g l_rg. With m_rg = E p_rg, n_rg = E p_rg l_rg, and products and sums over the blocks that
are not in v, M_r = prod m_rg and N_r = sum_g n_rg prod_(h != g) m_rh,

    E[y | x_v] = sum_r prod_(g in v) p_rg  (a_r M_r + N_r + M_r sum_(g in v) l_rg) .

The mean of its square takes, of every block in v, E[p_r l_r^a p_s l_s^b] of rules r and s with a
and b 0 or 1: an *element*, multiplied as polynomials in a and b that end at one. Components are
differences. Other rules are drawn: y at draws, and at draws that share x_v with them alone.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..antecedent import Antecedent
from ..blocks import fitting_rows, row_blocks
from ..learning.data import Scale, StandardisedData
from ..search import representative_rows, weighted_quantile
from .measures import _CONSTANT

# Values that a fit keeps of every input, of so many rows; draws in place of closed forms, and draws
# that all points of one curve share.
N_VALUES, _MOST_ROWS, N_DRAWS, N_SHARED = 200, 2000, 20_000, 200
_UNIT = np.array([[1.0, 0.0], [0.0, 0.0]])[:, :, None, None]


def rule_functions(antecedent, inputs):
    """Sets of terms that rules have on inputs, the first of none, and which set each rule has."""
    table = antecedent.rule_terms
    own = np.where(np.isin(np.append(antecedent.term_inputs, -1)[table], inputs), table, -1)
    own = np.pad(own, ((1, 0), (0, 1)), constant_values=-1)
    sets, which = np.unique(own, axis=0, return_inverse=True)
    return sets, which.ravel()[1:]


def _functions(factors, sets, z):
    """[p, z_1 p, ...] of the functions p of a block with standardised inputs z, a row each."""
    padded = np.vstack([factors, np.ones((1, z.shape[1]))])
    p = np.ones((len(sets), z.shape[1]))
    for column in sets.T:
        p *= padded[column]
    return np.concatenate([p, *(p * one for one in z)])


@dataclass(frozen=True, eq=False)
class _Moments:
    """A pass over rows: of every block the sums of products of its functions."""

    antecedent: Antecedent
    blocks: list
    sets: list

    @property
    def shapes(self):
        sizes = [(1 + len(j)) * len(own) for j, own in zip(self.blocks, self.sets, strict=True)]
        return [(size, size) for size in sizes]

    def __call__(self, Z, target, weight, sums):
        del target
        factors = self.antecedent.factors(Z)
        factors = np.empty((0, Z.shape[1])) if factors is None else factors
        for inputs, own, total in zip(self.blocks, self.sets, sums, strict=True):
            rows = _functions(factors, own, Z[list(inputs)])
            total += (rows if weight is None else rows * weight) @ rows.T


def moments(rows, antecedent, blocks):
    """Of every block the mean products of its functions: of rules that do not factor, 1 and z."""
    is_product = antecedent.factors(np.zeros((rows.inputs.scale.size, 1))) is not None
    sets = [rule_functions(antecedent, j if is_product else ())[0] for j in blocks]
    n_values = antecedent.n_rules + 3 * antecedent.n_terms + 4 * max(map(len, sets))
    sums = rows.sum(_Moments(antecedent, blocks, sets), fitting_rows(n_values))
    return [one / rows.total_weight for one in sums]


def _standardised(model):
    """The rule base of a model on standardised inputs, and their scale."""
    antecedent = model.antecedent.change_units(-model.reference / model.spread, 1.0 / model.spread)
    return antecedent, Scale(model.reference, model.spread, model.minimum, model.maximum)


def moments_of_rows(model, blocks, X, weight=None):
    """The same of a model in the user's units, over rows X in the box."""
    antecedent, scale = _standardised(model)
    return moments(StandardisedData(X, X, weight, scale, scale), antecedent, blocks)


def input_marginals(rows, antecedent):
    """What a fit keeps of every input alone, see ``RuleSupport.marginals``."""
    blocks = [(j,) for j in range(rows.inputs.scale.size)]
    table, weight, _ = representative_rows(rows.sample or rows, _MOST_ROWS)
    parts = (np.arange(N_VALUES) + 0.5) / N_VALUES
    values = [weighted_quantile(table[:, j], weight, parts, 1) for (j,) in blocks]
    return tuple(zip(moments(rows, antecedent, blocks), values, strict=True))


def draw(blocks, known, n_draws, rng):
    """Rows of the product; ``known`` are rows of every block and their weights, or None."""
    rows = np.empty((n_draws, sum(map(len, blocks))))
    for inputs, (own, weight) in zip(blocks, known, strict=True):
        rows[:, list(inputs)] = own[rng.choice(len(own), n_draws, p=weight)]
    return rows


class ProductAnova:
    """Of one output of rules whose strengths are products; ``known`` has the blocks' moments."""

    def __init__(self, model, output, blocks, known):
        self.n_rules, self.blocks = model.n_rules, blocks
        self.antecedent, self.scale = _standardised(model)
        self.constant = model.coefficients[:, 0, output].copy()
        slopes = np.zeros((model.n_rules, model.n_inputs))
        slopes[:, : model.coefficients.shape[1] - 1] = model.coefficients[:, 1:, output]
        slopes *= model.spread
        self.sets, self.by_function, self.elements, self.means = [], [], [], []
        every = np.arange(model.n_rules)
        for inputs, moment in zip(blocks, known, strict=True):
            sets, which = rule_functions(model.antecedent, inputs)
            # p and p l of every rule by the functions of the block.
            by = np.zeros((2, model.n_rules, len(moment)))
            by[0, every, which] = 1.0
            for i, j in enumerate(inputs, start=1):
                by[1, every, i * len(sets) + which] = slopes[:, j]
            half = by @ moment
            self.sets.append(sets)
            self.by_function.append(by)
            self.elements.append(np.einsum("arm,bsm->abrs", half, by, optimize=True))
            self.means.append(half[:, :, 0])
        self.mean = float(self._weights(())[0].sum())
        # About the mean, so that no square loses digits.
        self.constant -= self.mean
        self.variance = _but_rounding(self.closed(range(len(blocks))), self.mean)

    def _weights(self, subset):
        """Weights of every rule: a M + N, and M."""
        weight, plus = np.ones_like(self.constant), np.zeros_like(self.constant)
        for g, (m, n) in enumerate(self.means):
            if g not in subset:
                weight, plus = weight * m, weight * n + plus * m
        return np.stack([self.constant * weight + plus, weight])

    def closed(self, subset):
        """The variance of E[y | x_v]."""
        element = _UNIT
        for g in subset:
            element = _times(element, self.elements[g])
        return _square(self._weights(subset), element)

    def totals(self):
        """Of every block, the variance that is left where all others are known."""
        after, before, totals = [_UNIT], _UNIT, []
        for element in self.elements[:0:-1]:
            after.append(_times(element, after[-1]))
        for (m, n), element, rest in zip(self.means, self.elements, after[::-1], strict=True):
            known = _square(np.stack([self.constant * m + n, m]), _times(before, rest))
            totals.append(max(self.variance - known, 0.0))
            before = _times(before, element)
        return np.array(totals)

    def conditionals(self, subsets, X):
        """E[y | x_v] at rows X in the box, less the mean, (n_subsets, n_rows)."""
        Z = self.scale.apply(X.T, np.empty(X.T.shape))
        factors, found = self.antecedent.factors(Z), np.empty((len(subsets), len(X)))
        parts = {
            g: self.by_function[g] @ _functions(factors, self.sets[g], Z[list(self.blocks[g])])
            for g in {g for subset in subsets for g in subset}
        }
        for one, subset in zip(found, subsets, strict=True):
            p, plus = np.ones(len(X)), np.zeros(len(X))
            for g in subset:
                p, plus = p * parts[g][0], p * parts[g][1] + plus * parts[g][0]
            constant, weight = self._weights(subset)
            one[:] = constant @ p + weight @ plus
        return found

    def curve(self, subset, X):
        """E[y | x_v] at rows X in the box, less the mean."""
        return self.conditionals([subset], X)[0]


def _times(one, other):
    """The product of two elements, (2, 2, n_rules, n_rules)."""
    ((a, b), (c, d)), ((e, f), (g, h)) = one, other
    return np.stack([[a * e, a * f + b * e], [a * g + c * e, a * h + b * g + c * f + d * e]])


def _square(weights, element):
    element = np.broadcast_to(element, (2, 2, *[weights.shape[1]] * 2))
    return float(np.einsum("ar,abrs,bs->", weights, element, weights, optimize=True))


def _but_rounding(variance, mean):
    """Zero where an output varies by rounding errors only."""
    return variance if variance > (_CONSTANT * mean) ** 2 else 0.0


class DrawnAnova:
    """The same of any rules, by draws."""

    def __init__(self, model, output, blocks, known):
        self.model, self.output, self.blocks, self.known = model, output, blocks, known
        self.n_rules = model.n_rules
        self.rng, self.mean = np.random.default_rng(0), 0.0
        self.rows = draw(blocks, known, N_DRAWS, self.rng)
        y = self._sum(self.rows)
        self.mean, self.y = float(y.mean()), y - y.mean()
        self.variance = _but_rounding(float(y.var()), self.mean)

    def _sum(self, rows):
        """The sum of rules, less the mean."""
        return replace(self.model, target=None).predict(rows)[:, self.output] - self.mean

    def closed(self, subset):
        """The variance of E[y | x_v], estimated."""
        return float(self.y @ self.conditionals([subset], self.rows)[0]) / N_DRAWS

    def totals(self):
        """Of every block, half of the mean square of what drawing it anew changes (Jansen 1999)."""
        every = range(len(self.blocks))
        others = [[g for g in every if g != one] for one in every]
        return 0.5 * ((self.y - self.conditionals(others, self.rows)) ** 2).mean(axis=1)

    def conditionals(self, subsets, X):
        """At rows X in the box, y with all but x_v drawn, less the mean: on average E[y | x_v]."""
        found = np.empty((len(subsets), len(X)))
        for one, subset in zip(found, subsets, strict=True):
            columns = [j for g in subset for j in self.blocks[g]]
            rows = draw(self.blocks, self.known, len(X), self.rng)
            rows[:, columns] = X[:, columns]
            one[:] = self._sum(rows)
        return found

    def curve(self, subset, X):
        """E[y | x_v] at rows X, less the mean, over the same draws of all others at each."""
        columns = [j for g in subset for j in self.blocks[g]]
        rows = np.tile(self.rows[:N_SHARED], (len(X), 1))
        rows[:, columns] = np.repeat(X[:, columns], N_SHARED, axis=0)
        return self._sum(rows).reshape(len(X), -1).mean(axis=1)


def covariances(anova, subsets, X):
    """Of E[y | x_v] and y over rows X in the box, and the variance of y there."""
    if isinstance(anova, DrawnAnova):
        X = np.tile(X, (-(-N_DRAWS // len(X)), 1))
    subsets = [range(len(anova.blocks)), *subsets]
    sums = products = np.zeros(len(subsets))
    n_values = 4 * len(anova.blocks) * anova.n_rules + len(subsets)
    for part in row_blocks(len(X), fitting_rows(n_values)):
        found = anova.conditionals(subsets, X[part])
        sums, products = sums + found.sum(axis=1), products + found @ found[0]
    found = products / len(X) - sums * sums[0] / len(X) ** 2
    return found[1:], float(found[0])
