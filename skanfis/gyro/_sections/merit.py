"""Figures of merit, with the limits of the specification beside them."""

import numpy as np

from .._results import COUNTS
from ..displays._style import SYMBOL, figures
from .words import signs, value_and_interval, words

__all__ = ["merit"]


def merit(page, results):
    """The table for all rows in range, and one line per held-out group."""
    table = results.merit
    page.section("Figures of merit")
    whole = table[(table["group"] == "all") & ~table["figure"].isin(COUNTS)]
    known = whole[whole[["before", "after"]].notna().any(axis=1)]
    lines = [
        (
            words(line["figure"]),
            value_and_interval(line, "before"),
            value_and_interval(line, "after"),
            signs(line["unit"]),
        )
        for _, line in known.iterrows()
    ]
    resampled = table.attrs["resampled"]["all"]
    caption = f"95 % intervals in brackets, by resampling {resampled}"
    page.table(("figure", "before", "after", "unit"), lines, caption)
    for note, part in whole[whole["note"] != ""].groupby("note", sort=False):
        page.paragraph(f"{', '.join(map(words, part['figure']))}: {note}", kind="soft")
    _specification(page, results)
    if results.has_few_groups:
        _by_group(page, results)


def _specification(page, results):
    if not results.checks:
        return
    page.heading("Limits of the specification")
    lines = [
        (
            check.words,
            (_in_words(check.limit), _as_typed(check.limit)),
            figures(check.value) if np.isfinite(check.value) else "–",
            signs(check.limit.unit),
            (check.result, check.remark),
        )
        for check in results.checks
    ]
    page.table(
        ("figure", "required", "after", "unit", "result"),
        lines,
        "After compensation by the fuzzy rules, on the held-out rows in range",
    )


def _by_group(page, results):
    kind = results.calibration.split.kind.split("+")[0]
    parts = results.merit[results.merit["group"] != "all"]
    after = parts.pivot(index="group", columns="figure", values="after")
    before = parts[parts["figure"] == "residual_rms"].set_index("group")["before"]
    lines = []
    for group in parts["group"].unique():
        line = after.loc[group]
        shown = [
            figures(before[group]),
            figures(line["residual_rms"]),
            figures(line["residual_peak"]),
            f"{figures(line['reduction_factor'])} ×",
        ]
        if line["rows"] == line["rows_refused"]:
            shown = ["–"] * len(shown)  # no row in range, no error of such rows
        lines.append((str(group), f"{line['rows']:,.0f}", f"{line['rows_refused']:,.0f}", *shown))
    unit = SYMBOL[results.unit]
    errors = (f"RMS before [{unit}]", f"RMS after [{unit}]", f"peak after [{unit}]")
    page.heading(f"By held-out {kind}")
    page.table((kind, "rows", "out of range", *errors, "reduction"), lines)


def _in_words(limit):
    low, high = (figures(end) for end in (limit.low, limit.high))
    if limit.low == -limit.high:
        return f"size at most {high}"
    if np.isinf(limit.high):
        return f"at least {low}"
    return f"at most {high}" if np.isinf(limit.low) else f"{low} to {high}"


def _as_typed(limit):
    """Where it was typed in another unit than the report's."""
    return f"({signs(limit.text)})" if not limit.text.endswith(limit.unit) else ""
