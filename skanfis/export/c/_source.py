"""The .c file: constant tables, and the functions that read them.

The order of work is that of ``skanfis.model``: hold the inputs in the box, log memberships,
strengths by a softmax that subtracts the largest, consequents weighed by the strengths. The
continuation "linear" is worked out only for rows outside the box: it is the derivative along the
way back to the box, carried forward through the same loops. Coverage takes a quadratic form per
rule: the strongest rule is asked first, then the others, until there is enough.
"""

import re

from ...policies import SILENT
from ._cost import cost
from ._families import BODIES, HELPERS, words_of
from ._fragments import (
    CENTRE,
    FINITE_INPUT,
    HOLD,
    INPUTS,
    LIMIT,
    NEAR,
    NORMALISE,
    SATURATE,
    rejection,
)
from ._loops import RuleLoops
from ._text import index_type, literals, loop

__all__ = ["Source"]


class Source(RuleLoops):
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
        super().__init__(numbers, dialect)
        is_constant = not numbers.n_terms and not numbers.slope_inputs.size
        # The tangent of a constant is the constant; one of no length is its start.
        is_held = is_constant or (numbers.reach is not None and not numbers.reach.any())
        self.policy = "clip" if is_held and policy == "linear" else policy
        self.min_coverage, self.limits = min_coverage, limits
        self.linkage = "static " if is_part else ""

    @property
    def cost(self):
        """What it takes, as a CCost."""
        return cost(self)

    @property
    def is_linear(self):
        return self.policy == "linear"

    @property
    def measures_distance(self):
        """Whether rows outside the box get an answer, whose coverage falls with the distance."""
        return self.min_coverage is not None and self.policy not in SILENT

    @property
    def judges_coverage(self):
        """Whether rows can be uncovered."""
        return self.min_coverage is not None

    @property
    def has_limit(self):
        """Whether the tangent ends."""
        return self.is_linear and self.numbers.reach is not None

    def declarations(self):
        """What the header says besides."""
        return ""

    def text(self, include):
        """All of it; ``include`` is the name of the header."""
        return f'#include "{include}"\n\n#include <float.h>\n#include <math.h>\n\n{self.body()}'

    def body(self):
        """What follows the lines that include other files."""
        return "\n".join([self.macros() + "\n", self.tables(), *self.families(), self.functions()])

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
            parts.append(self.write(NORMALISE).lstrip())
            if self.is_linear:
                parts.append(self.write(CENTRE).lstrip())
        if self.judges_coverage:
            parts += [self.write(NEAR).lstrip(), self.coverage()]
        if self.is_linear:
            parts.append(self.tangent())
        parts.append(self.write(rejection(self.policy, self.dialect.std)).lstrip())
        parts.append(self.predict())
        return "\n".join(parts)

    # The main function.

    def predict(self):
        arguments = "".join(f"{argument}, " for argument in self.learner)
        lines = [
            f"{self.linkage}int $name_predict{self.suffix}({arguments}"
            "const $real x[$NAME_N_INPUTS], $real y[$NAME_N_OUTPUTS])",
            "{",
            *self.variables(),
            "",
            *self.hold_inputs(),
            *self.strengths("l", "w", ""),
            "",
            *self.measure_distance(),
            *loop("o", "$NAME_N_OUTPUTS", ["sum[o] = 0.0R;"]),
            *self.over_rules(self.add_rule, tangent=False),
            *self.go_on(),
            *self.judge_coverage(),
            *self.write_outputs(),
            "    return status;",
            "}",
        ]
        return self.write("\n".join(lines) + "\n")

    def variables(self):
        """The variables of the main function."""
        numbers = self.numbers
        lines = [
            "    /* Inputs in the box. */",
            f"    $real c[{numbers.n_inputs}], sum[{numbers.n_outputs}];",
        ]
        if self.has_slopes:
            lines.append(f"    $real z[{numbers.n_inputs}];")
        lines += self.strength_arrays()
        if self.is_linear:
            lines.append(f"    $real e[{numbers.n_inputs}];")
        if self.judges_coverage:
            lines.append(f"    $real u[{numbers.n_inputs}], top = 0.0R;")
            lines.append(f"    {self.int} best = 0;")
        if self.measures_distance:
            lines.append("    $real beside = 1.0R;")
        return [
            *lines,
            "    int status = $NAME_IN_RANGE;",
            f"    $int {', '.join(self.loop_variables(tangent=False))};",
        ]

    def hold_inputs(self):
        """The inputs, checked and held in the box; rows beyond it may be refused."""
        lines = [FINITE_INPUT.strip("\n"), INPUTS.strip("\n")]
        if self.has_slopes:
            lines.append("        z[i] = c[i] - $name_reference[i];")
        if self.judges_coverage:
            lines.append("        u[i] = (c[i] - $name_reference[i]) * $name_inverse_spread[i];")
        lines.append("    }")
        if self.policy in SILENT:
            lines += [
                "    if (status != $NAME_IN_RANGE) {",
                "        return $NAME_REJECT(y, status);",
                "    }",
            ]
        return lines

    def go_on(self):
        """Beyond the box, the way along the tangent."""
        if not self.is_linear:
            return []
        values = [*self.passes, *self.places, "e", *self.shares]
        return [
            "    if (status != $NAME_IN_RANGE) {",
            "        for (i = 0; i < $NAME_N_INPUTS; ++i) {",
            "            e[i] = x[i] - c[i];",
            *([LIMIT.strip("\n")] if self.has_limit else []),
            "        }",
            f"        $name_tangent{self.suffix}({', '.join([*values, 'sum'])});",
            "    }",
        ]

    def write_outputs(self):
        """The outputs, held within their limits; last, so that y may be x."""
        return [
            "    for (o = 0; o < $NAME_N_OUTPUTS; ++o) {",
            "        y[o] = $name_offset[o] + sum[o];",
            *([HOLD.strip("\n")] if self.numbers.output_low is not None else []),
            *([] if self.limits is None else [SATURATE.strip("\n")]),
            "    }",
        ]

    def add_rule(self, strength, change):
        lines = []
        if self.judges_coverage:
            lines += [f"if ({strength} > top) {{", f"    top = {strength};", "    best = r;", "}"]
        body = [
            f"$real f = {self.height};",
            *self.slope_loop(f"f += {self.slope} * z[@];"),
            f"sum[o] += {strength} * f;",
        ]
        return [*lines, *loop("o", "$NAME_N_OUTPUTS", body, "")]

    def measure_distance(self):
        if not self.measures_distance:
            return []
        distance = [
            "const $real d = (x[i] - c[i]) * $name_inverse_spread[i];",
            "distance += d * d;",
        ]
        return [
            "    if (status != $NAME_IN_RANGE) {",
            "        $real distance = 0.0R;",
            *loop("i", "$NAME_N_INPUTS", distance, 8 * " "),
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
        lines += loop("o", "$NAME_N_OUTPUTS", ["change[o] = 0.0R;"])
        lines += self.over_rules(self.add_rule_change, tangent=True)
        lines += loop("o", "$NAME_N_OUTPUTS", ["sum[o] += change[o];"])
        return self.write("\n".join([*lines, "}"]) + "\n")

    def add_rule_change(self, strength, change):
        along = f"f += {self.slope} * z[@];"
        ahead = f"change_of_f += {self.slope} * e[@];"
        body = [
            f"$real f = {self.height};",
            *(["$real change_of_f = 0.0R;"] if self.has_slopes else []),
            *self.slope_loop(along),
            *self.slope_loop(ahead),
            f"change[o] += {strength} * ({change} * f"
            + (" + change_of_f);" if self.has_slopes else ");"),
        ]
        return loop("o", "$NAME_N_OUTPUTS", body, "")
