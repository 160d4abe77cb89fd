r"""The standard deviation of a prediction in C, and the ends of an interval; see ``posterior``.

With phi the strengths times [1, x - reference], t_k the derivative of an output by the logarithm of
term k, g its derivatives by the term's parameters, and tables of F, T and B F,

    u = F phi ,    v = T (g t) - (B F) phi ,    variance = noise^2 (1 + |u|^2) + |v|^2 ,

all over the square of a power of two near the noise. Where the premises were not learnt there is no
v. Out of the box u and v are taken at two points a little inside, which give what they are at its
edge and their slopes along the way out, as in Python. In single precision the steps are longer,
because a difference has the fewer digits the shorter it is, and the points three, for parabolas.

The derivatives of a membership by its parameters follow from its derivative by x, which the
continuation "linear" needs too, and from the distances and constants of its family.
"""

import numpy as np

from ._deviation_code import (
    BEYOND,
    CHANGES_OF,
    DECLARATION,
    DECLARATION_OF_INTERVAL,
    GROWTH,
    INNER,
    INNER_WITHOUT,
    INTERVAL,
    KNOWN,
    KNOWN_OF_PREMISES,
    PREMISES,
    PRODUCTS,
    SUM,
    TEST,
)
from ._deviation_tables import fitting
from ._families import words_of
from ._fragments import CENTRE, FINITE_INPUT, INPUTS
from ._source import Source
from ._text import literals

__all__ = ["DeviationSource", "deviation_test"]

# Weights of what is found at the steps inside.
_OF_SLOPE = {np.dtype(np.float64): (1.0, -1.0), np.dtype(np.float32): (2.5, -4.0, 1.5)}
_AT_EDGE = {np.dtype(np.float64): (2.0, -1.0), np.dtype(np.float32): (3.0, -3.0, 1.0)}
# As parts of a deviation: what rounding leaves of differences, or in range.
_TOLERANCE = {np.dtype(np.float64): 1e-9, np.dtype(np.float32): 2e-2}


class DeviationSource(Source):
    """A Source with the function of the deviation, and of the interval where it has a reach."""

    def __init__(
        self, numbers, dialect, policy, min_coverage, found, *, is_part=False, limits=None
    ):
        super().__init__(numbers, dialect, policy, min_coverage, is_part=is_part, limits=limits)
        self.found, self.given_policy = found, policy
        # The way out of the box along which the prediction's tangent is not followed.
        self._along = Source(numbers, dialect, policy, None)
        self._along.policy = "linear"

    @property
    def answers_beyond(self):
        """Whether rows out of the box have a deviation."""
        return self.given_policy in ("clip", "linear")

    @property
    def leaves_tangent(self):
        """Whether there is a tangent that is not followed all the way."""
        is_constant = not self.numbers.n_terms and not self.numbers.slope_inputs.size
        endless = self.given_policy == "linear" and self.numbers.reach is None
        return self.answers_beyond and not is_constant and not endless

    @property
    def size(self):
        """Values that the halves take."""
        return self.found.n + self.found.q * self.numbers.n_outputs

    @property
    def words(self):
        """Sizes that templates name."""
        found = self.found
        return {
            "n": found.n,
            "q": found.q,
            "all": self.size,
            "n_parameters": found.terms.size,
            "n_terms": self.n_logarithms,
        }

    def declarations(self):
        """What the header says of it."""
        text = self.write(DECLARATION)
        if self.found.reach is not None:
            text += self.write(DECLARATION_OF_INTERVAL, percent=f"{100 * self.found.coverage:g}")
        return text

    def deviation_tables(self):
        """Constants of the deviation, by name; in floating point."""
        found, numbers = self.found, self.numbers
        rows, columns = np.tril_indices(found.n)
        tables = {
            "noise": found.noise,
            "unit": found.unit,
            "inverse_unit": 1.0 / found.unit,
            "factor": found.factor[rows, columns],
        }
        if not (found.q or self.answers_beyond):
            del tables["inverse_unit"]
        if found.q:
            tables |= {"premises": found.premises, "cross": found.cross}
        if found.pinned.size:
            tables["pinned"] = found.pinned
        tables = {name: fitting(values, numbers.dtype) for name, values in tables.items()}
        if self.answers_beyond and not self.judges_coverage:
            tables["inverse_spread"] = numbers.inverse_spread
        if found.inputs.size and not (self.has_slopes or self.judges_coverage):
            tables["reference"] = numbers.reference
        return tables

    def index_tables(self):
        """Positions, by name."""
        found = self.found
        tables = {"deviation_input": found.inputs} if found.inputs.size else {}
        return tables | ({"deviation_term": found.terms} if found.q else {})

    @property
    def needs_slopes(self):
        """Whether slopes of memberships are asked for."""
        return bool(self.found.q) or self.leaves_tangent

    def families(self):
        if not self.needs_slopes:
            return super().families()
        parts = self._along.families()
        if not self.found.q:
            return parts
        for terms in {terms.family.name: terms for terms in self.numbers.terms}.values():
            label = terms.family.name
            head = f"/* Derivatives by the parameters: {label}. */\n"
            head += f"static void $name_{label}_by($real x, const $real *p, $real *g)\n"
            body = f"\n    const $real s = $name_{label}_slope(x, p);" + CHANGES_OF[terms.family]
            text = f"{head}{{{body}    g[0] = -s;\n}}\n"
            parts.append(self.write(text, **words_of(terms)))
        return parts

    def functions(self):
        parts = [super().functions()]
        if self.leaves_tangent and not self.is_linear:
            if self.has_shares:
                parts.append(self.write(CENTRE).lstrip())
            parts.append(self._along.tangent())
        if self.leaves_tangent:
            parts.append(self.leave())
        inner = self.write(self.inner(), n_pinned=self.found.pinned.shape[1], **self.words)
        parts += [self.halves(), inner.lstrip(), self.deviation()]
        if self.found.reach is not None:
            reach = fitting(self.found.reach, self.numbers.dtype)
            parts.append(self.write(INTERVAL, reach=literals(reach).strip()).lstrip())
        return "\n".join(parts)

    def inner(self):
        """The function of an inner product, less what is known of the output."""
        is_learnt = bool(self.found.q)
        known = KNOWN.strip("\n") + "\n" if self.found.pinned.size else ""
        known = known.replace("$of_premises", KNOWN_OF_PREMISES if is_learnt else "")
        return (INNER if is_learnt else INNER_WITHOUT).replace("$known", known)

    def tables(self):
        parts = [super().tables()]
        parts += [self.table(self.dialect.real, *item) for item in self.deviation_tables().items()]
        parts += [self.index_table(*item) for item in self.index_tables().items()]
        return "\n".join(parts)

    def halves(self):
        """The function that writes u, then v of every output, of a row in the box."""
        found, numbers = self.found, self.numbers
        lines = [
            "/* Of a row in the box, roots of what its variance is the sum of squares of. */",
            "static void $name_halves(const $real *c, $real *u)",
            "{",
            f"    $real phi[{found.n}];",
        ]
        lines += self.strength_arrays()
        if found.q:
            lines.append(f"    $real g[{found.terms.size}], change[{found.terms.size}];")
            lines.append(f"    $real t[{self.n_logarithms}], y[{numbers.n_outputs}];")
            lines.append(f"    $real h[{numbers.n_outputs}][{numbers.n_rules}];")
            lines.append("    $real *v = u + $n;")
            if self.has_slopes:
                lines.append(f"    $real z[{numbers.n_inputs}];")
        lines.append("    const $real *f;")
        lines.append("    long a, b;")
        names = [name for name in self.loop_variables(tangent=False) if name not in ("o", "i")]
        if numbers.terms or (found.q and self.has_slopes):
            names.append("i")
        if found.q:
            names.append("o")
        if found.inputs.size:
            names.append("m")
        if "j" in names and not found.q:
            names.remove("j")
        lines.append(f"    $int {', '.join(names)};")
        if not (self.has_shares or found.inputs.size):
            lines.append("    (void)c;")
        lines += self.strengths("l", "w", "")
        if found.q:
            if self.has_slopes:
                lines += [
                    f"    for (i = 0; i < {numbers.n_inputs}; ++i) {{",
                    "        z[i] = c[i] - $name_reference[i];",
                    "    }",
                ]
            lines += [
                "    for (o = 0; o < $NAME_N_OUTPUTS; ++o) {",
                "        y[o] = 0.0R;",
                "    }",
            ]
        lines += self.over_rules(self._of_rule, tangent=False)
        lines.append(PRODUCTS.strip("\n"))
        if found.q:
            lines += self._by_parameters()
            sums = "\n".join(f"    {line}" for line in self.over_rules(self._of_term, False))
            lines.append(PREMISES.replace("$sums", sums).strip("\n"))
        return self.write("\n".join([*lines, "}"]) + "\n", **self.words)

    def _of_rule(self, strength, _):
        n_basis = 1 + self.found.inputs.size
        lines = [f"phi[{n_basis} * r] = {strength};"]
        if self.found.inputs.size:
            at = "$name_deviation_input[m]"
            lines += [
                f"for (m = 0; m < {self.found.inputs.size}; ++m) {{",
                f"    phi[{n_basis} * r + 1 + m] = {strength} * (c[{at}] - $name_reference[{at}]);",
                "}",
            ]
        if not self.found.q:
            return lines
        return [
            *lines,
            "for (o = 0; o < $NAME_N_OUTPUTS; ++o) {",
            f"    $real value = {self.height};",
            *self.slope_loop(f"value += {self.slope} * z[@];", "    "),
            f"    h[o][r] = {strength} * value;",
            "    y[o] += h[o][r];",
            "}",
        ]

    def _of_term(self, strength, _):
        numbers = self.numbers
        value = f"h[o][r] - {strength} * y[o]"
        if self.is_grid:
            starts = zip(numbers.block_starts, range(len(numbers.counts)), strict=True)
            return [f"t[{start} + i{k}] += {value};" for start, k in starts]
        at = "$name_rule_terms[r][k]"
        if numbers.rule_terms is None:
            at = f"r * {numbers.terms_per_rule} + k"
        return [
            f"for (k = 0; k < {numbers.terms_per_rule}; ++k) {{",
            f"    t[{at}] += {value};",
            "}",
        ]

    def _by_parameters(self):
        """Derivatives of every term by its parameters, term by term."""
        lines, start = [], 0
        for k, terms in enumerate(self.numbers.terms):
            position = f"{terms.start} + i" if terms.start else "i"
            n_parameters = len(terms.family.parameters)
            call = f"$name_{terms.family.name}_by(c[$name_term_input[{position}]], "
            lines += [
                f"    for (i = 0; i < {len(terms.constants)}; ++i) {{",
                f"        {call}$name_terms{k}[i], g + {start} + {n_parameters} * i);",
                "    }",
            ]
            start += n_parameters * len(terms.constants)
        return lines

    def deviation(self):
        """The function that is called."""
        numbers = self.numbers
        lines = [
            f"{self.linkage}int $name_deviation("
            "const $real x[$NAME_N_INPUTS], $real deviation[$NAME_N_OUTPUTS])",
            "{",
            f"    $real c[{numbers.n_inputs}], half[{self.size}];",
        ]
        if self.answers_beyond:
            lines.append(f"    $real near[{self.size}], slope[{self.size}];")
            lines.append(f"    $real e[{numbers.n_inputs}], off[{numbers.n_outputs}];")
            lines.append("    long a;")
        lines += [
            "    int status = $NAME_IN_RANGE;",
            f"    int i, o{', k' if self.answers_beyond else ''};",
            "$finite",
            "    }",
        ]
        if not self.answers_beyond:
            lines += [
                "    if (status != $NAME_IN_RANGE) {",
                "        return $NAME_REJECT(deviation, status);",
                "    }",
            ]
        lines.append("    $name_halves(c, half);")
        if self.answers_beyond:
            lines.append(BEYOND.replace("$unfollowed", self.unfollowed()).strip("\n"))
        lines.append(SUM.replace("$growth", GROWTH if self.answers_beyond else "").strip("\n"))
        step = self.dialect.number(self.found.step)
        weights = {
            name: ", ".join(self.dialect.number(weight) for weight in own[numbers.dtype])
            for name, own in (("of_slope", _OF_SLOPE), ("at_edge", _AT_EDGE))
        }
        n_steps = len(_OF_SLOPE[numbers.dtype])
        check = FINITE_INPUT.replace("(y,", "(deviation,") + INPUTS
        text = "\n".join(lines).replace("$finite", check.strip("\n")) + "\n"
        return self.write(text, step=step, n_steps=n_steps, **weights, **self.words)

    def unfollowed(self):
        """What the prediction leaves out of the tangent, into ``off``."""
        if not self.leaves_tangent:
            return ""
        limit = ["            e[i] = x[i] - c[i];"]
        if self.given_policy == "linear":
            limit += [
                "            if (e[i] > $name_reach[i]) {",
                "                e[i] -= $name_reach[i];",
                "            } else if (e[i] < -$name_reach[i]) {",
                "                e[i] += $name_reach[i];",
                "            } else {",
                "                e[i] = 0.0R;",
                "            }",
            ]
            if not self.has_limit:
                # A reach of nothing, which is no table: the edge value is held.
                limit = limit[:1]
        return "\n".join(
            [
                "        for (i = 0; i < $NAME_N_INPUTS; ++i) {",
                *limit,
                "        }",
                "        $name_leave(c, e, off);",
            ]
        )

    def leave(self):
        """The function that follows the tangent at a row in the box along e."""
        numbers = self.numbers
        lines = [
            "/* Adds to every sum its derivative at c, in the box, by the inputs times e. */",
            "static void $name_leave(const $real *c, const $real *e, $real *sum)",
            "{",
        ]
        names = ["i"]
        lines += self.strength_arrays()
        if not self.is_grid:
            names += ["r", "k"]
        if self.has_slopes:
            lines.append(f"    $real z[{numbers.n_inputs}];")
        lines += [f"    $int {', '.join(names)};", *self.strengths("l", "w", "")]
        if self.has_slopes:
            lines += [
                f"    for (i = 0; i < {numbers.n_inputs}; ++i) {{",
                "        z[i] = c[i] - $name_reference[i];",
                "    }",
            ]
        values = ", ".join([*self._along.places, "e", *self._along.shares, "sum"])
        return self.write("\n".join([*lines, f"    $name_tangent({values});", "}"]) + "\n")


def deviation_test(model, dialect, X):
    """The test of the deviations at the rows of the self-test; ``model`` as it is held."""
    policy = "linear" if model.out_of_bounds == "linear" else "clip"
    wanted = model.with_out_of_bounds(policy).standard_deviation(X.astype(float))
    factor = " * $NAME_TEST_FACTOR" if dialect.real == "double" else ""
    return dialect.write(
        TEST.replace("$factor", factor),
        n_test=len(X),
        deviations=literals(wanted.astype(dialect.dtype)),
        tolerance=dialect.number(_TOLERANCE[dialect.dtype]),
    )
