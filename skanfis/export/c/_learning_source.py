"""The learner in C (see ``_learner`` for what it computes), and the test that it learns as that."""

from dataclasses import replace

import numpy as np
from scipy.stats import qmc

from ._cost import with_learner
from ._self_test import ROWS
from ._source import Source
from ._text import literals

__all__ = ["LearningSource", "learning_test"]

# The size of made-up innovations, in parts of what is summed; and how far off what they teach may
# be, in parts of that size.
_SURPRISE = 0.01
_TOLERANCE = {np.dtype(np.float64): 1e-9, np.dtype(np.float32): 1e-3}

_TYPE = """
/* What is learnt, and how sure it is: a covariance U D U'. */
typedef struct {
    $real upper[$n_upper]; /* of U, above its diagonal, column by column */
    $real diagonal[$n];
    $real change[$NAME_N_OUTPUTS][$n]; /* of a value and slopes per deviation, rule by rule */
    int next;
    int is_frozen;
} $name_learner;

#define $NAME_NOT_LEARNT 16 /* of $name_learn: the row has changed nothing */

/* As after training; call it first. */
void $name_reset($name_learner *q);

/* With 1, nothing is learnt until it is called with 0. */
void $name_freeze($name_learner *q, int is_frozen);

/* As $name_predict, with what is learnt. */
int $name_predict_learnt(const $name_learner *q,
    const $real x[$NAME_N_INPUTS], $real y[$NAME_N_OUTPUTS]);

/* Learns the target t of a row. Rows out of range, or not finite, are not learnt from. */
int $name_learn($name_learner *q,
    const $real x[$NAME_N_INPUTS], const $real t[$NAME_N_OUTPUTS]);
"""

_UPDATE = """
/* An observation of variance r along phi (Bierman 1977); gain is to be divided by what returns. */
static $real $name_observe($name_learner *q, const $real *phi, $real r, $real *gain)
{
    $real *u = q->upper;
    $index i, j;
    for (j = 0; j < $n; ++j) {
        $real f = phi[j];
        for (i = 0; i < j; ++i) {
            f += u[i] * phi[i];
        }
        gain[j] = 0.0R;
        if (f < 0.0R || f > 0.0R) {
            const $real v = q->diagonal[j] * f, p = -f / r, before = r;
            r += v * f;
            q->diagonal[j] *= before / r;
            for (i = 0; i < j; ++i) {
                const $real old = u[i];
                u[i] = old + gain[i] * p;
                gain[i] += old * v;
            }
            gain[j] = v;
        }
        u += j;
    }
    return r;
}
"""

_FORGET = """
/* Divides the covariance by the forgetting factor, and holds one variance after the other. */
static void $name_forget($name_learner *q, $real *phi, $real *gain)
{
    const $real *u = q->upper;
    const $index next = q->next;
    $real variance = 0.0R;
    $index i;
    for (i = 0; i < $n; ++i) {
        const $real root = i < next ? 0.0R : i == next ? 1.0R : u[next];
        q->diagonal[i] *= $inverse;
        variance += root * root * q->diagonal[i];
        phi[i] = i == next ? 1.0R : 0.0R;
        u += i;
    }
    if (variance > $name_bound[next]) {
        const $real bound = $name_bound[next];
        (void)$name_observe(q, phi, bound * (variance / (variance - bound)), gain);
    }
    q->next = q->next + 1 < $n ? q->next + 1 : 0;
}
"""

_LEARN = """
void $name_reset($name_learner *q)
{
    $index i;
    int o;
    for (i = 0; i < $n_upper; ++i) {
        q->upper[i] = $name_upper[i];
    }
    for (i = 0; i < $n; ++i) {
        q->diagonal[i] = $name_diagonal[i];
        for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
            q->change[o][i] = 0.0R;
        }
    }
    q->next = 0;
    q->is_frozen = 0;
}

void $name_freeze($name_learner *q, int is_frozen)
{
    q->is_frozen = is_frozen;
}

int $name_learn($name_learner *q, const $real x[$NAME_N_INPUTS], const $real t[$NAME_N_OUTPUTS])
{
    $real phi[$n], gain[$n], y[$NAME_N_OUTPUTS], total;
    $index i;
    int o;
    const int status = $name_predict_learnt(q, x, y);
    if (q->is_frozen || (status & ($NAME_OUT_OF_RANGE | $NAME_NOT_FINITE))) {
        return status | $NAME_NOT_LEARNT;
    }
    for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
        if (!(t[o] >= -$MAX && t[o] <= $MAX)) {
            return status | $NAME_NOT_LEARNT;
        }
    }
$forget    $name_regressor(x, phi);
    total = $name_observe(q, phi, 1.0R, gain);
    for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
        const $real step = (t[o] - y[o]) / total;
        for (i = 0; i < $n; ++i) {
            q->change[o][i] += gain[i] * step;
        }
    }
    return status;
}
"""

_TEST = """
static const $real $name_learn_x[$n_test][$NAME_N_INPUTS] =
$x;

static const $real $name_learn_t[$n_test][$NAME_N_OUTPUTS] =
$t;

/* What is answered after all of them are learnt, and how far off it may be. */
static const $real $name_learn_y[$n_test][$NAME_N_OUTPUTS] =
$y;

static const $real $name_learn_off[$NAME_N_OUTPUTS] =
$off;

/* Learns rows one by one; returns 0, or 1000 and the number of the first that fails. */
static int $name_learner_test(void)
{
    static $name_learner q;
    int i, o;
    $name_reset(&q);
    for (i = 0; i < $n_test; ++i) {
        if ($name_learn(&q, $name_learn_x[i], $name_learn_t[i]) & $NAME_NOT_LEARNT) {
            return 1001 + i;
        }
    }
    $name_freeze(&q, 1);
    for (i = 0; i < $n_test; ++i) {
        $real y[$NAME_N_OUTPUTS];
        if (!($name_learn(&q, $name_learn_x[i], $name_learn_t[i]) & $NAME_NOT_LEARNT)) {
            return 1001 + i;
        }
        (void)$name_predict_learnt(&q, $name_learn_x[i], y);
        for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
            const $real off = y[o] - $name_learn_y[i][o];
            if (!(off <= $name_learn_off[o]$factor && -off <= $name_learn_off[o]$factor)) {
                return 1001 + i;
            }
        }
    }
    return 0;
}
"""


class _Learnt(Source):
    """The model with what is learnt added to its consequents."""

    suffix = "_learnt"
    learner = ("const $name_learner *q",)
    passes = ("q",)

    @property
    def height(self):
        return f"$name_consequents[r][o][0] + q->change[o][{self.n_basis} * r]"

    @property
    def slope(self):
        change = f"q->change[o][{self.n_basis} * r + 1 + j] * $name_inverse_spread[@]"
        return f"($name_consequents[r][o][1 + j] + {change})"

    @property
    def n_basis(self):
        return self.numbers.coefficients.shape[2]


class LearningSource(Source):
    """A Source whose consequents can go on learning."""

    def __init__(self, numbers, dialect, policy, min_coverage, learner, *, limits=None):
        super().__init__(numbers, dialect, policy, min_coverage, limits=limits)
        self.learning = learner
        # What it learns may lead beyond what was seen before the export: only limits hold that.
        free = replace(numbers, output_low=None, output_high=None)
        self._learnt = _Learnt(free, dialect, policy, min_coverage, limits=limits)
        self.index = "long" if learner.packed.size > 32767 else "int"

    @property
    def cost(self):
        return with_learner(super().cost, self)

    def fill(self, template, **words):
        """A template of this module."""
        learner = self.learning
        return self.write(
            template, n=learner.n, n_upper=learner.packed.size, index=self.index, **words
        )

    def declarations(self):
        return self.fill(_TYPE)

    def learning_tables(self):
        """Constants that learning takes besides."""
        dtype, learner = self.numbers.dtype, self.learning
        tables = {"upper": learner.packed, "diagonal": learner.diagonal}
        if learner.forgets:
            tables["bound"] = learner.bound
        if self.has_slopes and not self.judges_coverage:
            tables["inverse_spread"] = self.numbers.inverse_spread
        limits = np.finfo(dtype)
        return {
            name: np.clip(values, limits.min, limits.max).astype(dtype)
            for name, values in tables.items()
        }

    def body(self):
        real = self.dialect.real
        tables = [self.table(real, name, v) for name, v in self.learning_tables().items()]
        parts = [super().body(), *tables]
        if self._learnt.is_linear:
            parts.append(self._learnt.tangent())
        parts += [self._learnt.predict(), self.regressor(), self.fill(_UPDATE).lstrip()]
        forget = ""
        if self.learning.forgets:
            inverse = self.dialect.number(1.0 / self.learning.forgetting)
            parts.append(self.fill(_FORGET, inverse=inverse).lstrip())
            forget = self.fill("    $name_forget(q, phi, gain);\n")
        parts.append(self.fill(_LEARN, forget=forget).lstrip())
        return "\n".join(parts)

    def regressor(self):
        """The function that writes phi of a row in range."""
        numbers, n_basis = self.numbers, self.numbers.coefficients.shape[2]
        has_inputs = self.has_shares or self.has_slopes
        lines = [
            "/* Strengths times [1, (x - reference) / spread], rule by rule; x lies in range. */",
            f"static void $name_regressor(const $real *{'c' if has_inputs else 'unused'}, "
            "$real *phi)",
            "{",
        ]
        lines += self.strength_arrays()
        names = [name for name in self.loop_variables(tangent=False) if name != "o"]
        if not numbers.terms:
            names.remove("i")
        lines.append(f"    $int {', '.join(names)};")
        if not has_inputs:
            lines.append("    (void)unused;")
        lines += ["", *self.strengths("l", "w", "")]

        def of_rule(strength, _):
            scaled = "(c[@] - $name_reference[@]) * $name_inverse_spread[@]"
            statement = f"phi[{n_basis} * r + 1 + j] = {strength} * ({scaled});"
            return [f"phi[{n_basis} * r] = {strength};", *self.slope_loop(statement)]

        lines += [*self.over_rules(of_rule, tangent=False), "}"]
        return self.write("\n".join(lines) + "\n")


def learning_test(model, source):
    """The test that the learner learns what matrices in full learn; ``model`` as it is held."""
    numbers, learner = source.numbers, source.learning
    low, width = numbers.low.astype(float), (numbers.high - numbers.low).astype(float)
    points = qmc.Halton(model.n_inputs, scramble=False).random(ROWS + 1)[1:]
    X = (low + width * points).astype(numbers.dtype)
    X = np.clip(X, numbers.low, numbers.high)
    Z = X.astype(float)
    own = numbers.slope_inputs
    basis = np.ones((ROWS, 1 + own.size))
    basis[:, 1:] = (Z[:, own] - numbers.reference[own]) * numbers.inverse_spread[own]
    design = (model.strengths(Z)[:, :, None] * basis[:, None, :]).reshape(ROWS, -1)
    y = model.with_out_of_bounds("clip").predict(Z)
    sizes = np.maximum(np.ptp(y, axis=0), 1e-3 * np.abs(y).max(axis=0))
    sizes = np.where(sizes > 0.0, sizes, 1.0)
    waves = np.cos(np.arange(1.0, ROWS + 1)[:, None] * (1.0 + np.arange(y.shape[1])))
    targets = (y + _SURPRISE * sizes * waves).astype(numbers.dtype)
    errors = targets.astype(float) - y
    learnt = y + design @ learner.follow(design, errors)
    scale = np.abs(y).max(axis=0)
    off = _TOLERANCE[numbers.dtype] * sizes + 16.0 * np.finfo(numbers.dtype).eps * scale
    dtype = numbers.dtype
    factor = " * $NAME_TEST_FACTOR" if source.dialect.real == "double" else ""
    return source.fill(
        _TEST.replace("$factor", factor),
        n_test=ROWS,
        x=literals(X),
        t=literals(targets),
        y=literals(learnt.astype(dtype)),
        off=literals(off.astype(dtype)),
    )
