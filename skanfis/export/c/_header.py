"""The .h file: what a caller must know."""

import textwrap

import numpy as np
from scipy.stats import qmc

from ...policies import policy_in_words
from ._dialect import comment
from .status import status_lines

__all__ = ["cost_lines", "header", "header_of", "input_lines", "policy_line"]

# Where the slopes are looked at.
_ROWS = 256

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
 */
#ifndef $NAME_H
#define $NAME_H

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


def header(model, numbers, dialect, cost, min_coverage, limits=None):
    """The header, whose first comment says what the model is and what it costs."""
    lines = [
        f"{model.n_rules} rules, order {model.order}; {dialect.std.upper()}, {dialect.real}.",
        *cost_lines(cost),
        "",
        *input_lines(model.input_names, numbers.low, numbers.high),
        "Outputs y, and what they are held within:",
        *_ranges(model.output_names, *model.output_limits),
    ]
    if limits is not None:
        ends = zip(model.output_names, limits, strict=True)
        told = ", ".join(f"{comment(name)} from {a:.7g} to {b:.7g}" for name, (a, b) in ends)
        lines += ["", f"Outputs are saturated beyond limits that were asked for: {told}."]
    lines += _precision_lines(model, numbers)
    lines += ["", policy_line(model, "Outside this range")]
    lines.append("A row that is not finite gets no output either way.")
    if min_coverage is not None:
        lines.append(f"A row is uncovered where its coverage is below {min_coverage:g}.")
    title = "A Takagi-Sugeno-Kang fuzzy model"
    return header_of(title, lines, dialect, model.n_inputs, model.n_outputs)


def cost_lines(cost, besides=""):
    """What an evaluation takes, and the memory; ``besides`` comes first."""
    yield (
        f"Per evaluation in range: {besides}{cost.exponentials} exponentials, {cost.logarithms} "
        f"logarithms, {cost.multiply_adds} multiply-adds, {cost.divisions} divisions."
    )
    if cost.coverage_multiply_adds:
        yield (
            f"Coverage takes at most {cost.coverage_exponentials} exponentials, "
            f"{cost.coverage_square_roots} square roots and {cost.coverage_multiply_adds} "
            "multiply-adds more; where the strongest rule covers the row, a small part of them."
        )
    yield f"Memory: {cost.table_bytes} bytes of tables, {cost.stack_bytes} of arrays on the stack."


def input_lines(names, low, high):
    return ["Inputs x, and their range in the training data:", *_ranges(names, low, high)]


def _ranges(names, low, high):
    ends = enumerate(zip(names, low, high, strict=True))
    return [f"  [{k}] {comment(name)}: {a:.7g} to {b:.7g}" for k, (name, a, b) in ends]


def policy_line(model, where):
    """What is answered out of bounds."""
    words = policy_in_words(model.out_of_bounds, model.max_extrapolation)
    return f"{where} {_SILENT.get(model.out_of_bounds, words)}."


def _precision_lines(model, numbers):
    """What single precision makes of inputs that lie far from zero for their spread."""
    if numbers.dtype != np.float32:
        return []
    steps = np.spacing(np.maximum(np.abs(numbers.low), np.abs(numbers.high))).astype(float)
    shares = np.where(model.minimum < model.maximum, steps / model.spread, 0.0)
    j = int(np.argmax(shares))
    points = qmc.Halton(model.n_inputs, scramble=False).random(_ROWS)
    slopes = np.abs(model.gradient(model.minimum + points * (model.maximum - model.minimum)))
    moved = 0.5 * np.einsum("nio,i->no", slopes, steps).max(axis=0)
    told = ", ".join(
        f"{comment(name)} by up to {value:.1g}"
        for name, value in zip(model.output_names, moved, strict=True)
    )
    return [
        "",
        f"Single precision has steps of {steps[j]:.2g} at the far end of [{j}], {shares[j]:.1g} of "
        f"its standard deviation. Rounding inputs to such steps moves {told}. Subtract an offset "
        "in double precision, before training and before the call, where that is too much.",
    ]


def header_of(title, lines, dialect, n_inputs, n_outputs):
    facts = [part for line in lines for part in textwrap.wrap(line, 95) or [""]]
    return dialect.write(
        _CODE.replace("$status_lines", status_lines()),
        facts="\n".join(f" * {line}".rstrip() for line in facts),
        title=title,
        n_inputs=n_inputs,
        n_outputs=n_outputs,
    )
