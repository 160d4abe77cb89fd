"""Brute force: the formulas of the papers, dense, one at a time, fast in nothing.

Nothing here normalises in log space, factorises a grid, works in blocks, changes the basis on a
Gram matrix or eliminates by a Cholesky factor: what the package does cleverly is done plainly. All
of it is analytic in the premises, so that a derivative is the imaginary part at a complex step.
"""

from itertools import product

import numpy as np

from skanfis.antecedent import GridAntecedent, RuleTableAntecedent, TermGroup, TreeAntecedent
from skanfis.learning.data import StandardisedData
from skanfis.membership import Bell, Gaussian
from skanfis.support import RuleSupport

# With a complex step there is no difference to lose digits in: any tiny step is exact to rounding.
STEP = 1e-30


def complex_step(function, parameters):
    """Derivatives of an analytic function of a vector, one along the last axis per entry."""
    columns = []
    for i in range(parameters.size):
        moved = np.array(parameters, dtype=complex)
        moved[i] += 1j * STEP
        columns.append(np.imag(function(moved)) / STEP)
    return np.stack(columns, axis=-1)


def central_difference(function, parameters, step=1e-2):
    """Derivatives by the eight-point rule of order 8, where complex numbers do not go."""
    weights = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
    columns = []
    for i in range(parameters.size):
        unit = np.zeros(parameters.size)
        unit[i] = step
        columns.append(
            sum(
                w * (np.asarray(function(parameters + k * unit)) - function(parameters - k * unit))
                for k, w in weights.items()
            )
            / step
        )
    return np.stack(columns, axis=-1)


def sigmoid(u):
    """1 / (1 + e^-u)."""
    return 1 / (1 + np.exp(-u))


def spline(x, foot, shoulder):
    """From zero at the foot to one at the shoulder, by two parabolas, on whichever side it lies."""
    rise = np.clip((x - foot) / (shoulder - foot), 0, 1)
    return np.where(rise < 0.5, 2 * rise**2, 1 - 2 * (1 - rise) ** 2)


def corners(function, numbers):
    """a, b, c, d of a term that has them: left foot, shoulders, right foot."""
    if function == "s_shaped":
        return numbers["shoulder"] - numbers["width"], numbers["shoulder"], np.inf, np.inf
    if function == "z_shaped":
        return -np.inf, -np.inf, numbers["shoulder"], numbers["shoulder"] + numbers["width"]
    b = numbers["center"] - numbers.get("plateau", 0.0) / 2
    c = numbers["center"] + numbers.get("plateau", 0.0) / 2
    return b - numbers["left"], b, c, c + numbers["right"]


def textbook_membership(function, x, numbers):
    """mu(x) by name, from the numbers that a person reads in a paper."""
    if function == "gaussian":
        return np.exp(-(((x - numbers["center"]) / numbers["width"]) ** 2) / 2)
    if function == "bell":
        distance = np.abs((x - numbers["center"]) / numbers["width"])
        return 1 / (1 + distance ** (2 * numbers["slope"]))
    if function == "sigmoid_difference":
        first, second = numbers["center"] - numbers["width"], numbers["center"] + numbers["width"]
        rise, fall = (x - first) / numbers["flank"], (x - second) / numbers["flank"]
        # To the right of the center from the other end: 1 - s(u) = s(-u) keeps its digits there.
        right = sigmoid(-fall) - sigmoid(-rise)
        return np.where(x < numbers["center"], sigmoid(rise) - sigmoid(fall), right)
    signs = {"sigmoid_product": (1, -1), "sigmoids_rising": (1, 1)}
    signs |= {"sigmoids_falling": (-1, -1), "sigmoids_apart": (-1, 1)}
    if function in signs:
        first, second = numbers["center"] - numbers["width"], numbers["center"] + numbers["width"]
        at_left = sigmoid(signs[function][0] * (x - first) / numbers["left"])
        return at_left * sigmoid(signs[function][1] * (x - second) / numbers["right"])
    if function == "sigmoid_rising":
        return sigmoid((x - numbers["center"]) / numbers["width"])
    if function == "sigmoid_falling":
        return sigmoid((numbers["center"] - x) / numbers["width"])
    a, b, c, d = corners(function, numbers)
    if function in ("triangular", "trapezoidal"):
        return np.clip(np.minimum((x - a) / (b - a), (d - x) / (d - c)), 0, 1)
    if function == "two_sided_gaussian":
        left = np.where(x < b, np.exp(-(((x - b) / numbers["left"]) ** 2) / 2), 1.0)
        return left * np.where(x > c, np.exp(-(((x - c) / numbers["right"]) ** 2) / 2), 1.0)
    if function == "s_shaped":
        return spline(x, a, b)
    if function == "z_shaped":
        return spline(x, d, c)
    if function == "pi_shaped":
        return spline(x, a, b) * spline(x, d, c)
    raise NotImplementedError(function)


def textbook_strengths(terms, rules, input_names, X):
    """Products of memberships over their sum, (n_rules, n_rows), from what a person is told."""
    names = list(input_names)
    mu = [textbook_membership(t["function"], X[:, names.index(t["input"])], t) for t in terms]
    mu = np.array(mu).reshape(-1, len(X))
    products = np.array([np.prod(mu[[t for t in rule if t >= 0]], axis=0) for rule in rules])
    return products / products.sum(axis=0)


def textbook_predict(strengths, consequents, X):
    """sum_r w_r (p_r0 + p_r1 x_1 + ... + p_rd x_d), with p of (n_rules, 1 + d, n_outputs)."""
    basis = np.column_stack([np.ones(len(X)), X])
    return np.einsum("rn,ni,rio->no", strengths, basis, consequents)


def by_formula(formula, x, numbers):
    """What a printed formula says: "f where t = g", "f where s(u) = g", or "f"."""
    formula, _, where = formula.replace("^", "**").partition(" where ")
    words = numbers | {"x": x, "exp": np.exp, "abs": np.abs}
    words["max"] = lambda *v: np.max(np.broadcast_arrays(*v), axis=0)
    name, _, value = where.partition(" = ")
    if name == "s(u)":
        words["s"] = lambda u: eval(value, words | {"u": u})
    elif name:
        words[name] = eval(value, words)
    return eval(formula, words)


def rules_by_hand(antecedent):
    """Terms of every rule as lists, from nothing but the inputs of the terms."""
    inputs = [int(j) for group in antecedent.groups for j in group.inputs]
    if isinstance(antecedent, GridAntecedent):
        used = list(dict.fromkeys(inputs))
        return list(product(*[[t for t, j in enumerate(inputs) if j == u] for u in used]))
    if isinstance(antecedent, RuleTableAntecedent):
        return [[int(t) for t in rule if t >= 0] for rule in antecedent.table]
    n_used = len(set(inputs))
    return [range(r * n_used, (r + 1) * n_used) for r in range(len(inputs) // n_used)]


def memberships(antecedent, parameters, Z):
    """mu of every term, by the families' textbook formulas."""
    rows, start = [], 0
    for group in antecedent.groups:
        n_parameters, n_terms = len(group.family.parameters), group.inputs.size
        theta = parameters[start : start + n_parameters * n_terms].reshape(n_parameters, n_terms)
        rows += [group.family.value(Z[[j]], theta[:, [t]])[0] for t, j in enumerate(group.inputs)]
        start += n_parameters * n_terms
    return np.array(rows)


def strengths(antecedent, parameters, Z):
    """Product of the memberships of every rule, over the sum of all products."""
    if not antecedent.groups:
        return np.ones((1, Z.shape[1]))
    mu = memberships(antecedent, parameters, Z)
    products = np.array([np.prod(mu[list(rule)], axis=0) for rule in rules_by_hand(antecedent)])
    return products / products.sum(axis=0)


def dense_design(antecedent, parameters, Z, order, inputs=None):
    """Phi, shape (n_rows, n_columns): w_r, w_r z_1, ..., w_r z_d for one rule after another."""
    columns = []
    for w in strengths(antecedent, parameters, Z):
        columns.append(w)
        if order == 1:
            columns += [w * z for z in (Z if inputs is None else Z[inputs])]
    return np.array(columns).T


def departure_projectors(antecedent, slope_inputs):
    """For the inputs that a part of the departures concerns, its projector; () for the rest.

    As the analysis of variance is taught: what varies along some axes of the grid is what means
    along the others leave, less the means along these.
    """
    functions = [(), *((j,) for j in slope_inputs)]
    found = {}
    is_grid = isinstance(antecedent, GridAntecedent)
    if is_grid:
        inputs = [int(antecedent.term_inputs[column[0]]) for column in antecedent.rule_terms.T]
        counts = antecedent.counts
        by_axes = []
        for varies in np.ndindex(*(2,) * len(counts)):
            projector = np.eye(1)
            for m, one in zip(counts, varies, strict=True):
                mean = np.full((m, m), 1.0 / m)
                projector = np.kron(projector, np.eye(m) - mean if one else mean)
            by_axes.append(({j for j, one in zip(inputs, varies, strict=True) if one}, projector))
    else:
        inputs, by_axes = [], [(set(), np.eye(antecedent.n_rules))]
    for varying, projector in by_axes:
        for i, function in enumerate(functions):
            concerned = tuple(sorted(varying.union(function)))
            is_common = is_grid and not varying and not set(function) <= set(inputs)
            key = () if len(concerned) > 2 or is_common else concerned
            own = np.zeros((len(functions), len(functions)))
            own[i, i] = 1.0
            found[key] = found.get(key, 0.0) + np.kron(projector, own)
    return found


class DenseProblem:
    """min_beta 1/2 [MSE + lambda V + sum alpha_c |delta_c|^2 + rho |slopes|^2], in one piece.

    Everything is a sum of squares of :meth:`residuals`, which are written down from the definitions
    in ``skanfis.learning.penalty``: no row sums of Gram matrices, no projections.
    """

    def __init__(self, rows, antecedent, order, penalty, consequent_inputs=None):
        self.antecedent, self.order, self.penalty = antecedent, order, penalty
        self.inputs = consequent_inputs
        self.Z = ((rows.X - rows.inputs.offset) / rows.inputs.scale).T
        self.y = (rows.y - rows.targets.offset) / rows.targets.scale
        self.weight = rows.weights / rows.weights.sum()
        slopes = self.Z[: len(self.Z) * order]
        slopes = slopes if consequent_inputs is None else slopes[consequent_inputs]
        self.basis = np.vstack([np.ones((1, self.y.shape[0])), slopes])
        self.n_rules = len(strengths(antecedent, antecedent.parameters, self.Z))
        self.centers = self._centers()
        self.extent = self._extent()
        # Rules of a common line have its value at their centres, and its slopes.
        self.blocks = [self._value_and_slopes(r) for r in range(self.n_rules)]
        self.line = np.concatenate(self.blocks)

    def _centers(self):
        """Mean of the consequents' inputs where each rule fires at the start."""
        firing = strengths(self.antecedent, self.antecedent.parameters, self.Z) * self.weight
        total = firing.sum(axis=1, keepdims=True)
        return np.where(total > 1e-12, firing @ self.basis[1:].T / np.maximum(total, 1e-12), 0.0)

    def _extent(self):
        """How far from its centre each rule stands for the rows at the start, at least one."""
        firing = strengths(self.antecedent, self.antecedent.parameters, self.Z)
        extent = np.ones_like(self.centers)
        for r, j in np.ndindex(*extent.shape):
            for w, z in zip(firing[r], self.basis[1 + j], strict=True):
                extent[r, j] = max(extent[r, j], np.sqrt(w) * abs(z - self.centers[r, j]))
        return extent

    def _value_and_slopes(self, r):
        """Of coefficients on [1, z]: the value at rule r's center, the rise over its extent."""
        matrix = np.diag([1.0, *self.extent[r]])
        matrix[0, 1:] = self.centers[r]
        return matrix

    def design(self, parameters):
        """Phi on [1, z]."""
        return dense_design(self.antecedent, parameters, self.Z, self.order, self.inputs)

    def residual_matrix(self, parameters):
        """A with residuals A beta - b of one output: rows, rules on rows, deviations, slopes."""
        w = strengths(self.antecedent, parameters, self.Z)
        n_basis, n_columns = len(self.basis), self.n_rules * len(self.basis)
        phi = np.sqrt(self.weight)[:, None] * self.design(parameters)
        own = np.zeros((self.n_rules, self.y.shape[0], n_columns))
        for r in range(self.n_rules):
            own[r, :, r * n_basis : (r + 1) * n_basis] = self.basis.T
        apart = np.sqrt(w)[:, :, None] * (np.sqrt(self.weight)[:, None] * own - phi)
        values = np.zeros((n_columns, n_columns))
        for r, block in enumerate(self.blocks):
            values[r * n_basis : (r + 1) * n_basis, r * n_basis : (r + 1) * n_basis] = block
        to_line, *_ = np.linalg.lstsq(self.line, values, rcond=None)
        parts = [
            phi,
            np.sqrt(self.penalty.agreement) * apart.reshape(-1, n_columns),
            self._pulled(values - self.line @ to_line),
            self._slope_roots()[:, None] * to_line[1:],
        ]
        return np.vstack(parts)

    def _slope_inputs(self):
        inputs = np.arange(len(self.Z)) if self.inputs is None else self.inputs
        return inputs.tolist() if self.order else []

    def _slope_roots(self):
        pulls = self.penalty.slope_pulls
        own = [pulls.get(j, 1.0) for j in self._slope_inputs()]
        return np.sqrt(self.penalty.slope * np.array(own))

    def _pulled(self, departures):
        """Departures of all rules, each part times the root of its pull."""
        alpha, pulls = self.penalty.alpha, self.penalty.pulls
        parts = departure_projectors(self.antecedent, self._slope_inputs())
        roots = {key: np.sqrt(alpha * pulls.get(key, 1.0)) for key in parts}
        return sum(roots[key] * part @ departures for key, part in parts.items())

    def right_side(self, n_residuals):
        """b, (n_residuals, n_outputs)."""
        target = np.zeros((n_residuals, self.y.shape[1]))
        target[: len(self.y)] = np.sqrt(self.weight)[:, None] * self.y
        return target

    def coefficients(self, parameters):
        """beta on [1, z], from the normal equations of all residuals."""
        matrix = self.residual_matrix(parameters)
        return np.linalg.solve(matrix.T @ matrix, matrix.T @ self.right_side(len(matrix)))

    def cost_at(self, parameters, beta):
        """F at any coefficients, analytic: squares are of complex numbers, not of their sizes."""
        matrix = self.residual_matrix(parameters)
        return 0.5 * np.sum((matrix @ beta - self.right_side(len(matrix))) ** 2)

    def cost(self, parameters):
        """F."""
        return self.cost_at(parameters, self.coefficients(parameters))

    def gradient(self, parameters):
        """dF / d theta."""
        return complex_step(self.cost, parameters)

    def gauss_newton(self, parameters):
        """Schur complement of J'J, J the Jacobian of the residuals by theta and beta together.

        By theta that of the rows alone: the disagreement's is left out.
        """
        beta = self.coefficients(parameters)
        by_theta = complex_step(lambda p: self.residual_matrix(p) @ beta, parameters)
        by_theta[len(self.y) :] = 0.0
        orthogonal, _ = np.linalg.qr(self.residual_matrix(parameters))
        total = 0.0
        for k in range(self.y.shape[1]):
            jacobian = by_theta[:, k]
            projected = jacobian - orthogonal @ (orthogonal.T @ jacobian)
            total = total + projected.T @ projected
        return total


def bumpy_rows(rng, n_rows=300, n_inputs=2, n_outputs=1, weighted=False):
    """Rows in odd units, with a target that no small model fits exactly."""
    X = rng.normal(size=(n_rows, n_inputs)) * 10.0 ** np.arange(n_inputs) + 3.0
    z = (X - X.mean(axis=0)) / X.std(axis=0)
    bumps = np.sin(np.outer(z[:, 0], 1.5 + np.arange(n_outputs))) * np.cos(z[:, [-1]])
    y = bumps + 0.3 * z.sum(axis=1, keepdims=True) + 0.1 * rng.normal(size=(n_rows, n_outputs))
    return StandardisedData.of(X, y, rng.uniform(0.2, 3.0, n_rows) if weighted else None)


def even_grid(families, counts, low, high, overlap):
    """A grid of evenly spaced terms from end to end; neighbours cross at ``overlap``."""
    thetas = []
    for j, (family, count) in enumerate(zip(families, counts, strict=True)):
        spacing = (high[j] - low[j]) / (count - 1)
        centers = np.linspace(low[j], high[j], count)
        thetas.append(family.start(centers, np.full(count, spacing), overlap))
    return GridAntecedent.build(list(families), list(range(len(counts))), thetas)


def random_grid(rng, families, counts, inputs=None):
    """A grid whose terms are in order but otherwise anywhere."""
    inputs = range(len(counts)) if inputs is None else inputs
    thetas = []
    for family, count in zip(families, counts, strict=True):
        centers = np.linspace(-1.5, 1.5, count) + 0.2 * rng.normal(size=count)
        theta = family.start(centers, np.full(count, 3.0 / max(count - 1, 1)), 0.6)
        theta[1:] += 0.2 * rng.normal(size=theta[1:].shape)
        thetas.append(theta)
    return GridAntecedent.build(list(families), list(inputs), thetas)


def own_terms(family, inputs, theta):
    """Scattered rules of one family; theta (n_parameters, n_rules, n_premise_inputs)."""
    terms = {int(j): theta[:, :, k] for k, j in enumerate(inputs)}
    return RuleTableAntecedent.of_own_terms(dict.fromkeys(terms, family), terms)


def scattered_of_one_width(family, centers, width):
    """Rules of one family at centers (n_rules, n_inputs)."""
    centers = np.array(centers, dtype=float)
    theta = family.from_center_and_width(centers, np.full(centers.shape, width))
    return own_terms(family, np.arange(centers.shape[1]), theta)


def random_scattered(rng, family, n_rules, inputs):
    """Rules anywhere within reach of standardised data."""
    inputs = np.asarray(inputs)
    centers = rng.normal(size=(n_rules, inputs.size))
    theta = family.from_center_and_width(centers, rng.uniform(0.7, 1.5, centers.shape))
    theta[1:] += 0.2 * rng.normal(size=theta[1:].shape)
    # One of the rules looks at fewer inputs.
    theta[:, 0, 1:2] = np.nan
    return own_terms(family, inputs, theta)


def random_table(rng, n_rules=5, inputs=3, families=(Gaussian, Bell, Gaussian)):
    """Rules over shared terms, three per input; the first two rules look at fewer inputs."""
    groups = []
    for j, family in zip(range(inputs), families, strict=False):
        centers = np.array([-1.0, 0.3, 1.2]) + 0.2 * rng.normal(size=3)
        theta = family.from_center_and_width(centers, rng.uniform(0.7, 1.5, 3))
        groups.append(TermGroup(family, np.full(3, j), theta))
    table = rng.integers(0, 3, (n_rules, inputs)) + 3 * np.arange(inputs)
    table[0, -1] = table[1, 0] = -1
    return RuleTableAntecedent(tuple(groups), table)


def random_tree(rng, n_rules=6, inputs=(0, 1, 2)):
    """A tree that has grown anywhere, some of its cuts sharp."""
    tree = TreeAntecedent.build([], np.empty((2, 0)), [[]])
    while tree.n_rules < n_rules:
        log_width = np.log(rng.uniform(0.05, 0.8))
        tree = tree.split(rng.integers(tree.n_rules), rng.choice(inputs), rng.normal(), log_width)
    return tree


def random_support(rng, n_rules, n_inputs):
    """Support of rules in standardised units; rule 1 has none where there are more than two."""
    share = rng.uniform(0.3, 1.0, n_rules)
    if n_rules > 2:
        share[1] = 0.0
    factor = np.tril(rng.normal(size=(n_rules, n_inputs, n_inputs))) + 2.0 * np.eye(n_inputs)
    centers = rng.normal(size=(n_rules, n_inputs))
    return RuleSupport(share, centers, factor, rng.uniform(0.5, 2.0, n_rules))


def textbook_coverage(model, X):
    """exp(-|delta|^2 / 2) sum_r w_r share_r exp(-max(0, d_r - D_r)^2 / 2), row by row."""
    found = []
    for row in X:
        nearest = np.minimum(np.maximum(row, model.minimum), model.maximum)
        total = 0.0
        for r, strength in enumerate(model.strengths(nearest[None])[0]):
            support = model.support
            factor = support.factor[r]
            precision = factor.T @ factor
            away = nearest - support.center[r]
            beyond = max(0.0, np.sqrt(away @ precision @ away) - support.radius[r])
            total += strength * support.share[r] * np.exp(-0.5 * beyond**2)
        found.append(total * np.exp(-0.5 * np.sum(((row - nearest) / model.spread) ** 2)))
    return np.array(found)


def held_tangent(model, X, limit):
    """Value of the nearest row in the box and slopes times the way, held at ``limit`` spreads."""
    nearest = np.clip(X, model.minimum, model.maximum)
    reach = limit * model.spread
    way = np.minimum(np.maximum(X - nearest, -reach), reach)
    ahead = np.einsum("ij,ijo->io", way, model.gradient(nearest))
    return model.with_out_of_bounds("clip").predict(nearest) + ahead
