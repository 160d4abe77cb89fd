"""The .c file: constant tables, and the functions that read them.

The order of work is that of ``skanfis.model``: hold the inputs in the box, log memberships,
strengths by a softmax that subtracts the largest, consequents weighed by the strengths. A grid
normalises each input by itself and multiplies the shares in nested loops, so that it takes one
exponential per term, not per rule and input. The continuation "linear" is worked out only for rows
outside the box: the derivative along the way back to the box, carried forward through the same
loops. Coverage takes a quadratic form per rule: the strongest rule is asked first, then the others,
until there is enough.

In the templates the words before a "|" say when a line is there: see ``Source.facts``.
"""

import re

from ...policies import SILENT
from ._cost import cost_of
from ._dialect import index_type, kept_lines
from ._families import BODIES, HELPERS

__all__ = ["FINITE_INPUT", "Source", "rejection"]

# C89 promises 15 levels of nested blocks; the function and the loop over outputs take three.
_MOST_LOOPS = 12

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
# The head of a loop over the inputs.
FINITE_INPUT = """
    for (i = 0; i < $NAME_N_INPUTS; ++i) {
        /* Not (a and b): NaN fails every comparison. */
        if (!(x[i] >= -$MAX && x[i] <= $MAX)) {
            return $NAME_REJECT(y, $NAME_NOT_FINITE);
        }
"""

# Near the foot of the only term that speaks its derivative is huge, and all but the mean: what is
# left of it would have no digits; so the strongest term's is subtracted first.
_HELPERS = """
shares        |/* Turns n logarithms into shares that add up to one. */
shares        |static void $name_normalise($real *l, $int n)
shares        |{
shares        |    $int i;
shares        |    $real top = l[0], sum = 0.0R;
shares        |    for (i = 1; i < n; ++i) {
shares        |        if (l[i] > top) {
shares        |            top = l[i];
shares        |        }
shares        |    }
shares        |    for (i = 0; i < n; ++i) {
shares        |        l[i] = $EXP(l[i] - top);
shares        |        sum += l[i];
shares        |    }
shares        |    sum = 1.0R / sum;
shares        |    for (i = 0; i < n; ++i) {
shares        |        l[i] *= sum;
shares        |    }
shares        |}
shares        |
linear shares |/* Subtracts from n derivatives their mean by the n shares. */
linear shares |static void $name_centre($real *s, const $real *share, $int n)
linear shares |{
linear shares |    $int i, top = 0;
linear shares |    $real most, mean = 0.0R;
linear shares |    for (i = 1; i < n; ++i) {
linear shares |        if (share[i] > share[top]) {
linear shares |            top = i;
linear shares |        }
linear shares |    }
linear shares |    most = s[top];
linear shares |    for (i = 0; i < n; ++i) {
linear shares |        s[i] -= most;
linear shares |        mean += share[i] * s[i];
linear shares |    }
linear shares |    for (i = 0; i < n; ++i) {
linear shares |        s[i] -= mean;
linear shares |    }
linear shares |}
linear shares |
covers        |/* Of a rule in coverage: its share, falling with the distance from its data. */
covers        |static $real $name_near(const $real *z, const $real *p)
covers        |{
covers        |    const $real *centre = p + 2, *factor = p + 2 + $NAME_N_INPUTS;
covers        |    $real square = 0.0R, beyond;
covers        |    int i, k;
covers        |    for (i = 0; i < $NAME_N_INPUTS; ++i) {
covers        |        $real t = 0.0R;
covers        |        for (k = 0; k <= i; ++k) {
covers        |            t += *factor++ * (z[k] - centre[k]);
covers        |        }
covers        |        square += t * t;
covers        |    }
covers        |    if (square <= p[1] * p[1]) {
covers        |        return p[0];
covers        |    }
covers        |    beyond = $SQRT(square) - p[1];
covers        |    return p[0] * $EXP(-0.5R * beyond * beyond);
covers        |}
covers        |
covers        |/* The coverage in the box, or a part of it that is enough. */
covers        |static $real $name_coverage($given, $real enough)
covers        |{
covers        |    $real covered = 0.0R;
covers        |    $int $coverage_indices;
covers        |
covers        |$add_support
covers        |    return covered;
covers        |}
covers        |
linear        |/* The derivative of every sum along e. */
linear        |static void $name_tangent($given, const $real *e, $real *change)
linear        |{
linear shares |    $real $tangent_arrays;
linear        |    $int $tangent_indices;
linear        |
linear shares |$strengths_slope
linear        |    for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
linear        |        change[o] = 0.0R;
linear        |    }
linear        |$add_changes
linear        |}
linear        |
"""
_ADD_SUPPORT = """
 |if (covered < enough && $name_support[r][0] > 0.0R) {
 |    covered += $w * $name_near(z, $name_support[r]);
 |}
"""
_ADD_RULE = """
covers |if ($w > top) {
covers |    top = $w;
covers |    best = r;
covers |}
       |for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
       |    $real f = $name_consequents[r][o][0];
slopes |    for (j = 0; j < $n_slopes; ++j) {
slopes |        f += $name_consequents[r][o][1 + j] * z[$input];
slopes |    }
       |    sum[o] += $w * f;
       |}
"""
_ADD_CHANGE = """
       |for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
       |    $real f = $name_consequents[r][o][0], ahead = 0.0R;
slopes |    for (j = 0; j < $n_slopes; ++j) {
slopes |        f += $name_consequents[r][o][1 + j] * z[$input];
slopes |        ahead += $name_consequents[r][o][1 + j] * e[$input];
slopes |    }
       |    change[o] += $w * ($s * f + ahead);
       |}
"""
_PREDICT = """
             |$linkageint $name_predict(const $real x[$NAME_N_INPUTS], $real y[$NAME_N_OUTPUTS])
             |{
             |    /* z: the input, held in the box, about the reference. */
             |    $real $arrays;
covers       |    $real top = 0.0R, enough = $limit;
covers       |    $int best = 0;
             |    int status = $NAME_IN_RANGE;
             |    $int $indices;
             |
             |$finite_input
             |        z[i] = x[i];
             |        if (z[i] < $name_low[i]) {
             |            z[i] = $name_low[i];
             |            status = $NAME_OUT_OF_RANGE;
             |        } else if (z[i] > $name_high[i]) {
             |            z[i] = $name_high[i];
             |            status = $NAME_OUT_OF_RANGE;
             |        }
beyond       |        e[i] = x[i] - z[i];
             |        z[i] -= $name_reference[i];
             |    }
silent       |    if (status != $NAME_IN_RANGE) {
silent       |        return $NAME_REJECT(y, status);
silent       |    }
shares       |$strengths_inside
             |
             |    for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
             |        sum[o] = 0.0R;
             |    }
             |$add_rules
beyond       |    if (status != $NAME_IN_RANGE) {
fades        |        $real distance = 0.0R;
linear       |        $real scale = 1.0R;
beyond       |        for (i = 0; i < $NAME_N_INPUTS; ++i) {
fades        |            const $real d = e[i] * $name_inverse_spread[i];
fades        |            distance += d * d;
linear       |            if (e[i] > $name_reach[i]) {
linear       |                e[i] = $name_reach[i];
linear       |            } else if (e[i] < -$name_reach[i]) {
linear       |                e[i] = -$name_reach[i];
linear       |            }
linear       |            scale += (e[i] < 0.0R ? -e[i] : e[i]) * $name_inverse_spread[i];
beyond       |        }
fades        |        /* The coverage falls with the distance: more of it is asked for. */
fades        |        enough = $limit * $EXP(0.5R * distance);
linear       |        /* First along a part of the way, since products could overflow. */
linear       |        for (i = 0; i < $NAME_N_INPUTS; ++i) {
linear       |            e[i] /= scale;
linear       |        }
linear       |        $name_tangent($taken, e, change);
linear       |        for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
linear       |            sum[o] += scale * change[o];
linear       |        }
beyond       |    }
covers       |    if (top * $name_near(z, $name_support[best]) < enough
covers       |        && $name_coverage($taken, enough) < enough) {
covers       |        status |= $NAME_UNCOVERED;
covers       |    }
             |    /* Last, so that y may be x. */
             |    for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
             |        y[o] = $name_offset[o] + sum[o];
held         |        if (y[o] < $name_output_low[o]) {
held         |            y[o] = $name_output_low[o];
held         |        } else if (y[o] > $name_output_high[o]) {
held         |            y[o] = $name_output_high[o];
held         |        }
saturates    |        /* Not (y < low): NaN, of a fault, fails every comparison. */
saturates    |        if (!(y[o] >= $name_limits[o][0])) {
saturates    |            y[o] = $name_limits[o][0];
saturates    |        } else if (y[o] > $name_limits[o][1]) {
saturates    |            y[o] = $name_limits[o][1];
saturates    |        }
             |    }
             |    return status;
             |}
"""


class Source:
    """The functions and tables of a .c file, without its self-test.

    ``policy`` is that of the model for rows outside the box, ``min_coverage`` the coverage below
    which a row is uncovered, or None; ``limits`` are those between which outputs are held, or None;
    ``is_part`` whether the main function is for others in the same file.
    """

    def __init__(self, numbers, dialect, policy, min_coverage, limits=None, is_part=False):
        self.numbers, self.dialect, self.policy = numbers, dialect, policy
        self.min_coverage, self.limits, self.is_part = min_coverage, limits, is_part
        n_loops = len(numbers.counts or ())
        if dialect.std == "c89" and n_loops > _MOST_LOOPS:
            raise ValueError(
                f"std='c89' has {_MOST_LOOPS} loops in one another at most, and the grid has "
                f"terms on {n_loops} inputs. Export as 'c99', or put terms on fewer inputs."
            )
        self.is_grid, self.n_slopes = numbers.counts is not None, numbers.slope_inputs.size
        # Logarithms of terms, and the zero of "none".
        self.n_logarithms = numbers.n_terms + int((numbers.rule_terms == numbers.n_terms).any())
        self.facts = self._facts()

    def _facts(self):
        """What decides which lines there are."""
        numbers = self.numbers
        covers, answers = self.min_coverage is not None, self.policy not in SILENT
        # The tangent of a constant is the constant; one of no length is its start.
        is_constant = not numbers.n_terms and not self.n_slopes
        linear = self.policy == "linear" and not is_constant and bool(numbers.reach.any())
        facts = {
            "shares": numbers.n_terms > 0 or not self.is_grid,
            "slopes": self.n_slopes > 0,
            "covers": covers,
            # Rows outside the box get no answer; are less covered; are followed along the tangent.
            "silent": not answers,
            "fades": covers and answers,
            "linear": linear,
            "beyond": linear or (covers and answers),
            "held": numbers.output_limits is not None,
            "saturates": self.limits is not None,
        }
        return {fact for fact, holds in facts.items() if holds}

    @property
    def cost(self):
        """What it takes, as a CCost."""
        return cost_of(self)

    def text(self, include):
        """All of it; ``include`` is the name of the header."""
        return f'#include "{include}"\n\n#include <float.h>\n#include <math.h>\n\n{self.body()}'

    def body(self):
        """What follows the lines that include other files."""
        dialect = self.dialect
        tables = [dialect.table(name, *table) for name, table in self.tables().items()]
        functions = dialect.write("".join([self._helpers(), self._predict()]), int=self._int)
        return "\n".join([dialect.functions() + "\n", *tables, *self._memberships(), functions])

    def tables(self):
        """Constant tables by their names: an array, and the type where it is one of positions."""
        numbers, facts = self.numbers, self.facts
        reals = {"low": numbers.low, "high": numbers.high, "reference": numbers.reference}
        if "beyond" in facts:
            reals["inverse_spread"] = numbers.inverse_spread
        if "linear" in facts:
            reals["reach"] = numbers.reach
        if "held" in facts:
            reals["output_low"], reals["output_high"] = numbers.output_limits
        for k, terms in enumerate(numbers.terms):
            reals[f"terms{k}"] = terms.constants
        if "covers" in facts:
            reals["support"] = numbers.support
        if "saturates" in facts:
            reals["limits"] = self.limits
        reals |= {"offset": numbers.offset, "consequents": numbers.coefficients}
        positions = {}
        if numbers.n_terms:
            positions["term_input"] = numbers.term_inputs
        if not self.is_grid:
            positions["rule_terms"] = numbers.rule_terms
        if 0 < self.n_slopes < numbers.n_inputs:
            positions["slope_input"] = numbers.slope_inputs
        found = {name: (values, None) for name, values in reals.items()}
        return found | {name: (values, index_type(values)) for name, values in positions.items()}

    def arrays(self):
        """Arrays on the stack and their lengths: of the main function, and of the tangent."""
        numbers = self.numbers
        main, tangent = {"z": numbers.n_inputs, "sum": numbers.n_outputs}, {}
        if "beyond" in self.facts:
            main["e"] = numbers.n_inputs
        if "linear" in self.facts:
            main["change"] = numbers.n_outputs
        if "shares" in self.facts:
            main["l"] = tangent["t"] = self.n_logarithms
        if not self.is_grid:
            main["w"] = tangent["s"] = numbers.n_rules
        return main, tangent

    def _memberships(self):
        """Functions of the families in use, after those that they call."""
        functions = []
        for family in {terms.family: None for terms in self.numbers.terms}:
            bodies = {"": BODIES[family].value}
            if "linear" in self.facts:
                bodies["_slope"] = BODIES[family].slope
            for suffix, body in bodies.items():
                what = "Derivative of the logarithm" if suffix else "Logarithm"
                head = f"/* {what} of a membership: {family.name}. */\n"
                head += f"static $real $name_{family.name}{suffix}($real x, const $real *p)\n"
                functions.append(self.dialect.write(f"{head}{{{body}}}\n"))
        calls = "".join(functions)
        helpers = [
            self.dialect.write(code).lstrip()
            for name, code in HELPERS.items()
            if re.search(rf"\b{self.dialect.name}_{name}\(", calls)
        ]
        return helpers + functions

    # The functions as templates, of which the parts are filled in.

    @property
    def _int(self):
        # int has 16 bits at least.
        return "long" if max(self.numbers.n_rules, self.numbers.n_terms) > 32767 else "int"

    @property
    def _taken(self):
        """What the place of a row is told by: z, and what the strengths are made of."""
        return ["z", "l" if self.is_grid else "w"] if "shares" in self.facts else ["z"]

    @property
    def _loops(self):
        return [f"i{k}" for k in range(len(self.numbers.counts or ()))]

    @property
    def _indices(self):
        """Of loops over rules and what they are made of."""
        return ["r", "o", *["j"] * (self.n_slopes > 0), *["k"] * (not self.is_grid), *self._loops]

    def _helpers(self):
        return self._filled(
            _HELPERS,
            given=", ".join(f"const $real *{name}" for name in self._taken),
            coverage_indices=", ".join(["r", *self._loops]),
            tangent_indices=", ".join(["i"] * (self.numbers.n_terms > 0) + self._indices),
            tangent_arrays=_declared(self.arrays()[1]),
            strengths_slope=self._strengths("t", "s", "_slope"),
            add_support=self._over_rules(_ADD_SUPPORT),
            add_changes=self._over_rules(_ADD_CHANGE),
        )

    def _predict(self):
        head = rejection(self.policy, self.dialect.std).lstrip() + "\n"
        return head + self._filled(
            _PREDICT,
            linkage="static " if self.is_part else "",
            finite_input=FINITE_INPUT.strip("\n"),
            taken=", ".join(self._taken),
            arrays=_declared(self.arrays()[0]),
            indices=", ".join(["i", *self._indices]),
            limit=self.dialect.number(self.min_coverage or 0.0),
            strengths_inside=self._strengths("l", "w", ""),
            add_rules=self._over_rules(_ADD_RULE),
        )

    def _filled(self, template, **parts):
        text = kept_lines(template, self.facts) + "\n"
        for word, part in parts.items():
            text = text.replace(f"${word}", part)
        return text

    def _strengths(self, logarithms, rules, slope):
        """Terms, then shares (of a grid, in place) or strengths; or their derivatives along e."""
        numbers, lines = self.numbers, []
        for k, terms in enumerate(numbers.terms):
            at = _at(terms.start, "i")
            value = (
                f"$name_{terms.family.name}{slope}(z[$name_term_input[{at}]], $name_terms{k}[i])"
            )
            value += f" * e[$name_term_input[{at}]]" if slope else ""
            lines += _loop("i", len(terms.constants), [f"{logarithms}[{at}] = {value};"])
        finish = "$name_centre({0}, {1}, {2});" if slope else "$name_normalise({0}, {2});"
        if self.is_grid:
            for start, count in zip(numbers.block_starts, numbers.counts, strict=True):
                of_input = (
                    (f"{logarithms} + {start}", f"l + {start}") if start else (logarithms, "l")
                )
                lines.append(finish.format(*of_input, count))
        else:
            if self.n_logarithms > numbers.n_terms:
                lines.append(f"{logarithms}[{numbers.n_terms}] = 0.0R;")
            total = [f"{rules}[r] += {logarithms}[$name_rule_terms[r][k]];"]
            total = _loop("k", numbers.rule_terms.shape[1], total)
            lines += _loop("r", numbers.n_rules, [f"{rules}[r] = 0.0R;", *total])
            lines.append(finish.format(rules, "w", numbers.n_rules))
        return _indented(lines)

    def _over_rules(self, template):
        """What a template does with every rule r, its strength $w and its change $s."""
        numbers = self.numbers
        body = kept_lines(template, self.facts)
        body = body.replace("$n_slopes", str(self.n_slopes))
        selects = 0 < self.n_slopes < numbers.n_inputs
        body = body.replace("$input", "$name_slope_input[j]" if selects else "j")
        if not self.is_grid:
            body = body.replace("$w", "w[r]").replace("$s", "s[r]")
            return _indented(_loop("r", numbers.n_rules, body.splitlines()))
        if not numbers.counts:
            body = body.replace("$w", "1.0R").replace("$s", "0.0R")
            return _indented(["r = 0;", *body.splitlines()])
        last = len(numbers.counts) - 1
        lines = body.replace("$w", f"w{last}").replace("$s", f"s{last}").splitlines()
        lines.append("++r;")
        for k in reversed(range(last + 1)):
            at = _at(numbers.block_starts[k], f"i{k}")
            declared = [f"const $real w{k} = {f'w{k - 1} * ' if k else ''}l[{at}];"]
            if "$s" in template:
                declared.append(f"const $real s{k} = {f's{k - 1} + ' if k else ''}t[{at}];")
            lines = _loop(f"i{k}", numbers.counts[k], declared + lines)
        return _indented(["r = 0;", *lines])


def rejection(policy, std):
    """Template of the macro REJECT."""
    return _REJECT_NAN if policy == "nan" and std == "c99" else _REJECT_UNTOUCHED


def _at(start, index):
    return f"{start} + {index}" if start else index


def _declared(arrays):
    return ", ".join(f"{name}[{length}]" for name, length in arrays.items())


def _indented(lines):
    return "\n".join(f"    {line}" for line in lines)


def _loop(index, count, body):
    head = f"for ({index} = 0; {index} < {count}; ++{index}) {{"
    return [head, *(f"    {line}" for line in body), "}"]
