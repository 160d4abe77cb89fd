"""Formulas of ``_families`` as bodies of C functions, in steps that have names."""

from collections import Counter
from functools import partialmethod

from .._families import FORMULAS

# How strongly an operation binds its operands: what binds less stands in parentheses.
_CHOICE, _SUM, _PRODUCT, _SIGN, _ATOM = range(5)


class _Number:
    """A number in C: a name, a constant, or made of others as a template says."""

    def __init__(self, template, *operands, level=_ATOM):
        self.template, self.level = template, level
        self.operands = [one if isinstance(one, _Number) else _Number(one) for one in operands]

    def _of(self, *others, template, level=_ATOM):
        return _Number(template, self, *others, level=level)

    __add__ = partialmethod(_of, template="{0} + {1}", level=_SUM)
    __sub__ = partialmethod(_of, template="{0} - {1}", level=_SUM)
    __mul__ = partialmethod(_of, template="{0} * {1}", level=_PRODUCT)
    __truediv__ = partialmethod(_of, template="{0} / {1}", level=_PRODUCT)
    __neg__ = partialmethod(_of, template="-{0}", level=_SIGN)
    __lt__ = partialmethod(_of, template="{0} < {1}", level=_CHOICE)
    __gt__ = partialmethod(_of, template="{0} > {1}", level=_CHOICE)
    exp = partialmethod(_of, template="$EXP({0})")
    log = partialmethod(_of, template="$LOG({0})")
    abs = partialmethod(_of, template="{0} < 0.0R ? -{0} : {0}", level=_CHOICE)
    at_most = partialmethod(_of, template="{0} < {1} ? {0} : {1}", level=_CHOICE)
    at_least = partialmethod(_of, template="{0} > {1} ? {0} : {1}", level=_CHOICE)
    where = partialmethod(_of, template="{0} ? {1} : {2}", level=_CHOICE)


def _traced(family, is_slope=False):
    """What the formula of a family makes of x and p."""
    n_constants = len(FORMULAS[family].constants([0.0] * len(family.parameters)))
    p = [_Number(f"p[{k}]") for k in range(n_constants)]
    return FORMULAS[family].of(_Number("x"), p)[is_slope]()


def _uses(number, found):
    """How often everything that a number is made of stands in something else."""
    for place, one in enumerate(number.operands):
        if one not in found:
            _uses(one, found)
        found[one] += number.template.count(f"{{{place}}}")
    return found


def body_of(family, dialect, is_slope=False):
    """The statements of a function of x and p: log mu, or its derivative by x."""
    result, lines = _traced(family, is_slope), []
    names: dict[_Number, str] = {}
    uses = _uses(result, Counter())

    def in_words(one):
        """Its text; what stands twice, and every choice, has been given a name."""
        texts = []
        for place, part in enumerate(one.operands):
            text, level = operand(part)
            is_first = place == 0 and one.level != _SIGN
            is_bound = one.level == _ATOM or level > one.level or (is_first and level == one.level)
            texts.append(text if is_bound else f"({text})")
        return one.template.format(*texts)

    def operand(one):
        """Its text or name, and how strongly that binds."""
        if isinstance(one.template, float):
            return dialect.number(one.template), _SIGN if one.template < 0.0 else _ATOM
        is_choice = "?" in one.template
        # A comparison is no number: it is written out again.
        is_comparison = one.level == _CHOICE and not is_choice
        if not one.operands or is_comparison or (uses[one] == 1 and not is_choice):
            return in_words(one), one.level
        if one not in names:
            text = in_words(one)
            names[one] = f"t{len(names)}"
            lines.append(f"const $real {names[one]} = {text};")
        return names[one], _ATOM

    last = in_words(result)
    return [dialect.write(line) for line in [*lines, f"return {last};"]]


def cost_of(family):
    """Exponentials, logarithms and multiplications that a value takes."""
    result = _traced(family)
    operations = Counter(one.template for one in [result, *_uses(result, Counter())])
    return [operations[one] for one in ("$EXP({0})", "$LOG({0})", "{0} * {1}")]
