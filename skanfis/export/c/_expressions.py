"""Formulas of ``_families`` as bodies of C functions, one operation a line."""

from collections import Counter
from functools import partialmethod

from .._families import FORMULAS


class _Number:
    """A number in C; every operation on it becomes a line of the body."""

    def __init__(self, text, body):
        self.text, self.body = text, body

    def _line(self, *others, template):
        return self.body.add(template, (self, *others))

    def _comparison(self, other, sign):
        # Is no number: stands where it is used.
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


class Body:
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
        """The number that a new line makes of others."""
        self._operations[template] += 1
        name, text = f"t{len(self._lines)}", template.format(*map(self.text_of, operands))
        self._lines.append(self.dialect.write(f"    const $real {name} = {text};\n"))
        return _Number(name, self)

    def text_of(self, number):
        """A number as it stands in a line."""
        return number.text if isinstance(number, _Number) else self.dialect.number(number)
