"""Write the .h file: a comment on inputs, outputs and cost, then the declarations."""

import textwrap

import numpy as np

from ...digits import counted, range_in_digits
from ...policies import policy_in_words
from .dialect import remark, status_lines

# Digits of a range's ends, relative to its width: about a hundred-thousandth.
_DIGITS = 6
_SILENT = {
    "raise": "there is no output: y stays as it is",
    "nan": "there is no output: y becomes NaN, or stays as it is where C has no NaN",
}

_CODE = """/*
 * $title written by skanfis; generated, not to be edited.
 *
$facts
 *
 * Constant tables, no heap, no state: safe to call from several threads and from interrupts.
 * Compile without -ffast-math, which takes away the check of the inputs.
 *
 * MISRA C:2012, checked by cppcheck: all required rules are kept but 10.1, since the status is an
 * int whose bits are set. These advisory ones are not kept: Dir 4.6 (plain types), Dir 4.9 (macros
 * like functions), 2.5, 8.7, 8.9, 12.1, 12.3, 15.5 and 18.4. No one has certified it.
 */
#ifndef $NAME_H
#define $NAME_H
$include
#ifdef __cplusplus
extern "C" {
#endif

#define $NAME_N_INPUTS $n_inputs
#define $NAME_N_OUTPUTS $n_outputs

/* The status is the sum of these. */
$status_lines

/* Evaluates the model at x, writes y, returns the status. */
int $name_predict(const $real x[$NAME_N_INPUTS], $real y[$NAME_N_OUTPUTS]);

#ifdef $NAME_SELF_TEST
/* Returns 0, or else the number of the first test row that fails, counted from 1. */
int $name_self_test(void);
#endif

#ifdef __cplusplus
}
#endif

#endif /* $NAME_H */
"""


def header(source, units, notes):
    """The header, whose first comment says what the model is and what it costs."""
    model, numbers, dialect = source.model, source.numbers, source.dialect
    names = *model.input_names, *model.output_names
    if strange := sorted(set(units or {}).difference(names)):
        raise ValueError(f"units has {', '.join(strange)}, but the columns are {', '.join(names)}.")
    asked = (-np.inf, np.inf) if source.limits is None else source.limits.T
    lowest, highest = np.clip(model.output_limits, *asked)
    lines = [
        f"Rules: {model.n_rules}, of order {model.order}; {dialect.std.upper()}, {dialect.real}.",
        *cost_lines(source.cost),
        "",
        *input_lines(model.input_names, numbers.low, numbers.high, units),
        "Outputs y, and what they are held within:",
        *_ranges(model.output_names, lowest, highest, units),
    ]
    lines += _precision_lines(numbers)
    lines += ["", policy_line(model, "Outside this range")]
    lines.append("A row with an input that is not finite gets no output.")
    if source.min_coverage is not None:
        lines.append(f"A row is flagged as uncovered below a coverage of {source.min_coverage:g}.")
    title = "A Takagi-Sugeno-Kang fuzzy model"
    return header_of(title, notes, lines, dialect, model.n_inputs, model.n_outputs)


def cost_lines(cost, besides=""):
    """Lines on the largest cost of an evaluation, and on memory; ``besides`` comes first."""
    numbers = (
        counted(cost.exponentials, "exponential"),
        counted(cost.logarithms, "logarithm"),
        counted(cost.square_roots, "square root"),
        counted(cost.multiply_adds, "multiply-add"),
        counted(cost.divisions, "division"),
    )
    yield f"Largest cost of an evaluation: {besides}{', '.join(numbers)}."
    yield f"Memory: {cost.table_bytes} bytes of tables, {cost.stack_bytes} of arrays on the stack."


def input_lines(names, low, high, units):
    """The inputs and their range."""
    return ["Inputs x, and their range in the training data:", *_ranges(names, low, high, units)]


def _ranges(names, low, high, units):
    units, ranges = units or {}, zip(names, low, high, strict=True)
    for k, (name, least, most) in enumerate(ranges):
        unit = f" [{remark(units[name])}]" if name in units else ""
        yield f"  [{k}] {remark(name)}{unit}: {range_in_digits(least, most, _DIGITS)}"


def policy_line(model, where):
    """A sentence on the output out of bounds."""
    words = policy_in_words(model.out_of_bounds, model.max_extrapolation)
    return f"{where} {_SILENT.get(model.out_of_bounds, words)}."


def _precision_lines(numbers):
    """Lines on how single precision rounds inputs that are far from zero for their spread."""
    if numbers.dtype != np.float32:
        return []
    steps = np.spacing(np.maximum(np.abs(numbers.low), np.abs(numbers.high)))
    shares = np.where(numbers.low < numbers.high, steps * numbers.inverse_spread, 0.0)
    j = int(np.argmax(shares))
    return [
        "",
        f"Single precision has steps of {steps[j]:.2g} at the far end of [{j}], {shares[j]:.1g} of "
        "its standard deviation. Where that is too much, subtract an offset in double precision, "
        "before training and before the call.",
    ]


def header_of(title, notes, lines, dialect, n_inputs, n_outputs, include=""):
    """A header whose first comment has the user's notes, and lines; ``include`` is one of code."""
    lines = [*map(remark, [notes] if isinstance(notes, str) else notes), *lines]
    wrapped = (textwrap.wrap(line, 95, break_on_hyphens=False) or [""] for line in lines)
    return dialect.write(
        _CODE.replace("$status_lines", status_lines()),
        facts="\n".join(f" * {line}".rstrip() for parts in wrapped for line in parts),
        title=title,
        n_inputs=n_inputs,
        n_outputs=n_outputs,
        include=f"\n{include}\n" if include else "",
    )
