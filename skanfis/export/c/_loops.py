"""Strengths of rules in C, and loops over the rules.

A grid normalises each input alone and multiplies the shares in nested loops, so that it takes one
exponential per term, not per rule and input.
"""

from ._text import loop

__all__ = ["RuleLoops"]

# C89 promises 15 levels of nested blocks; the function and the loop over outputs take three.
_MOST_LOOPS = 12


class RuleLoops:
    """What goes through the rules of a model, ``numbers``, in the words of a ``dialect``."""

    def __init__(self, numbers, dialect):
        self.numbers, self.dialect = numbers, dialect
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
    def is_grid(self):
        """Whether strengths are products of shares, or one."""
        return self.numbers.counts is not None

    @property
    def has_shares(self):
        """Whether there is anything to normalise."""
        return self.numbers.n_terms > 0 or not self.is_grid

    @property
    def has_slopes(self):
        return self.numbers.slope_inputs.size > 0

    @property
    def selects_slopes(self):
        """Whether only some of the inputs take part in the consequents."""
        return 0 < self.numbers.slope_inputs.size < self.numbers.n_inputs

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

    def strength_arrays(self):
        """Declarations of what strengths are worked out in."""
        lines = [f"    $real l[{self.n_logarithms}];"] if self.has_shares else []
        return lines if self.is_grid else [*lines, f"    $real w[{self.numbers.n_rules}];"]

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

    def strengths(self, logarithms, rules, slope):
        """Terms, then shares (of a grid, in place) or strengths; or their derivatives."""
        numbers = self.numbers
        lines = []
        for k, terms in enumerate(numbers.terms):
            position = f"{terms.start} + i" if terms.start else "i"
            of_input = f"$name_term_input[{position}]"
            value = f"$name_{terms.family.name}{slope}(c[{of_input}], $name_terms{k}[i])"
            value += f" * e[{of_input}]" if slope else ""
            lines += loop("i", len(terms.constants), [f"{logarithms}[{position}] = {value};"])
        if self.is_grid:
            for start, count in zip(numbers.block_starts, numbers.counts, strict=True):
                lines += self.finish(_at(logarithms, start), _at("l", start), count, slope)
            return lines
        if numbers.rule_terms is not None:
            lines.append(f"    {logarithms}[{numbers.n_terms}] = 0.0R;")
            term = "$name_rule_terms[r][k]"
        else:
            term = f"r * {numbers.terms_per_rule} + k"
        total = loop("k", numbers.terms_per_rule, [f"{rules}[r] += {logarithms}[{term}];"], "")
        lines += loop("r", numbers.n_rules, [f"{rules}[r] = 0.0R;", *total])
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
            return loop("r", numbers.n_rules, body("w[r]", change))
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

    def slope_loop(self, statement):
        """``statement`` for every slope j of a consequent, on input @."""
        if not self.has_slopes:
            return []
        at = "$name_slope_input[j]" if self.selects_slopes else "j"
        return loop("j", self.numbers.slope_inputs.size, [statement.replace("@", at)], "")


def _at(array, start):
    return f"{array} + {start}" if start else array
