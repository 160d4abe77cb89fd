r"""The functional ANOVA of a sum of rules under the product of the distributions of its inputs.

Inputs come in blocks, of one input or of several that enter together. On grids and trees the
strength of rule r is a product of a function of each block, w_r = prod_g p_rg, and its consequent
is a sum, a_r + sum_g l_rg. With a number e whose square is zero (a dual number), the rule adds to
the output the factor of e in one product over the blocks,

    (1 + a_r e) prod_g (p_rg + p_rg l_rg e) .

So E[y | x_v] takes the means of p and p l of the blocks that are not in v. The mean of its square
takes, for the blocks in v, the means of products of these in rules r and s, each with an e of its
own. Components are differences. Rules of other kinds are sampled: y at draws, and at other draws
that share only x_v with them.
"""

from dataclasses import dataclass, replace
from functools import partial, reduce
from itertools import accumulate

import numpy as np

from ..blocks import add_each, fitting_rows, row_blocks
from ..learning.data import Scale, StandardisedData
from ..policies import ROUNDING
from ..search import representative_rows, weighted_quantile

# Values of every input that a fit keeps, and most rows that they come from; draws in place of
# closed forms, and draws for the mean at each point of a curve.
N_VALUES, _MOST_ROWS, N_DRAWS, N_SHARED = 200, 2000, 20_000, 200


@dataclass(frozen=True, eq=False)
class Block:
    """Inputs that enter as one, and their distribution: rows with weights, None for equal weights.

    ``moments`` are mean products of the rules' functions of them, None if strengths are no
    products.
    """

    inputs: tuple[int, ...]
    values: np.ndarray
    weight: np.ndarray | None
    moments: np.ndarray | None


def rule_functions(antecedent, inputs):
    """Sets of terms that rules have on some inputs, the empty one first; and each rule's set."""
    table = antecedent.rule_terms
    own = np.where(np.isin(np.append(antecedent.term_inputs, -1)[table], inputs), table, -1)
    own = np.pad(own, ((1, 0), (0, 1)), constant_values=-1)
    sets, which = np.unique(own, axis=0, return_inverse=True)
    return sets, which.ravel()[1:]


def _functions(factors, sets, z):
    """Rows [p, z_1 p, ...] for the functions p of a block, z its standardised inputs."""
    padded = np.vstack([factors, np.ones((1, z.shape[1]))])
    p = np.ones((len(sets), z.shape[1]))
    for column in sets.T:
        p *= padded[column]
    return np.concatenate([p, *(p * one for one in z)])


def _sums(rows, antecedent, blocks, sets):
    """Sums over rows of the products of the functions of each block."""
    totals = [np.zeros(2 * [(1 + len(j)) * len(own)]) for j, own in zip(blocks, sets, strict=True)]
    n_values = antecedent.n_rules + 3 * antecedent.n_terms + 4 * max(map(len, sets))
    for _, Z, _, weight in rows.blocks(fitting_rows(n_values)):
        factors = antecedent.factors(Z)
        for inputs, own, total in zip(blocks, sets, totals, strict=True):
            found = _functions(factors, own, Z[list(inputs)])
            total += (found * weight) @ found.T
    return totals


def _moments(rows, antecedent, blocks):
    """Means over rows of these products; None for each block if strengths are no products."""
    if antecedent.factors(np.zeros((rows.inputs.scale.size, 1))) is None:
        return [None] * len(blocks)
    sets = [rule_functions(antecedent, inputs)[0] for inputs in blocks]
    of_rows = partial(_sums, antecedent=antecedent, blocks=blocks, sets=sets)
    return [total / rows.total_weight for total in rows.reduce(of_rows, add_each)]


def _standardised(model):
    """The rule base of a model on standardised inputs, and their scale."""
    antecedent = model.antecedent.change_units(-model.reference / model.spread, 1.0 / model.spread)
    return antecedent, Scale(model.reference, model.spread, model.minimum, model.maximum)


def blocks_of_rows(model, blocks, X, weight=None):
    """Blocks of the inputs of a model, over rows X in its box; weights sum to one."""
    antecedent, scale = _standardised(model)
    found = _moments(StandardisedData(X, X, weight, scale, scale), antecedent, blocks)
    return [Block(j, X[:, j], weight, own) for j, own in zip(blocks, found, strict=True)]


def input_marginals(rows, antecedent):
    """The data that a fit keeps on every input alone, see ``RuleSupport.marginals``."""
    blocks = [(j,) for j in range(rows.inputs.scale.size)]
    table, weight, _ = representative_rows(rows.sample or rows, _MOST_ROWS)
    parts = (np.arange(N_VALUES) + 0.5) / N_VALUES
    values = [weighted_quantile(table[:, j], weight, parts, 1) for (j,) in blocks]
    found = rows.reduce(partial(_beside, antecedent=antecedent), np.maximum) * [[-1.0], [1.0]]
    beside = [np.unique(found[:, antecedent.term_inputs == j]) for (j,) in blocks]
    return tuple(zip(_moments(rows, antecedent, blocks), values, beside, strict=True))


def _beside(rows, antecedent):
    """For every term, minus the next value above its place, and the next below, (2, n_terms)."""
    inputs, places = antecedent.term_inputs, antecedent.term_places[:, None]
    found = np.full((2, inputs.size), -np.inf)
    for _, every, _, _ in rows.blocks(fitting_rows(4 * inputs.size + 1)):
        Z = every[inputs]
        is_above = places < Z
        ends = np.where(is_above, -Z, -np.inf), np.where(is_above, -np.inf, Z)
        found = np.maximum(found, np.max(ends, axis=2))
    return found


def draw(blocks, n_draws, rng):
    """Rows drawn from the product of the blocks' distributions."""
    rows = np.empty((n_draws, sum(len(block.inputs) for block in blocks)))
    for block in blocks:
        chosen = rng.choice(len(block.values), n_draws, p=block.weight)
        rows[:, block.inputs] = block.values[chosen]
    return rows


class ProductAnova:
    """The ANOVA of one output of rules whose strengths are products, in closed form.

    ``error`` is the error that a share of the variance may have.
    """

    error = 0.0

    def __init__(self, model, output, blocks):
        self.n_rules, self.n_blocks = model.n_rules, len(blocks)
        self.antecedent, self.scale = _standardised(model)
        slopes = model.consequents[:, 1:, output] * model.spread
        self.parts, self.means, self.squares = [], [], []
        every = np.arange(model.n_rules)
        for block in blocks:
            sets, which = rule_functions(model.antecedent, block.inputs)
            # p and p l of every rule as sums of the functions of the block.
            by = np.zeros((2, model.n_rules, len(block.moments)))
            by[0, every, which] = 1.0
            for i, j in enumerate(block.inputs, start=1):
                by[1, every, i * len(sets) + which] = slopes[:, j]
            half = by @ block.moments
            self.parts.append((list(block.inputs), sets, by))
            self.means.append(half[:, :, 0])
            self.squares.append(np.einsum("arm,bsm->abrs", half, by, optimize=True))
        # In many columns most have neither terms nor slopes: a product with their means is in vain.
        in_vain = np.array([[1.0], [0.0]])
        self.with_part = [g for g, mean in enumerate(self.means) if np.any(mean != in_vain)]
        self.start = np.stack([np.ones(model.n_rules), model.coefficients[:, 0, output]])
        self.mean = float(self._others(())[1].sum())
        # Count from the mean, so that squares lose no digits.
        self.start[1] -= self.mean
        apart = np.abs(self.start[1]).max() + np.abs(slopes).max()
        self.variance = _but_rounding(self.closed(range(len(blocks))), self.mean, apart)

    def _others(self, subset):
        """For every rule, the product of the means of all blocks that are not in the subset."""
        others = (self.means[g] for g in self.with_part if g not in subset)
        return reduce(_times, others, self.start)

    def closed(self, subset):
        """The variance of E[y | x_v]."""
        squares = (self.squares[g] for g in subset)
        return float(reduce(_times_both, squares, _outer(self._others(subset)))[1, 1].sum())

    def totals(self):
        """For every block, the variance left when all others are known (Sobol's total)."""
        before = accumulate(self.squares[:-1], _times_both, initial=_outer(self.start))
        nothing = np.zeros_like(self.squares[0])
        nothing[0, 0] = 1.0
        after = [*accumulate(self.squares[:0:-1], _times_both, initial=nothing)][::-1]
        own = [a - _outer(b) for a, b in zip(self.squares, self.means, strict=True)]
        products = [_times_both(a, b) for a, b in zip(before, after, strict=True)]
        found = [_times_both(a, b)[1, 1].sum() for a, b in zip(products, own, strict=True)]
        return np.maximum(found, 0.0)

    def curve(self, subset, X):
        """E[y | x_v] at rows X in the box, less the mean."""
        others, found = self._others(subset)[:, :, None], np.empty(len(X))
        for part in row_blocks(len(X), fitting_rows(4 * (1 + len(subset)) * self.n_rules)):
            Z = self.scale.apply(X[part].T)
            factors = self.antecedent.factors(Z)
            of_blocks = (
                by @ _functions(factors, sets, Z[inputs])
                for inputs, sets, by in (self.parts[g] for g in subset)
            )
            found[part] = reduce(_times, of_blocks, others)[1].sum(axis=0)
        return found

    def covariances(self, subsets, X):
        """Covariances of E[y | x_v] and y over rows X in the box, and the variance of y there."""
        y = self.curve(range(self.n_blocks), X)
        y -= y.mean()
        return np.array([y @ self.curve(v, X) / len(X) for v in subsets]), float(y.var())


def _times(one, other):
    """The product of a + b e and c + d e."""
    (a, b), (c, d) = one, other
    return np.stack([a * c, a * d + b * c])


def _times_both(one, other):
    """The same product for numbers with two different e, one for each rule."""
    (a, b), (c, d) = one, other
    return np.stack([_times(a, c), _times(a, d) + _times(b, c)])


def _outer(of_rules):
    return of_rules[:, None, :, None] * of_rules[None, :, None, :]


def _but_rounding(variance, mean, apart=0.0):
    """The variance, or zero where an output varies by rounding errors only.

    What rules say ``apart`` from the mean may cancel: then rounding errors of its squares are left.
    """
    return variance if variance > max((ROUNDING * mean) ** 2, ROUNDING * apart**2) else 0.0


class DrawnAnova:
    """The ANOVA of one output of any rules, by draws."""

    error = 0.02

    def __init__(self, model, output, blocks):
        self.model, self.output, self.blocks = model, output, blocks
        self.n_rules, self.n_blocks = model.n_rules, len(blocks)
        has_part = model.consequents[:, 1:, output].any(axis=0)
        has_part[model.antecedent.term_inputs] = True
        self.has_part = [has_part[list(block.inputs)].any() for block in blocks]
        rng, self.mean = np.random.default_rng(0), 0.0
        self.rows, self.others = draw(blocks, N_DRAWS, rng), draw(blocks, N_DRAWS, rng)
        self.y, self.of_others = (self._given((), rows, rows) for rows in (self.rows, self.others))
        self.mean = float(self.y.mean())
        self.y, self.of_others = self.y - self.mean, self.of_others - self.mean
        self.variance = _but_rounding(float(self.y.var()), self.mean)

    def _given(self, subset, X, draws):
        """The sum of rules at ``draws``, less the mean; x_v is first replaced by that of rows X."""
        columns = [j for g in subset for j in self.blocks[g].inputs]
        draws[:, columns] = X[:, columns]
        return replace(self.model, target=None).predict(draws)[:, self.output] - self.mean

    def _conditional(self, subset, X):
        """An estimate of E[y | x_v] less the mean, at rows X in the box: y with the rest drawn.

        Regression on y at the draws takes off the part that the draws themselves explain.
        """
        if not (parts := [g for g in subset if self.has_part[g]]):
            return np.zeros(len(X))
        own = np.resize(self.of_others, len(X))
        found = self._given(parts, X, np.resize(self.others, X.shape))
        return found - own * (found @ own) / max(own @ own, np.finfo(float).tiny)

    def closed(self, subset):
        """The variance of E[y | x_v], estimated."""
        return float(self.y @ self._conditional(subset, self.rows)) / N_DRAWS

    def totals(self):
        """For every block, half of the mean square by which it alone moves y (Jansen 1999)."""
        moved = (self._given((g,), self.others, self.rows.copy()) for g in range(self.n_blocks))
        return np.array([np.mean((one - self.y) ** 2) / 2.0 for one in moved])

    def covariances(self, subsets, X):
        """Covariances of E[y | x_v] and y over rows X in the box, and the variance of y there."""
        X = np.tile(X, (-(-N_DRAWS // len(X)), 1))
        y = self._given((), X, X)
        y -= y.mean()
        found = [y @ self._conditional(v, X) / len(X) for v in subsets]
        return np.array(found), float(y.var())

    def curve(self, subset, X):
        """E[y | x_v] at rows X, less the mean; all rows share the draws of the other inputs."""
        draws = np.tile(self.rows[:N_SHARED], (len(X), 1))
        found = self._given(subset, np.repeat(X, N_SHARED, axis=0), draws)
        return found.reshape(len(X), -1).mean(axis=1)
