"""Write the .c file: constant tables, and the functions that read them.

The functions are in ``templates``; those of memberships come from the formulas in ``_families``.
This module decides which lines are written, and counts sizes and costs. The order of computation is
that of ``skanfis.model``; "linear" is computed only outside the box, by the derivative along the
way from its nearest point.
"""

import re
from collections import Counter
from dataclasses import dataclass
from functools import cached_property, partialmethod
from typing import Any

import numpy as np

from ...policies import SILENT
from .._families import FORMULAS
from .._numbers import Numbers
from . import templates
from .dialect import STATUS, Dialect, kept_lines, read_limits, table_bytes


@dataclass(frozen=True)
class CCost:
    """The largest cost of one evaluation, for any row, and the memory of the function.

    The most expensive row lies outside the range, if the policy answers there, and is covered by no
    rule. A row in range that its strongest rule covers costs much less.

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
        self.numbers, self.model = numbers, numbers.model
        # Rules without training data have no coverage.
        self.min_coverage = None if model.support is None else min_coverage
        self.limits = read_limits(saturate, numbers)
        # Final limits of the outputs, (2, n_outputs) or None.
        self.held = numbers.output_limits
        if self.limits is not None:
            self.held = self.limits.T if self.held is None else np.clip(self.held, *self.limits.T)
        self.facts = self._facts()
        self.sizes = self._sizes()

    def _facts(self):
        """Facts of the model, which select the lines of ``templates``."""
        numbers, n_terms = self.numbers, self.model.antecedent.n_terms
        # A grid without terms has one rule.
        is_grid, is_one = bool(numbers.counts), numbers.counts == ()
        is_tree, has_slopes = numbers.nodes is not None, numbers.slope_input.size > 0
        covers, answers = self.min_coverage is not None, self.policy not in SILENT
        # A constant needs no tangent, nor does a reach of zero.
        varies = n_terms > 0 or has_slopes
        linear = self.policy == "linear" and varies and bool(numbers.reach.any())
        moves = linear and numbers.tangent_group is not None
        facts = {
            # Rules are a table of terms, whose shares multiply or logarithms add, or a tree.
            "table": not (is_one or is_tree),
            "grid": is_grid,
            "sums": not (is_one or is_grid or is_tree),
            "tree": is_tree,
            # Some rules of the table have fewer terms than others.
            "none": not (is_one or is_tree) and (numbers.rule_terms == n_terms).any(),
            "terms": n_terms > 0,
            "slopes": has_slopes,
            "covers": covers,
            # Rows outside the box: no answer; less coverage; tangent.
            "silent": not answers,
            "fades": covers and answers,
            "linear": linear,
            # Tangents are found at the row's own place, or with some inputs held elsewhere.
            "plain": linear and not moves,
            "moves": moves,
            "beyond": linear or (covers and answers),
            "held": self.held is not None,
            # Limits asked for also replace NaN; the model's own leave such a fault visible.
            "asked": self.limits is not None,
            "told": self.held is not None and self.limits is None,
        }
        return {fact for fact, holds in facts.items() if holds}

    def _sizes(self):
        """Sizes of tables and arrays, by their names in ``templates``."""
        facts, n_rules, n_terms = self.facts, self.model.n_rules, self.model.antecedent.n_terms
        n_nodes = n_terms // 2 if "tree" in facts else 0
        return {
            "n_rules": n_rules,
            "n_terms": n_terms,
            "n_nodes": n_nodes,
            "n_places": self.numbers.rule_terms.shape[1],
            "n_slopes": self.numbers.slope_input.size,
            # Logarithms of terms, and the zero of "none"; strengths of rules, and of nodes.
            "n_logarithms": (n_terms + ("none" in facts)) * ("table" in facts),
            "n_strengths": n_rules + n_nodes,
            # Places at which tangents are found.
            "n_groups": 1 + int(max(self.numbers.tangent_group)) if "moves" in facts else 1,
        }

    def body(self):
        """The C code after the #include lines."""
        macros = f"{self.dialect.functions()}\n"
        tables = [self.dialect.table(name, values) for name, values in self.tables.items()]
        return "\n".join([macros, *tables, *self._memberships(), self._functions])

    @cached_property
    def _functions(self):
        """The functions that read the tables."""
        dialect, sizes = self.dialect, self.sizes
        parts = [
            kept_lines(templates.TANGENT, self.facts) if "linear" in self.facts else "",
            templates.rejection(self.policy, dialect.std),
            kept_lines(templates.PREDICT, self.facts),
        ]
        text = "\n\n".join(part.strip("\n") for part in parts if part)
        text = text.replace("$finite_input", templates.FINITE_INPUT.strip("\n"))
        text = text.replace("$strengths", self._strengths("share"))
        text = text.replace("$slopes", self._strengths("slope"))
        # Arrays that describe a row's place: z, the shares of a grid's terms, and the strengths.
        taken = ["z", "l", "w"] if "grid" in self.facts else ["z", "w"]
        is_on_some = 0 < sizes["n_slopes"] < self.model.n_inputs
        words = sizes | {
            # int has 16 bits at least.
            "int": "long" if max(sizes["n_rules"], sizes["n_terms"]) > 32767 else "int",
            "linkage": "static " if self.is_part else "",
            "limit": dialect.number(self.min_coverage or 0.0),
            "given": ", ".join(f"const {dialect.real} *{name}" for name in taken),
            "taken": ", ".join(taken),
            "slope_input": f"{dialect.name}_slope_input[j]" if is_on_some else "j",
        }
        text = dialect.write(f"\n{text}\n", **words)
        for name, helper in reversed(templates.HELPERS.items()):
            if f"{dialect.name}_{name}(" in text:
                text = dialect.write(helper, **words) + text
        return text.lstrip()

    def _strengths(self, what):
        """The lines that find strengths ("share"), or the derivatives of their logarithms."""
        numbers, facts = self.numbers, {*self.facts, what}
        if "table" not in facts:
            return kept_lines(templates.TREE if "tree" in facts else templates.ONE, facts)

        def each(template, parts):
            text = kept_lines(template, facts)
            return "\n".join(self.dialect.write(text, **words) for words in parts)

        tables = [
            {"table": k, "family": one.family.name, "count": len(one.constants)}
            | {"at": f"{one.start} + i" if one.start else "i"}
            for k, one in enumerate(numbers.terms)
        ]
        counts = zip(numbers.block_starts, numbers.counts or (), strict=True)
        inputs = [{"start": start, "count": count} for start, count in counts]
        text = kept_lines(templates.TABLE, facts)
        text = text.replace("$terms", each(templates.TERMS, tables))
        return text.replace("$shares", each(templates.SHARES, inputs))

    @cached_property
    def _named(self):
        """Names of the tables and helpers that the functions use."""
        return set(re.findall(rf"\b{self.dialect.name}_(\w+)", self._functions))

    @cached_property
    def tables(self):
        """The numbers that the functions read as constant tables, by name."""
        found = vars(self.numbers).copy()
        for k, terms in enumerate(self.numbers.terms):
            found[f"terms{k}"] = terms.constants
        if self.held is not None:
            found["output_low"], found["output_high"] = self.held
        return {name: values for name, values in found.items() if name in self._named}

    def _memberships(self):
        """Functions of the families in use."""
        for family in dict.fromkeys(terms.family for terms in self.numbers.terms):
            for what, of in (("Logarithm", ""), ("Derivative of the logarithm", "d_")):
                if of + family.name in self._named:
                    yield self.dialect.write(
                        templates.MEMBERSHIP,
                        what=what,
                        family=family.name,
                        of=of,
                        lines=_Body(family, self.dialect, bool(of)).text,
                    )

    @cached_property
    def cost(self):
        """CCost of the most expensive row."""
        numbers, facts, sizes = self.numbers, self.facts, self.sizes
        n_inputs, n_outputs = self.model.n_inputs, self.model.n_outputs
        of_value, strengths = numbers.consequents.size, self._cost_of_strengths()
        operations = strengths + np.array([0, 0, of_value, 0])
        if "linear" in facts:
            # Two products per coefficient: at the start of the tangent, and along it.
            tangent = self._cost_of_strengths(is_slope=True) + strengths * ("moves" in facts)
            tangent += [0, 0, 2 * of_value, 0]
            operations += sizes["n_groups"] * tangent
            # The scale of the way out: a product and a division per input, a product per output.
            operations += [0, 0, n_inputs + n_outputs, n_inputs]
        if "fades" in facts:
            # Per input the deviation and its square, then the exponential of half their sum.
            operations += [1, 0, 2 * n_inputs + 2, 0]
        # Coverage is computed for the strongest rule, then for all that have data.
        asked = int("covers" in facts and 1 + np.count_nonzero(numbers.support[:, 0]))
        # Products with the factor's triangle, squares, share and strength.
        operations += [asked, 0, asked * (n_inputs * (n_inputs + 1) // 2 + n_inputs + 5), 0]
        exponentials, logarithms, multiply_adds, divisions = map(int, operations)
        # Arrays of inputs, z and e; l and w, and of slopes t and s; sum and change.
        linear, moves = "linear" in facts, "moves" in facts
        n_held = (1 + ("beyond" in facts) + 2 * moves) * n_inputs + (1 + linear) * n_outputs
        n_held += (1 + linear + moves) * (sizes["n_logarithms"] + sizes["n_strengths"])
        return CCost(
            exponentials=exponentials,
            logarithms=logarithms,
            square_roots=asked,
            multiply_adds=multiply_adds,
            divisions=divisions,
            table_bytes=sum(map(table_bytes, self.tables.values())),
            stack_bytes=n_held * numbers.dtype.itemsize,
        )

    def _cost_of_strengths(self, is_slope=False):
        """Exponentials, logarithms, multiplications and divisions of strengths, or of slopes."""
        numbers, facts, sizes = self.numbers, self.facts, self.sizes
        if "tree" in facts:
            # The sigmoid's argument, its two sides, and the strengths above and below.
            return sizes["n_nodes"] * np.array([1, 0, 4 + is_slope, 1])
        operations = np.zeros(4, dtype=int)
        for terms in numbers.terms:
            of_term = _Body(terms.family, self.dialect, is_slope).cost
            operations += len(terms.constants) * np.array(of_term)
        n_shares = sizes["n_rules" if "sums" in facts else "n_terms"]
        if is_slope:
            # Derivatives along e, minus their mean.
            return operations + np.array([0, 0, sizes["n_terms"] + n_shares, 0])
        # For a grid, products of shares; one division for each sum.
        n_products = numbers.rule_terms.size if "grid" in facts else 0
        n_sums = 1 if "sums" in facts else len(numbers.counts)
        return operations + np.array([n_shares, 0, n_shares + n_products, n_sums])


class RulesPart(Source):
    """The rules of a model as static functions of a larger C file, which share its status word.

    The file calls ``int NAME_predict(const REAL x[], REAL y[])``, where NAME is the prefix of the
    file and ``suffix``. ``model``, ``low`` and ``high`` are rounded to the type of the file.
    """

    def __init__(self, model, dialect, suffix, min_coverage):
        own = Dialect(dialect.name + suffix, dialect.real, dialect.std)
        super().__init__(model, own, min_coverage, is_part=True)
        self.low, self.high, self._outer = self.numbers.low, self.numbers.high, dialect.name.upper()

    def text(self):
        """The C code, to be placed after the #include lines."""
        prefix = self.dialect.name.upper()
        sizes = {"N_INPUTS": self.model.n_inputs, "N_OUTPUTS": self.model.n_outputs}
        macros = [f"#define {prefix}_{key} {value}\n" for key, value in sizes.items()]
        macros += [f"#define {prefix}_{key} {self._outer}_{key}\n" for key in STATUS]
        return f"\n/* The rules. */\n{''.join(macros)}\n{self.body()}"


class _Number:
    """A number in C; every operation on it becomes a line of the body."""

    def __init__(self, text, body):
        self.text, self.body = text, body

    def _line(self, *others, template):
        return self.body.add(template, (self, *others))

    def _comparison(self, other, sign):
        # A comparison gets no variable: its text is put where it is used.
        return _Number(f"{self.text} {sign} {self.body.text_of(other)}", self.body)

    __add__ = partialmethod(_line, template="{0} + {1}")
    __sub__ = partialmethod(_line, template="{0} - {1}")
    __mul__ = partialmethod(_line, template="{0} * {1}")
    __truediv__ = partialmethod(_line, template="{0} / {1}")
    __neg__ = partialmethod(_line, template="-{0}")
    __lt__ = partialmethod(_comparison, sign="<")
    __gt__ = partialmethod(_comparison, sign=">")
    exp = partialmethod(_line, template="$EXP({0})")
    log = partialmethod(_line, template="$LOG({0})")
    abs = partialmethod(_line, template="{0} < 0.0R ? -{0} : {0}")
    at_most = partialmethod(_line, template="{0} < {1} ? {0} : {1}")
    at_least = partialmethod(_line, template="{0} > {1} ? {0} : {1}")
    where = partialmethod(_line, template="{0} ? {1} : {2}")


class _Body:
    """A function of x and p: log mu of a family, or its derivative by x.

    ``text`` are its statements, ``cost`` their exponentials, logarithms, products and divisions.
    """

    def __init__(self, family, dialect, is_slope):
        self.dialect = dialect
        self._lines: list[str] = []
        self._operations: Counter = Counter()
        formula = FORMULAS[family]
        n_constants = len(formula.constants([0.0] * len(family.parameters)))
        p = [_Number(f"p[{k}]", self) for k in range(n_constants)]
        result = formula.of(_Number("x", self), p)[is_slope]()
        self.text = "".join([*self._lines, f"    return {result.text};"])
        operations = ("$EXP({0})", "$LOG({0})", "{0} * {1}", "{0} / {1}")
        self.cost = [self._operations[one] for one in operations]

    def add(self, template, operands):
        """Add a line that computes a new number from others, and return it."""
        self._operations[template] += 1
        name, text = f"t{len(self._lines)}", template.format(*map(self.text_of, operands))
        self._lines.append(self.dialect.write(f"    const $real {name} = {text};\n"))
        return _Number(name, self)

    def text_of(self, number):
        """A number as text for a line."""
        return number.text if isinstance(number, _Number) else self.dialect.number(number)
