r"""The standard deviation of a prediction in C, and the ends of an interval; see ``posterior``.

With phi the strengths times [1, x - reference], t_k the derivative of an output by the logarithm of
term k, g its derivatives by the term's parameters, and tables of F, T and B F,

    u = F phi ,    v = T (g t) - (B F) phi ,    variance = noise^2 (1 + |u|^2) + |v|^2 ,

all over the square of a power of two near the noise. Where the premises were not learnt there is no
v. Out of the box u and v are taken at two points a little inside, which give what they are at its
edge and their slopes along the way out, as in Python. In single precision the steps are longer,
because a difference has the fewer digits the shorter it is, and the points three, for parabolas;
points are given by their distances there (``_deviation_halves``).

The derivatives of a membership by its parameters follow from its derivative by x, which the
continuation "linear" needs too, and from the distances and constants of its family.
"""

import numpy as np

from ._cost import with_deviation
from ._deviation_code import (
    BEYOND,
    BY_DISTANCE,
    CHANGES_OF,
    DECLARATION,
    DECLARATION_OF_INTERVAL,
    GROWTH,
    INNER,
    INNER_WITHOUT,
    INTERVAL,
    KNOWN,
    KNOWN_OF_PREMISES,
    SUM,
    TO_POINT,
)
from ._deviation_halves import HalvesSource
from ._deviation_rounding import Differences
from ._deviation_tables import fitting
from ._families import words_of
from ._fragments import CENTRE, FINITE_INPUT, INPUTS
from ._source import Source
from ._text import literals, loop

__all__ = ["DeviationSource"]

# Weights of what is found at the steps inside.
_OF_SLOPE = {np.dtype(np.float64): (1.0, -1.0), np.dtype(np.float32): (2.5, -4.0, 1.5)}
_AT_EDGE = {np.dtype(np.float64): (2.0, -1.0), np.dtype(np.float32): (3.0, -3.0, 1.0)}


class DeviationSource(HalvesSource):
    """A Source with the function of the deviation, and of the interval where it has a reach."""

    def __init__(self, numbers, dialect, policy, *args, **kwargs):
        super().__init__(numbers, dialect, policy, *args, **kwargs)
        # The way out of the box along which the prediction's tangent is not followed.
        self._along = Source(numbers, dialect, policy, None)
        self._along.policy = "linear"

    @property
    def cost(self):
        return with_deviation(super().cost, self)

    @property
    def leaves_tangent(self):
        """Whether there is a tangent that is not followed all the way."""
        is_constant = not self.numbers.n_terms and not self.numbers.slope_inputs.size
        endless = self.given_policy == "linear" and self.numbers.reach is None
        return self.answers_beyond and not is_constant and not endless

    @property
    def differences(self):
        """How it goes out of the range."""
        dtype = self.numbers.dtype
        return Differences(
            self.found.step, _OF_SLOPE[dtype], _AT_EDGE[dtype], by_distance=self.moves_terms
        )

    @property
    def measure(self):
        """What the way out along input i is measured by, inverted."""
        if self.found.rulers is None:
            return "$name_inverse_spread[i]"
        return "$name_inverse_ruler[x[i] < c[i] ? 0 : 1][i]"

    def declarations(self):
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
        if self.answers_beyond and found.rulers is not None:
            tables["inverse_ruler"] = fitting(1.0 / found.rulers, numbers.dtype)
        elif self.answers_beyond and not self.judges_coverage:
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
        if self.moves_terms:
            parts += [self.moving(k, terms) for k, terms in enumerate(self.numbers.terms)]
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
        if self.moves_terms:
            lines += loop("i", "$NAME_N_INPUTS", ["e[i] = 0.0R;"])
            lines.append("    $name_halves(c, e, half);")
        else:
            lines.append("    $name_halves(c, half);")
        if self.answers_beyond:
            inside = (BY_DISTANCE if self.moves_terms else TO_POINT).strip("\n")
            beyond = BEYOND.replace("$inside", inside)
            beyond = beyond.replace("$measure", self.measure)
            lines.append(beyond.replace("$unfollowed", self.unfollowed()).strip("\n"))
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
            lines += loop("i", numbers.n_inputs, ["z[i] = c[i] - $name_reference[i];"])
        values = ", ".join([*self._along.places, "e", *self._along.shares, "sum"])
        return self.write("\n".join([*lines, f"    $name_tangent({values});", "}"]) + "\n")
