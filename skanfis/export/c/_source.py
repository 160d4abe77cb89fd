"""The .c file: constant tables, and the functions that read them.

The order of work is that of ``skanfis.model``: hold the inputs in the box, log memberships,
strengths by a softmax that subtracts the largest, consequents weighed by the strengths. A grid
normalises each input alone and multiplies the shares in nested loops, so that it takes one
exponential per term, not per rule and input. The continuation "linear" is worked out only for rows
outside the box: it is the derivative along the way back to the box, carried forward through the
same loops. Coverage takes a quadratic form per rule: the strongest rule is asked first, then the
others, until there is enough.
"""

import re

import numpy as np

from ._families import BODIES, HELPERS
from ._text import literals

__all__ = ["CENTRE", "FINITE_INPUT", "INPUTS", "Source", "index_type", "rejection", "words_of"]

# C89 promises 15 levels of nested blocks; the function and the loop over outputs take three.
_MOST_LOOPS = 12

_NORMALISE = """
/* Turns n logarithms into shares that add up to one. */
static void $name_normalise($real *l, $int n)
{
    $int i;
    $real top = l[0], sum = 0.0R;
    for (i = 1; i < n; ++i) {
        if (l[i] > top) {
            top = l[i];
        }
    }
    for (i = 0; i < n; ++i) {
        l[i] = $EXP(l[i] - top);
        sum += l[i];
    }
    sum = 1.0R / sum;
    for (i = 0; i < n; ++i) {
        l[i] *= sum;
    }
}
"""

# Near the foot of the only term that speaks its derivative is huge, and all but the mean: what is
# left of it would have no digits.
CENTRE = """
/* Subtracts from n derivatives their mean by the n shares. */
static void $name_centre($real *s, const $real *share, $int n)
{
    $int i, top = 0;
    $real most, mean = 0.0R;
    for (i = 1; i < n; ++i) {
        if (share[i] > share[top]) {
            top = i;
        }
    }
    most = s[top];
    for (i = 0; i < n; ++i) {
        s[i] -= most;
        mean += share[i] * s[i];
    }
    for (i = 0; i < n; ++i) {
        s[i] -= mean;
    }
}
"""

_NEAR = """
/* Of a rule in coverage: its share, falling with the distance from where its data lie. */
static $real $name_near(const $real *u, const $real *p)
{
    const $real *centre = p + 2, *factor = p + 2 + $NAME_N_INPUTS;
    $real square = 0.0R, beyond;
    int i, k;
    for (i = 0; i < $NAME_N_INPUTS; ++i) {
        $real t = 0.0R;
        for (k = 0; k <= i; ++k) {
            t += *factor++ * (u[k] - centre[k]);
        }
        square += t * t;
    }
    if (square <= p[1] * p[1]) {
        return p[0];
    }
    beyond = $SQRT(square) - p[1];
    return p[0] * $EXP(-0.5R * beyond * beyond);
}
"""

_LIMIT = """
            if (e[i] > $name_reach[i]) {
                e[i] = $name_reach[i];
            } else if (e[i] < -$name_reach[i]) {
                e[i] = -$name_reach[i];
            }
"""

_HOLD = """
        if (y[o] < $name_output_low[o]) {
            y[o] = $name_output_low[o];
        } else if (y[o] > $name_output_high[o]) {
            y[o] = $name_output_high[o];
        }
"""

_REJECT_UNTOUCHED = """
/* No outputs: y stays as it is. */
#define $NAME_REJECT(y, status) ((status) | $NAME_NO_OUTPUT)
"""

_REJECT_NAN = """
/* No outputs: y becomes NaN where there is such a thing, else it stays as it is. */
static int $name_reject($real *y, int status)
{
#ifdef NAN
    int o;
    for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
        y[o] = ($real)NAN;
    }
#else
    (void)y;
#endif
    return status | $NAME_NO_OUTPUT;
}
#define $NAME_REJECT(y, status) $name_reject(y, status)
"""

FINITE_INPUT = """
    for (i = 0; i < $NAME_N_INPUTS; ++i) {
        /* Not (a and b): NaN fails every comparison. */
        if (!(x[i] >= -$MAX && x[i] <= $MAX)) {
            return $NAME_REJECT(y, $NAME_NOT_FINITE);
        }
"""

INPUTS = """
        c[i] = x[i];
        if (c[i] < $name_low[i]) {
            c[i] = $name_low[i];
            status = $NAME_OUT_OF_RANGE;
        } else if (c[i] > $name_high[i]) {
            c[i] = $name_high[i];
            status = $NAME_OUT_OF_RANGE;
        }
"""


_SATURATE = """
        /* Not (y < low): NaN, of a fault, fails every comparison. */
        if (!(y[o] >= $name_limits[o][0])) {
            y[o] = $name_limits[o][0];
        } else if (y[o] > $name_limits[o][1]) {
            y[o] = $name_limits[o][1];
        }
"""


def rejection(policy, std):
    """Template of the macro REJECT."""
    return _REJECT_NAN if policy == "nan" and std == "c99" else _REJECT_UNTOUCHED


def index_type(values):
    """The smallest unsigned type that holds these positions whatever the width of a char is."""
    largest = max(map(int, np.ravel(values)), default=0)
    limits = [(255, "unsigned char"), (65535, "unsigned short")]
    return next((kind for limit, kind in limits if largest <= limit), "unsigned long")


def words_of(terms):
    """What stands for the distances and constants of terms in their family's templates."""
    n, n_columns = terms.n_locations, terms.constants.shape[1]
    rest = [f" - p[{n + k}]" if terms.is_in_two else "" for k in range(n)]
    first = n * (1 + terms.is_in_two)
    distances = {f"d{k}": f"(x - p[{k}]{rest[k]})" for k in range(n)}
    return distances | {f"p{k - first}": f"p[{k}]" for k in range(first, n_columns)}


def _at(array, start):
    return f"{array} + {start}" if start else array


class Source:
    """The functions and tables of a .c file, without its self-test.

    ``policy`` is that of the model for rows outside the box, ``min_coverage`` the coverage below
    which a row is uncovered, or None; ``limits`` are those between which outputs are held, or None;
    ``is_part`` whether the main function is for others in the same file.
    """

    # What differs where consequents are learnt on the device: of the functions that read them the
    # name and first argument.
    suffix = ""
    learner: tuple[str, ...] = ()
    passes: tuple[str, ...] = ()

    def __init__(self, numbers, dialect, policy, min_coverage, *, is_part=False, limits=None):
        is_constant = not numbers.n_terms and not numbers.slope_inputs.size
        # The tangent of a constant is the constant; one of no length is its start.
        is_held = is_constant or (numbers.reach is not None and not numbers.reach.any())
        self.policy = "clip" if is_held and policy == "linear" else policy
        self.numbers, self.min_coverage, self.limits = numbers, min_coverage, limits
        self.dialect = dialect
        self.linkage = "static " if is_part else ""
        # int has 16 bits at least.
        self.int = "long" if max(numbers.n_rules, numbers.n_terms) > 32767 else "int"
        n_loops = len(numbers.counts or ())
        if dialect.std == "c89" and n_loops > _MOST_LOOPS:
            raise ValueError(
                f"std='c89' has {_MOST_LOOPS} loops in one another at most, and the grid has "
                f"terms on {n_loops} inputs. Export as 'c99', or put terms on fewer inputs."
            )

    def write(self, template, **words):
        return self.dialect.write(template, int=self.int, **words)

    @property
    def height(self):
        """A rule's value at the reference."""
        return "$name_consequents[r][o][0]"

    @property
    def slope(self):
        """A rule's slope j, on input @."""
        return "$name_consequents[r][o][1 + j]"

    @property
    def is_linear(self):
        return self.policy == "linear"

    @property
    def measures_distance(self):
        """Whether rows outside the box get an answer, whose coverage falls with the distance."""
        return self.min_coverage is not None and self.policy in ("clip", "linear")

    @property
    def judges_coverage(self):
        """Whether rows can be uncovered."""
        return self.min_coverage is not None

    @property
    def has_limit(self):
        """Whether the tangent ends."""
        return self.is_linear and self.numbers.reach is not None

    def text(self, include):
        """All of it; ``include`` is the name of the header."""
        return f'#include "{include}"\n\n#include <float.h>\n#include <math.h>\n\n{self.body()}'

    def body(self):
        """What follows the lines that include other files."""
        parts = [
            self.macros() + "\n",
            self.tables(),
            *self.families(),
            self.functions(),
        ]
        return "\n".join(parts)

    def macros(self):
        """EXP and LOG, where the functions below take them."""
        body = "".join([*self.families(), self.functions()])
        lines = self.dialect.functions().splitlines()
        return "\n".join(line for line in lines if f"{line.split()[1].split('(')[0]}(" in body)

    def table(self, kind, name, values):
        shape = "".join(f"[{n}]" for n in values.shape)
        return self.write(f"static const {kind} $name_{name}{shape} =\n{literals(values)};\n")

    def tables(self):
        numbers, real = self.numbers, self.dialect.real
        tables = [self.table(real, "low", numbers.low), self.table(real, "high", numbers.high)]
        if self.has_slopes or self.judges_coverage:
            tables.append(self.table(real, "reference", numbers.reference))
        if self.judges_coverage:
            tables.append(self.table(real, "inverse_spread", numbers.inverse_spread))
        if self.has_limit:
            tables.append("/* How far the tangent is followed. */")
            tables.append(self.table(real, "reach", numbers.reach))
        if numbers.output_low is not None:
            tables.append("/* What outputs are held within. */")
            tables.append(self.table(real, "output_low", numbers.output_low))
            tables.append(self.table(real, "output_high", numbers.output_high))
        for k, terms in enumerate(numbers.terms):
            tables.append(self.table(real, f"terms{k}", terms.constants))
        if numbers.n_terms:
            tables.append(self.index_table("term_input", numbers.term_inputs))
        if numbers.rule_terms is not None:
            tables.append(self.index_table("rule_terms", numbers.rule_terms))
        if self.selects_slopes:
            tables.append(self.index_table("slope_input", numbers.slope_inputs))
        if self.judges_coverage:
            tables.append("/* Of each rule: share, radius, centre, rows of the factor. */")
            tables.append(self.table(real, "support", numbers.support))
        if self.limits is not None:
            tables.append("/* Between which every output is held. */")
            tables.append(self.table(real, "limits", self.limits))
        tables.append(self.table(real, "offset", numbers.offset))
        tables.append("/* Of each rule and output: a value, then a slope per input. */")
        tables.append(self.table(real, "consequents", numbers.coefficients))
        return "\n".join(tables)

    def index_table(self, name, values):
        return self.table(index_type(values), name, values)

    @property
    def selects_slopes(self):
        """Whether only some of the inputs take part in the consequents."""
        return 0 < self.numbers.slope_inputs.size < self.numbers.n_inputs

    def families(self):
        """Functions of the families in use, after those that they call."""
        used = {terms.family.name: terms for terms in self.numbers.terms}
        functions = []
        for label, terms in used.items():
            bodies = {"": BODIES[terms.family].value}
            if self.is_linear:
                bodies["_slope"] = BODIES[terms.family].slope
            for suffix, body in bodies.items():
                what = "Derivative of the logarithm" if suffix else "Logarithm"
                head = f"/* {what} of a membership: {label}. */\n"
                head += f"static $real $name_{label}{suffix}($real x, const $real *p)\n"
                functions.append(self.write(f"{head}{{{body}}}\n", **words_of(terms)))
        calls = "".join(functions)
        helpers = [
            self.write(code).lstrip()
            for name, code in HELPERS.items()
            if re.search(rf"\b{self.dialect.name}_{name}\(", calls)
        ]
        return helpers + functions

    def functions(self):
        parts = []
        if self.has_shares:
            parts.append(self.write(_NORMALISE).lstrip())
            if self.is_linear:
                parts.append(self.write(CENTRE).lstrip())
        if self.judges_coverage:
            parts += [self.write(_NEAR).lstrip(), self.coverage()]
        if self.is_linear:
            parts.append(self.tangent())
        parts.append(self.write(rejection(self.policy, self.dialect.std)).lstrip())
        parts.append(self.predict())
        return "\n".join(parts)

    # The main function.

    def predict(self):
        numbers = self.numbers
        lines = [
            f"{self.linkage}int $name_predict{self.suffix}("
            + "".join(f"{argument}, " for argument in self.learner)
            + "const $real x[$NAME_N_INPUTS], $real y[$NAME_N_OUTPUTS])",
            "{",
            "    /* Inputs in the box. */",
            f"    $real c[{numbers.n_inputs}], sum[{numbers.n_outputs}];",
        ]
        if self.has_slopes:
            lines.append(f"    $real z[{numbers.n_inputs}];")
        if self.has_shares:
            lines.append(f"    $real l[{self.n_logarithms}];")
        if not self.is_grid:
            lines.append(f"    $real w[{numbers.n_rules}];")
        if self.is_linear:
            lines.append(f"    $real e[{numbers.n_inputs}];")
        if self.judges_coverage:
            lines.append(f"    $real u[{numbers.n_inputs}], top = 0.0R;")
            lines.append(f"    {self.int} best = 0;")
        if self.measures_distance:
            lines.append("    $real beside = 1.0R;")
        lines += [
            "    int status = $NAME_IN_RANGE;",
            f"    $int {', '.join(self.loop_variables(tangent=False))};",
            "",
            FINITE_INPUT.strip("\n"),
            INPUTS.strip("\n"),
        ]
        if self.has_slopes:
            lines.append("        z[i] = c[i] - $name_reference[i];")
        if self.judges_coverage:
            lines.append("        u[i] = (c[i] - $name_reference[i]) * $name_inverse_spread[i];")
        lines.append("    }")
        if self.policy in ("nan", "raise"):
            lines += [
                "    if (status != $NAME_IN_RANGE) {",
                "        return $NAME_REJECT(y, status);",
                "    }",
            ]
        lines += [*self.strengths("l", "w", ""), "", *self.measure_distance()]
        lines += [
            "    for (o = 0; o < $NAME_N_OUTPUTS; ++o) {",
            "        sum[o] = 0.0R;",
            "    }",
        ]
        lines += self.over_rules(self.add_rule, tangent=False)
        if self.is_linear:
            values = [*self.passes, *self.places, "e", *self.shares]
            lines += [
                "    if (status != $NAME_IN_RANGE) {",
                "        for (i = 0; i < $NAME_N_INPUTS; ++i) {",
                "            e[i] = x[i] - c[i];",
                *([_LIMIT.strip("\n")] if self.has_limit else []),
                "        }",
                f"        $name_tangent{self.suffix}({', '.join([*values, 'sum'])});",
                "    }",
            ]
        lines += self.judge_coverage()
        # Last, so that y may be x.
        lines += [
            "    for (o = 0; o < $NAME_N_OUTPUTS; ++o) {",
            "        y[o] = $name_offset[o] + sum[o];",
            *([_HOLD.strip("\n")] if numbers.output_low is not None else []),
            *([] if self.limits is None else [_SATURATE.strip("\n")]),
            "    }",
            "    return status;",
            "}",
        ]
        return self.write("\n".join(lines) + "\n")

    @property
    def is_grid(self):
        """Whether strengths are products of shares, or one."""
        return self.numbers.counts is not None

    @property
    def has_shares(self):
        """Whether there is anything to normalise."""
        return self.numbers.n_terms > 0 or not self.is_grid

    @property
    def places(self):
        """Names of where the row lies: what memberships take, what consequents take."""
        return ["c"] * self.has_shares + ["z"] * self.has_slopes

    @property
    def shares(self):
        """Names of what the strengths are made of."""
        if not self.has_shares:
            return []
        return ["l"] if self.is_grid else ["w"]

    @property
    def n_logarithms(self):
        """Logarithms that are kept: of terms, and the zero of "none"."""
        return self.numbers.n_terms + (self.numbers.rule_terms is not None)

    def loop_variables(self, tangent):
        n_loops = len(self.numbers.counts or ())
        names = ["r", "o", *(f"i{k}" for k in range(n_loops))]
        if not tangent or self.numbers.n_terms:
            names.insert(0, "i")
        if self.has_slopes:
            names.append("j")
        if self.numbers.terms and not self.is_grid:
            names.append("k")
        return names

    @property
    def has_slopes(self):
        return self.numbers.slope_inputs.size > 0

    def strengths(self, logarithms, rules, slope):
        """Terms, then shares (of a grid, in place) or strengths; or their derivatives."""
        numbers = self.numbers
        lines = []
        for k, terms in enumerate(numbers.terms):
            position = f"{terms.start} + i" if terms.start else "i"
            of_input = f"$name_term_input[{position}]"
            value = f"$name_{terms.family.name}{slope}(c[{of_input}], $name_terms{k}[i])"
            value += f" * e[{of_input}]" if slope else ""
            lines += [
                f"    for (i = 0; i < {len(terms.constants)}; ++i) {{",
                f"        {logarithms}[{position}] = {value};",
                "    }",
            ]
        if self.is_grid:
            for start, count in zip(numbers.block_starts, numbers.counts, strict=True):
                lines += self.finish(_at(logarithms, start), _at("l", start), count, slope)
            return lines
        if numbers.rule_terms is not None:
            lines.append(f"    {logarithms}[{numbers.n_terms}] = 0.0R;")
            term = "$name_rule_terms[r][k]"
        else:
            term = f"r * {numbers.terms_per_rule} + k"
        lines += [
            f"    for (r = 0; r < {numbers.n_rules}; ++r) {{",
            f"        {rules}[r] = 0.0R;",
            f"        for (k = 0; k < {numbers.terms_per_rule}; ++k) {{",
            f"            {rules}[r] += {logarithms}[{term}];",
            "        }",
            "    }",
        ]
        return lines + self.finish(rules, "w", numbers.n_rules, slope)

    def finish(self, values, shares, count, slope):
        if slope:
            return [f"    $name_centre({values}, {shares}, {count});"]
        return [f"    $name_normalise({values}, {count});"]

    def over_rules(self, body, tangent):
        """A loop over all rules around ``body(strength, change)``, in C order for a grid."""
        numbers = self.numbers
        if not self.is_grid:
            change = "s[r]" if tangent else ""
            inner = [f"        {line}" for line in body("w[r]", change)]
            return [f"    for (r = 0; r < {numbers.n_rules}; ++r) {{", *inner, "    }"]
        if not numbers.counts:
            change = "0.0R" if tangent else ""
            return ["    r = 0;", *(f"    {line}" for line in body("1.0R", change))]
        lines, depth = ["    r = 0;"], 4
        for k, (start, count) in enumerate(zip(numbers.block_starts, numbers.counts, strict=True)):
            pad = " " * depth
            place = f"{start} + i{k}" if start else f"i{k}"
            product = f"w{k - 1} * l[{place}]" if k else f"l[{place}]"
            lines.append(f"{pad}for (i{k} = 0; i{k} < {count}; ++i{k}) {{")
            lines.append(f"{pad}    const $real w{k} = {product};")
            if tangent:
                total = f"s{k - 1} + s[{place}]" if k else f"s[{place}]"
                lines.append(f"{pad}    const $real s{k} = {total};")
            depth += 4
        last = len(numbers.counts) - 1
        lines += [" " * depth + line for line in body(f"w{last}", f"s{last}" if tangent else "")]
        lines.append(" " * depth + "++r;")
        for _ in numbers.counts:
            depth -= 4
            lines.append(" " * depth + "}")
        return lines

    def slope_loop(self, statement, pad):
        """``statement`` for every slope j of a consequent, on input @."""
        if not self.has_slopes:
            return []
        at = "$name_slope_input[j]" if self.selects_slopes else "j"
        return [
            f"{pad}for (j = 0; j < {self.numbers.slope_inputs.size}; ++j) {{",
            f"{pad}    {statement.replace('@', at)}",
            f"{pad}}}",
        ]

    def add_rule(self, strength, change):
        lines = []
        if self.judges_coverage:
            lines += [f"if ({strength} > top) {{", f"    top = {strength};", "    best = r;", "}"]
        return [
            *lines,
            "for (o = 0; o < $NAME_N_OUTPUTS; ++o) {",
            f"    $real f = {self.height};",
            *self.slope_loop(f"f += {self.slope} * z[@];", "    "),
            f"    sum[o] += {strength} * f;",
            "}",
        ]

    def measure_distance(self):
        if not self.measures_distance:
            return []
        return [
            "    if (status != $NAME_IN_RANGE) {",
            "        $real distance = 0.0R;",
            "        for (i = 0; i < $NAME_N_INPUTS; ++i) {",
            "            const $real d = (x[i] - c[i]) * $name_inverse_spread[i];",
            "            distance += d * d;",
            "        }",
            "        beside = $EXP(-0.5R * distance);",
            "    }",
        ]

    def judge_coverage(self):
        if not self.judges_coverage:
            return []
        beside = "beside * " if self.measures_distance else ""
        values = ["u", *self.shares, *(["beside"] if self.measures_distance else [])]
        return [
            f"    if ({beside}top * $name_near(u, $name_support[best]) < {self.enough}",
            f"        && $name_coverage({', '.join(values)}) < {self.enough}) {{",
            "        status |= $NAME_UNCOVERED;",
            "    }",
        ]

    @property
    def enough(self):
        """The coverage asked for, as a constant."""
        return self.dialect.number(self.min_coverage)

    def coverage(self):
        """The sum over the rules that have data, as far as it takes to be enough."""
        n_loops = len(self.numbers.counts or ())
        arguments = [f"const $real *{name}" for name in ("u", *self.shares)]
        arguments += ["$real beside"] if self.measures_distance else []
        lines = [
            "/* The coverage, or a part of it that is enough. */",
            f"static $real $name_coverage({', '.join(arguments)})",
            "{",
            "    $real covered = 0.0R;",
            f"    $int {', '.join(['r', *(f'i{k}' for k in range(n_loops))])};",
            "",
            *self.over_rules(self.add_support, tangent=False),
            "    return covered;",
            "}",
        ]
        return self.write("\n".join(lines) + "\n")

    def add_support(self, strength, _):
        beside = "beside * " if self.measures_distance else ""
        return [
            f"if (covered < {self.enough} && $name_support[r][0] > 0.0R) {{",
            f"    covered += {beside}{strength} * $name_near(u, $name_support[r]);",
            "}",
        ]

    # The continuation of "linear".

    def tangent(self):
        """Add to ``sum`` its derivative along e, the way from the box to the input."""
        numbers = self.numbers
        values = [f"const $real *{name}" for name in (*self.places, "e", *self.shares)]
        arguments = [*self.learner, *values]
        lines = [
            "/* Adds to every sum its derivative by the inputs times e, the way out of the box. */",
            f"static void $name_tangent{self.suffix}({', '.join(arguments)},",
            "    $real *sum)",
            "{",
        ]
        # Of a grid: change of the logarithm of each share; else of terms, and of each strength.
        if self.is_grid and numbers.n_terms:
            lines.append(f"    $real s[{numbers.n_terms}];")
        if not self.is_grid:
            lines.append(f"    $real t[{self.n_logarithms}], s[{numbers.n_rules}];")
        lines.append(f"    $real change[{numbers.n_outputs}];")
        lines.append(f"    $int {', '.join(self.loop_variables(tangent=True))};")
        names = ("s", "") if self.is_grid else ("t", "s")
        lines += ["", *self.strengths(*names, "_slope")]
        lines += [
            "    for (o = 0; o < $NAME_N_OUTPUTS; ++o) {",
            "        change[o] = 0.0R;",
            "    }",
        ]
        lines += self.over_rules(self.add_rule_change, tangent=True)
        lines += [
            "    for (o = 0; o < $NAME_N_OUTPUTS; ++o) {",
            "        sum[o] += change[o];",
            "    }",
            "}",
        ]
        return self.write("\n".join(lines) + "\n")

    def add_rule_change(self, strength, change):
        along = f"f += {self.slope} * z[@];"
        ahead = f"change_of_f += {self.slope} * e[@];"
        return [
            "for (o = 0; o < $NAME_N_OUTPUTS; ++o) {",
            f"    $real f = {self.height};",
            *(["    $real change_of_f = 0.0R;"] if self.has_slopes else []),
            *self.slope_loop(along, "    "),
            *self.slope_loop(ahead, "    "),
            f"    change[o] += {strength} * ({change} * f"
            + (" + change_of_f);" if self.has_slopes else ");"),
            "}",
        ]
