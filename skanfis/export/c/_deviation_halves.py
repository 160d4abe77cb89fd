"""The halves of a row in C: u = F phi, and v = T (g t) - (B F) phi of every output.

In single precision a point a small step inside is not had: of a column a thousand of its
deviations from the origin floats lie as far apart as a hundredth of such a step. The step is given
beside the point, and goes to what is left of distances: of memberships from their locations, which
there are held in two parts, and of rows from the reference.
"""

import re

import numpy as np

from ...policies import SILENT
from ._deviation_code import MOVED, PREMISES, PRODUCTS
from ._source import Source
from ._text import loop

__all__ = ["HalvesSource"]

# What a membership is called with: a place of its input, and the term's constants.
_OF_TERM = re.compile(r"\(c\[(.+?\])\], \$name_terms(\d+)\[i\]")


class HalvesSource(Source):
    """A Source with the function that writes the halves of a row in the box."""

    def __init__(
        self, numbers, dialect, policy, min_coverage, found, *, is_part=False, limits=None
    ):
        super().__init__(numbers, dialect, policy, min_coverage, is_part=is_part, limits=limits)
        self.found, self.given_policy = found, policy

    @property
    def answers_beyond(self):
        """Whether rows out of the box have a deviation."""
        return self.given_policy not in SILENT

    @property
    def moves_terms(self):
        """Whether halves are of a row less a step."""
        return self.answers_beyond and self.numbers.dtype == np.float32

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

    def halves(self):
        """The function that writes u, then v of every output, of a row in the box."""
        found, numbers = self.found, self.numbers
        given = "const $real *c, const $real *e" if self.moves_terms else "const $real *c"
        row = "Of the row c - e" if self.moves_terms else "Of a row"
        lines = [
            f"/* {row} in the box, roots of what its variance is the sum of squares of. */",
            f"static void $name_halves({given}, $real *u)",
            "{",
            f"    $real phi[{found.n}];",
        ]
        lines += self.strength_arrays()
        if self.moves_terms and numbers.terms:
            lines.append(
                f"    $real p[{max(terms.constants.shape[1] for terms in numbers.terms)}];"
            )
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
            lines.append("    (void)c;" + self.moves_terms * "\n    (void)e;")
        lines += [self._moved(line) for line in self.strengths("l", "w", "")]
        if found.q:
            if self.has_slopes:
                lines += loop("i", numbers.n_inputs, [f"z[i] = {self._from_reference('i')};"])
            lines += loop("o", "$NAME_N_OUTPUTS", ["y[o] = 0.0R;"])
        lines += self.over_rules(self._of_rule, tangent=False)
        lines.append(PRODUCTS.strip("\n"))
        if found.q:
            lines += [self._moved(line) for line in self._by_parameters()]
            sums = "\n".join(f"    {line}" for line in self.over_rules(self._of_term, False))
            lines.append(PREMISES.replace("$sums", sums).strip("\n"))
        return self.write("\n".join([*lines, "}"]) + "\n", **self.words)

    def _of_rule(self, strength, _):
        n_basis = 1 + self.found.inputs.size
        lines = [f"phi[{n_basis} * r] = {strength};"]
        if self.found.inputs.size:
            at = "$name_deviation_input[m]"
            value = f"{strength} * ({self._from_reference(at)})"
            lines += loop(
                "m", self.found.inputs.size, [f"phi[{n_basis} * r + 1 + m] = {value};"], ""
            )
        if not self.found.q:
            return lines
        body = [
            f"$real value = {self.height};",
            *self.slope_loop(f"value += {self.slope} * z[@];"),
            f"h[o][r] = {strength} * value;",
            "y[o] += h[o][r];",
        ]
        return [*lines, *loop("o", "$NAME_N_OUTPUTS", body, "")]

    def _of_term(self, strength, _):
        numbers = self.numbers
        value = f"h[o][r] - {strength} * y[o]"
        if self.is_grid:
            starts = zip(numbers.block_starts, range(len(numbers.counts)), strict=True)
            return [f"t[{start} + i{k}] += {value};" for start, k in starts]
        at = "$name_rule_terms[r][k]"
        if numbers.rule_terms is None:
            at = f"r * {numbers.terms_per_rule} + k"
        return loop("k", numbers.terms_per_rule, [f"t[{at}] += {value};"], "")

    def _from_reference(self, at):
        distance = f"c[{at}] - $name_reference[{at}]"
        return f"({distance}) - e[{at}]" if self.moves_terms else distance

    def _moved(self, line):
        """A line in which memberships are those of terms that are moved."""
        if not self.moves_terms:
            return line
        return _OF_TERM.sub(r"(c[\1], $name_moved\2(i, e[\1], p)", line)

    def _by_parameters(self):
        """Derivatives of every term by its parameters, term by term."""
        lines, start = [], 0
        for k, terms in enumerate(self.numbers.terms):
            position = f"{terms.start} + i" if terms.start else "i"
            n_parameters = len(terms.family.parameters)
            call = f"$name_{terms.family.name}_by(c[$name_term_input[{position}]], "
            call += f"$name_terms{k}[i], g + {start} + {n_parameters} * i);"
            lines += loop("i", len(terms.constants), [call])
            start += n_parameters * len(terms.constants)
        return lines

    def moving(self, k, terms):
        """The function that moves terms of one table."""
        first, n_constants = terms.n_locations, terms.constants.shape[1]
        words = {"k": str(k), "n_constants": n_constants, "first": first, "last": 2 * first}
        return self.write(MOVED, **words).lstrip()
