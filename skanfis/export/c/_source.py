"""The .c file: constant tables, and the functions that read them.

The order of work is that of ``skanfis.model``. A grid normalises each input by itself and
multiplies shares: one exponential per term, not per rule and input. A tree parts the strength that
comes to a node, from the root on: one exponential per node, nothing to normalise. "linear" is
worked out only outside the box, by the derivative along the way back.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...policies import SILENT
from .._numbers import Numbers
from . import templates
from ._expressions import Body
from .dialect import INDEX_BYTES, index_type, kept_lines, read_limits


@dataclass(frozen=True)
class CCost:
    """What one evaluation takes at most, whatever the row, and the memory of the function.

    The row that takes most lies outside the range, where the policy answers there, and is covered
    by no rule. A row in range that its strongest rule covers takes much less.

    Parameters
    ----------
    exponentials, logarithms, square_roots : int
        Calls of ``exp``, ``log`` and ``sqrt``.
    multiply_adds, divisions : int
        Multiplications, most of them with an addition to follow; divisions.
    table_bytes, stack_bytes : int
        Constant tables, which may lie in read-only memory; arrays on the stack.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.export import export_c
    >>> model = ANFISRegressor(n_mfs=4, out_of_bounds="nan").fit(*make_jang_sinc())
    >>> code = export_c(model, name="sinc", min_coverage=None)
    >>> code.cost.exponentials  # 2 inputs of 4 terms, not 16 rules
    8
    """

    exponentials: int
    logarithms: int
    square_roots: int
    multiply_adds: int
    divisions: int
    table_bytes: int
    stack_bytes: int


class Source:
    """The functions and tables of a .c file; ``is_part`` for others in the same file."""

    def __init__(self, model, dialect, min_coverage, saturate=None, is_part=False):
        self.dialect, self.is_part, self.policy = dialect, is_part, model.out_of_bounds
        numbers: Any = Numbers(model, dialect.dtype)
        self.numbers, self.model, self.n_terms = numbers, numbers.model, model.antecedent.n_terms
        # Rules that come from elsewhere have no data to be near to or far from.
        self.min_coverage = None if model.support is None else min_coverage
        self.limits = read_limits(saturate, numbers)
        # What outputs are held within in the end, (2, n_outputs) or None.
        self.held = numbers.output_limits
        if self.limits is not None:
            self.held = self.limits.T if self.held is None else np.clip(self.held, *self.limits.T)
        self.is_grid, self.n_slopes = numbers.counts is not None, numbers.slope_inputs.size
        self.is_tree = numbers.nodes is not None
        # Logarithms of terms, and the zero of "none".
        self.n_logarithms = self.n_terms + int((numbers.rule_terms == self.n_terms).any())
        self.facts = self._facts()
        # Places at which tangents are found.
        self.n_groups = 1 + int(max(numbers.tangent_group)) if "moves" in self.facts else 1

    def _facts(self):
        """What decides which lines there are."""
        numbers = self.numbers
        covers, answers = self.min_coverage is not None, self.policy not in SILENT
        # The tangent of a constant is the constant; one of no length is its start.
        is_constant = not self.n_terms and not self.n_slopes
        linear = self.policy == "linear" and not is_constant and bool(numbers.reach.any())
        moves = linear and numbers.tangent_group is not None
        facts = {
            # Strengths, of terms that a table has of every rule, have to be made to sum to one.
            "normal": not self.is_tree and numbers.counts != (),
            "slopes": self.n_slopes > 0,
            "covers": covers,
            # Rows outside the box get no answer; are less covered; are followed along the tangent.
            "silent": not answers,
            "fades": covers and answers,
            "linear": linear,
            # Tangents are found where the row is, or where some inputs are held elsewhere.
            "plain": linear and not moves,
            "moves": moves,
            "beyond": linear or (covers and answers),
            "held": self.held is not None,
            # Limits that were asked for hold what is no number, too.
            "saturates": self.limits is not None,
            "clips": self.limits is None and self.held is not None,
        }
        return {fact for fact, holds in facts.items() if holds}

    @cached_property
    def cost(self):
        """CCost of the row that takes most."""
        numbers, itemsize, facts = self.numbers, self.numbers.dtype.itemsize, self.facts
        n_inputs, of_value = self.model.n_inputs, numbers.coefficients.size
        operations = self._strengths_cost()
        operations += [0, 0, of_value, 0]
        if "linear" in facts:
            # Twice per coefficient: where the tangent starts, and along it.
            tangent = self._strengths_cost(is_slope=True)
            tangent += [0, 0, 2 * of_value, 0]
            tangent += self._strengths_cost() * ("moves" in facts)
            operations += self.n_groups * tangent
            # The scale: per input what it adds and what it divides, and it is taken back.
            operations += [0, 0, n_inputs + self.model.n_outputs, n_inputs]
        if "fades" in facts:
            # Per input its deviation and the square, then the exponential of half their sum.
            operations += [1, 0, 2 * n_inputs + 2, 0]
        # The strongest rule is asked, then all that have data.
        asked = int("covers" in facts and 1 + np.count_nonzero(numbers.support[:, 0]))
        # The factor's triangle, its square, share and strength.
        operations += [asked, 0, asked * (n_inputs * (n_inputs + 1) // 2 + n_inputs + 5), 0]
        main, own = self.arrays()
        n_held = sum(main.values()) + ("linear" in facts) * sum(own.values())
        exponentials, logarithms, multiply_adds, divisions = map(int, operations)
        return CCost(
            exponentials=exponentials,
            logarithms=logarithms,
            square_roots=asked,
            multiply_adds=multiply_adds,
            divisions=divisions,
            table_bytes=sum(
                values.size
                * (itemsize if values.dtype.kind == "f" else INDEX_BYTES[index_type(values)])
                for values in self.tables().values()
            ),
            stack_bytes=n_held * itemsize,
        )

    def _strengths_cost(self, is_slope=False):
        """Exponentials, logarithms, multiplications and divisions of what ``_strengths`` writes."""
        numbers, counts = self.numbers, self.numbers.counts
        if self.is_tree:
            # The place on the sigmoid, its other side, and what goes above and below.
            return self.n_terms // 2 * np.array([1, 0, 4 + is_slope, 1])
        operations = np.zeros(4, dtype=int)
        for terms in numbers.terms:
            of_term = Body(terms.family, self.dialect, is_slope).cost
            operations += len(terms.constants) * np.array(of_term)
        n_shares = self.n_terms if self.is_grid else self.model.n_rules
        if is_slope:
            # Along e, and less their mean.
            operations += [0, 0, self.n_terms + n_shares, 0]
            return operations
        # Of a grid, products of shares; one division for each sum.
        products = numbers.rule_terms.size if counts else 0
        n_sums = len(counts) if self.is_grid else 1
        operations += [n_shares, 0, n_shares + products, n_sums]
        return operations

    def body(self):
        """What follows the lines that include other files."""
        dialect, indices = self.dialect, ["r", "o"]
        main, tangent = self.arrays()
        indices += ["j"] * (self.n_slopes > 0) + ["k"] * ("normal" in self.facts)
        # What the place of a row is told by: z, the shares of a grid's terms, and the strengths.
        taken = ["z", "l", "w"] if self.numbers.counts else ["z", "w"]
        words = {
            "rejection": templates.rejection(self.policy, dialect.std).strip("\n"),
            "finite_input": templates.FINITE_INPUT.strip("\n"),
            "linkage": "static " if self.is_part else "",
            "taken": ", ".join(taken),
            "tangent_given": "const $real *at, const $real *way, $int g"
            if "moves" in self.facts
            else ", ".join(f"const $real *{name}" for name in [*taken, "e"]),
            "n_groups": self.n_groups,
            "tangent_indices": ", ".join(["i"] * (self.n_terms > 0) + indices),
            "tangent_arrays": _declared(tangent),
            "arrays": _declared(main),
            "indices": ", ".join(["i", *indices]),
            "limit": dialect.number(self.min_coverage or 0.0),
            "strengths_inside": self._strengths("l", "w", ""),
            "strengths_slope": self._strengths("t", "s", "_slope"),
            "add_support": self._over_rules(templates.ADD_SUPPORT),
            "add_rules": self._over_rules(templates.ADD_RULE),
            "add_changes": self._over_rules(templates.ADD_CHANGE),
        }
        # These hold words of the dialect themselves.
        text = dialect.write(kept_lines(templates.FUNCTIONS, self.facts) + "\n", **words)
        # int has 16 bits at least.
        is_long = max(self.model.n_rules, self.n_terms) > 32767
        functions = dialect.write(text, int="long" if is_long else "int")
        tables = [dialect.table(name, values) for name, values in self.tables().items()]
        return "\n".join([dialect.functions() + "\n", *tables, *self._memberships(), functions])

    def tables(self):
        """Constant tables by their names: numbers of the type, or positions."""
        numbers, facts = self.numbers, self.facts
        found = {"low": numbers.low, "high": numbers.high, "reference": numbers.reference}
        if "beyond" in facts:
            found["inverse_spread"] = numbers.inverse_spread
        if "linear" in facts:
            found["reach"] = numbers.reach
        if "moves" in facts:
            found["tangent_at"] = numbers.tangent_at
            found["tangent_group"] = numbers.tangent_group
        if "held" in facts:
            found["output_low"], found["output_high"] = self.held
        if self.is_tree:
            found["nodes"], found["node_input"], found["node_ends"] = numbers.nodes
        else:
            found |= {f"terms{k}": terms.constants for k, terms in enumerate(numbers.terms)}
        if "covers" in facts:
            found["support"] = numbers.support
        found |= {"offset": numbers.offset, "consequents": numbers.coefficients}
        if self.n_terms and not self.is_tree:
            found["term_input"] = numbers.term_inputs
        if "normal" in facts:
            found["rule_terms"] = numbers.rule_terms
        if 0 < self.n_slopes < self.model.n_inputs:
            found["slope_input"] = numbers.slope_inputs
        return found

    def arrays(self):
        """Arrays on the stack and their lengths: of the main function, and of the tangent."""
        main, tangent = {"z": self.model.n_inputs, "sum": self.model.n_outputs}, {}
        if "beyond" in self.facts:
            main["e"] = self.model.n_inputs
        if "linear" in self.facts:
            main["change"] = self.model.n_outputs
        if "normal" in self.facts:
            main["l"] = tangent["t"] = self.n_logarithms
        # Of a tree those of its leaves, then of its nodes.
        main["w"] = tangent["s"] = self.model.n_rules + self.is_tree * self.n_terms // 2
        if "moves" in self.facts:
            own = {name: main[name] for name in ("l", "w") if name in main}
            tangent |= own | {"z": self.model.n_inputs, "e": self.model.n_inputs}
        return main, tangent

    def _memberships(self):
        """Functions of the families in use."""
        if self.is_tree:
            return
        for family in {terms.family: None for terms in self.numbers.terms}:
            for suffix in ["", "_slope"] if "linear" in self.facts else [""]:
                what = "Derivative of the logarithm" if suffix else "Logarithm"
                head = f"/* {what} of a membership: {family.name}. */\n"
                head += f"static $real $name_{family.name}{suffix}($real x, const $real *p)\n{{\n"
                body = _indented(Body(family, self.dialect, bool(suffix)).lines)
                yield f"{self.dialect.write(head)}{body}\n}}\n"

    def _strengths(self, logarithms, rules, slope):
        """Terms, then strengths; or the derivatives of their logarithms along e."""
        if self.is_tree:
            sizes = {"n_nodes": self.n_terms // 2, "n_rules": self.model.n_rules}
            body = kept_lines(templates.TREE, {"slope" if slope else "share"})
            body = self.dialect.write(body, rules=rules, first="0.0R" if slope else "1.0R", **sizes)
            return _indented(body.splitlines())
        numbers, lines = self.numbers, []
        if numbers.counts == ():
            return _indented([f"{rules}[0] = {'0.0R' if slope else '1.0R'};"])
        for k, terms in enumerate(numbers.terms):
            at = _at(terms.start, "i")
            value = (
                f"$name_{terms.family.name}{slope}(z[$name_term_input[{at}]], $name_terms{k}[i])"
            )
            value += f" * e[$name_term_input[{at}]]" if slope else ""
            lines += _loop("i", len(terms.constants), [f"{logarithms}[{at}] = {value};"])
        finish = "$name_centre({0}, {1}, {2});" if slope else "$name_normalise({0}, {2});"
        for start, count in zip(numbers.block_starts, numbers.counts or (), strict=True):
            of_input = (f"{logarithms} + {start}", f"l + {start}") if start else (logarithms, "l")
            lines.append(finish.format(*of_input, count))
        if self.n_logarithms > self.n_terms:
            lines.append(f"{logarithms}[{self.n_terms}] = 0.0R;")
        # Strengths of a grid are products of shares; the rest is sums of logarithms.
        first, join = ("1.0R", "*=") if self.is_grid and not slope else ("0.0R", "+=")
        each = f"{rules}[r] {join} {logarithms}[$name_rule_terms[r][k]];"
        of_rule = [f"{rules}[r] = {first};", *_loop("k", numbers.rule_terms.shape[1], [each])]
        lines += _loop("r", self.model.n_rules, of_rule)
        if not self.is_grid:
            lines.append(finish.format(rules, "w", self.model.n_rules))
        return _indented(lines)

    def _over_rules(self, template):
        """What a template does with every rule r."""
        place = "$name_slope_input[j]" if 0 < self.n_slopes < self.model.n_inputs else "j"
        body = kept_lines(template, self.facts)
        body = self.dialect.write(body, n_slopes=self.n_slopes, input=place)
        return _indented(_loop("r", self.model.n_rules, body.splitlines()))


def _at(start, index):
    return f"{start} + {index}" if start else index


def _declared(arrays):
    return ", ".join(f"{name}[{length}]" for name, length in arrays.items())


def _indented(lines):
    return "\n".join(f"    {line}" for line in lines)


def _loop(index, count, body):
    head = f"for ({index} = 0; {index} < {count}; ++{index}) {{"
    return [head, *(f"    {line}" for line in body), "}"]
