"""Formulas of ``_families`` as bodies of C functions, one operation a line."""

from collections import Counter
from functools import partialmethod

from .._families import FORMULAS


class _Number:
    """A number in C: a name, a constant, or made of others as a template says."""

    def __init__(self, template, *operands):
        self.template = template
        self.operands = [one if isinstance(one, _Number) else _Number(one) for one in operands]

    def _of(self, *others, template):
        return _Number(template, self, *others)

    __add__ = partialmethod(_of, template="{0} + {1}")
    __sub__ = partialmethod(_of, template="{0} - {1}")
    __mul__ = partialmethod(_of, template="{0} * {1}")
    __truediv__ = partialmethod(_of, template="{0} / {1}")
    __neg__ = partialmethod(_of, template="-{0}")
    __lt__ = partialmethod(_of, template="{0} < {1}")
    __gt__ = partialmethod(_of, template="{0} > {1}")
    exp = partialmethod(_of, template="$EXP({0})")
    log = partialmethod(_of, template="$LOG({0})")
    abs = partialmethod(_of, template="{0} < 0.0R ? -{0} : {0}")
    at_most = partialmethod(_of, template="{0} < {1} ? {0} : {1}")
    at_least = partialmethod(_of, template="{0} > {1} ? {0} : {1}")
    where = partialmethod(_of, template="{0} ? {1} : {2}")


def _steps(family, is_slope=False):
    """Everything that the formula of a family makes of x and p, after what it is made of."""
    n_constants = len(FORMULAS[family].constants([0.0] * len(family.parameters)))
    p = [_Number(f"p[{k}]") for k in range(n_constants)]
    result = FORMULAS[family].of(_Number("x"), p)[is_slope]()
    found: dict[_Number, None] = {}

    def visit(number):
        for one in number.operands:
            visit(one)
        found.setdefault(number)

    visit(result)
    return list(found)


def body_of(family, dialect, is_slope=False):
    """The statements of a function of x and p: log mu, or its derivative by x."""
    texts: dict[_Number, str] = {}
    lines: list[str] = []
    *steps, result = _steps(family, is_slope)
    for number in [*steps, result]:
        if isinstance(number.template, float):
            texts[number] = dialect.number(number.template)
            continue
        text = number.template.format(*(texts[one] for one in number.operands))
        # Names and comparisons, which are no numbers, stand where they are used.
        if number.operands and number.template not in ("{0} < {1}", "{0} > {1}"):
            texts[number] = f"t{len(lines)}"
            lines.append(f"const $real {texts[number]} = {text};")
        else:
            texts[number] = text
    return [dialect.write(line) for line in [*lines, f"return {texts[result]};"]]


def cost_of(family, is_slope=False):
    """Exponentials, logarithms, multiplications and divisions of log mu, or of its derivative."""
    operations = Counter(one.template for one in _steps(family, is_slope))
    return [operations[one] for one in ("$EXP({0})", "$LOG({0})", "{0} * {1}", "{0} / {1}")]
