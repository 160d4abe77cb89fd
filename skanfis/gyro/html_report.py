"""The report of a calibration as one page of HTML: verdict, tables, pictures, rules, limits."""

import platform
from collections import Counter
from importlib.resources import files as resources
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import scipy
import sklearn

from .. import __version__
from ..inspection.labels import printable
from ..policies import policy_in_words
from ._formulas import formula_of, law_table, on_board, rules_text
from ._headline import ARTICLES, headline, held_out_groups
from ._pictures import PICTURES, draw, draw_coverage, draw_memberships
from ._rate_units import RATE_UNITS
from ._results import Results
from ._simpler import NOTHING, options_for
from ._units import SIGNALS
from .displays._base import figures, signs
from .metrics import rms

__all__ = ["check_installed", "report_page"]

_COUNTS = ("rows", "rows_refused", "rows_outside")
_UNITS = {"time": "s", "temperature": "degC", "temperature_rate": "degC/s"}
_CHECKED = (
    "A row outside the range of that model's training data is flagged, as it would be on board, "
    "and has a figure of its own above. All other figures and pictures, before and after "
    "compensation alike, are of the rows in range."
)
_BUDGET = (
    "Combined and RMS error are two ways to one figure: where the error is clearly larger, the "
    "rules cannot follow the gyro between the groups, and no part of the budget knows of it. Slow "
    "drift within a group is in the noise, what groups do to the model in what is not repeatable."
)
_PROOF = (
    "Proven by interval arithmetic over every point of the box, beyond the range of the "
    "calibration too, by the policy there: whatever the inputs, the compensator does no more. It "
    "says nothing of how far the gyro is from the compensator."
)
_READING = {
    "strongest_alone": "strongest rule alone, off the model, RMS [sd]",
    "least_truth": "truth of the least true term",
    "greatest_crossing": "highest crossing of neighbouring terms",
}
_ALONE = (
    "The model is the mean of its rules by their strengths. Whether each rule holds by itself is "
    "measured on the rows of the log, in standard deviations (sd) of what the rules were taught. "
    'The page "What to believe of a rule" of the documentation says more.'
)


class Block(NamedTuple):
    """Part of a section: a "text", "warn", "soft" or "heading", a "table", "pictures", "details".

    ``title`` is the caption of a table, or what stands in front of details until they are opened.
    """

    kind: str
    content: Any
    title: str = ""
    is_open: bool = False


def report_page(calibration, title, options=None):
    """The report of a calibration, as the text of an HTML file; ``options`` a ReportOptions."""
    results = Results(calibration, options)
    recipe, verdict = calibration.recipe, calibration.verdict
    what = "Arcsine law and fuzzy rules" if recipe.physics else "Fuzzy rules (ANFIS)"
    target = "rate" if recipe.physics else "rate error"
    inputs = ", ".join(map(_words, recipe.inputs))
    cautions = calibration.cautions_in(results.symbol, RATE_UNITS[results.unit])
    sections = [_identity, _check, _instead, _merit, _pictures, _use, _sure, _rules, _reading, _log]
    kept = verdict.model_is_worth_it and all(check.result == "pass" for check in results.checks)
    return _template().render(
        title=f"Gyro compensation: {title}",
        subtitle=f"{what} that predict the gyro's {target} from {inputs}.",
        verdict=headline(calibration, results.unit)[0],
        verdict_kind="good" if kept else "bad",
        reasons=map(signs, _reasons(results)),
        cautions=[f"Warning: {sentence}" for sentence in cautions],
        cards=_cards(results),
        sections=[section for make in sections if (section := make(results))],
        footer=f"Made by {_programs()}. Figures of merit in the terms of IEEE Std 952.",
    )


def check_installed():
    """ImportError where the report could not be made: at the end that would be found out late."""
    for name in ("matplotlib", "jinja2"):
        try:
            __import__(name)
        except ImportError as error:
            raise ImportError(f"the report needs {name}: pip install {name}") from error
        except ValueError as error:
            # Of matplotlib's settings; MPLBACKEND is one.
            reason = printable(str(error).partition(";")[0])
            raise ImportError(f"{name} cannot be imported: {reason}.") from error


def _template():
    try:
        from jinja2 import Environment
    except ImportError as error:
        raise ImportError("the report needs jinja2: pip install jinja2") from error
    environment = Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, finalize=_without_hidden_signs
    )
    source = resources("skanfis.gyro").joinpath("report.html.jinja").read_text(encoding="utf-8")
    return environment.from_string(source)


def _without_hidden_signs(value):
    """Text for the page; what the template has made of it already stays as it is."""
    if hasattr(value, "__html__"):
        return value
    return "\n".join(map(printable, str(value).split("\n")))


def _reasons(results):
    """Why the verdict is as it is, and whether the specification is kept."""
    yield headline(results.calibration, results.unit)[1]
    if results.checks:
        told = Counter(check.result for check in results.checks)
        parts = [f"{told['pass']} of {len(results.checks)} limits are kept"]
        for result, words in (("fail", "not kept"), ("not measured", "could not be measured")):
            names = [_words(c.limit.figure) for c in results.checks if c.result == result]
            parts += [f"{words}: {', '.join(names)}"] if names else []
        yield f"Specification: {'; '.join(parts)}."
    if not results.calibration.verdict.model_is_worth_it:
        yield (
            "The files of this calibration hold the fuzzy rules all the same, and what follows is "
            'about them; "What to use instead" has the simpler compensation.'
        )
    if results.readability.findings:
        yield 'The rules are not fit to be read one by one: "Can the rules be read?" says why.'


def _cards(results):
    """What, value, and a remark: the error before and after, on the same rows."""
    calibration, errors = results.calibration, results.calibration.verdict.rms
    simpler = [name for name in errors if name in ARTICLES and name != NOTHING]
    best = min(simpler, key=errors.get)
    before, after = rms(results.error_before), rms(results.error_after)
    worst = np.abs(results.error_after).max()
    unit, beside = results.symbol, _times(errors[NOTHING], errors[best])
    cards = [
        ("RMS error before", f"{results.shown(before)} {unit}", "the same held-out rows in range"),
        ("RMS error after", f"{results.shown(after)} {unit}", "held-out rows in range"),
        ("Reduction", _times(before, after), f"{ARTICLES[best]} alone: {beside}"),
        ("Largest error after", f"{results.shown(worst)} {unit}", "same rows"),
        ("Rules", str(calibration.rules[-1].n_rules_), _terms_text(calibration.choice.terms)),
    ]
    beyond = ~calibration.inside & np.isfinite(calibration.after)
    if beyond.any():
        remark = f"{beyond.mean():.1%} of the held-out rows, all flagged"
        error = rms((calibration.after - results.rate)[beyond])
        cards.append(("RMS out of range", f"{results.shown(error)} {unit}", remark))
    return cards


def _identity(results):
    """What is needed to find this calibration again, and to repeat it."""
    options = results.options
    entries = {
        "device, serial number": options.serial or "not given",
        "operator": options.operator or "not given",
        "made": options.made or "not given",
        "program": _programs(),
    }
    blocks = [_table(["what", "entry"], entries.items())]
    if options.files:
        lines = [(name, f"{n_bytes:,}", digest) for name, n_bytes, digest in options.files]
        blocks.append(_table(["file of the log", "bytes", "SHA-256"], lines))
    text = f"Errors and biases are in {results.symbol} throughout, and rates of the table in °/s."
    return "This calibration", [*blocks, Block("soft", text)]


def _check(results):
    """How it was checked, and what is simpler on the same rows."""
    calibration, verdict = results.calibration, results.calibration.verdict
    text = (
        "Every row was compensated by a model that had not seen its group: "
        f"{calibration.split.sentence}. {_CHECKED}"
    )
    blocks = [Block("text", text)]
    if calibration.is_thinned:
        text = (
            f"Of the log's {calibration.n_rows:,} rows {len(calibration.log):,} were kept, drawn "
            "at random from every stretch of every run, with those at the ends of the ranges. "
            "Figures that need every row, of bias stability and Allan's deviation, are left out."
        )
        blocks.append(Block("text", text))
    if calibration.fold_choices is not None:
        found = Counter(_terms_text(choice.terms) for choice in calibration.fold_choices)
        several = ", ".join(f"{text} in {count}" for text, count in found.most_common())
        text = (
            "Within each fold the structure was chosen from the fold's training rows alone: "
            f"{several} of {len(calibration.fold_choices)} folds. The final model has "
            f"{_terms_text(calibration.choice.terms)}."
        )
        blocks.append(Block("text", text))
    blocks += [Block("warn", message) for message in calibration.warnings]
    text = (
        "On the same folds, held-out rows in range and inputs. What this model is better by is the "
        f"ratio of RMS errors, as the geometric mean over {held_out_groups(calibration)}, with its "
        "95 % interval by Student's t. Recommended is the simplest that no more elaborate one "
        "beats decisively: with an interval above 1.02."
    )
    blocks += [Block("heading", "Beside simpler compensations"), Block("soft", text)]
    lines = []
    for name, error in verdict.rms.items():
        gain, better, interval = verdict.gains.get(name), "–", ""
        if gain is not None:
            better, interval = f"{figures(gain.factor)} ×", _interval(gain.low, gain.high)
        use = "recommended" if name == verdict.recommended else ""
        factor = _times(verdict.rms[NOTHING], error)
        lines.append((name, results.shown(error), factor, better, interval, use))
    error = f"RMS error [{results.symbol}]"
    head = ["compensation", error, "reduction", "this model better by", "95 % interval", "result"]
    blocks.append(_table(head, lines))
    for simple in calibration.simpler:
        if simple.missing:
            blocks.append(Block("soft", f"{simple.name}: {simple.missing}"))
    return "How it was checked", blocks


def _instead(results):
    """The simpler compensation, where that is the one to use: what to compute."""
    calibration, name = results.calibration, results.calibration.verdict.recommended
    if calibration.verdict.model_is_worth_it:
        return None
    if name == NOTHING:
        factor = calibration.compensator.scale_factor
        text = f"The indicated rate as it is: rate = output / {factor:.9g} [deg/s]."
        return "What to use instead", [Block("text", text)]
    text = (
        f"{ARTICLES[name].capitalize()}, fitted to the same rows as the final model; rates in "
        "deg/s, inputs in the units of the range of the calibration below."
    )
    formula = Block("details", formula_of(calibration, name), "What to compute", is_open=True)
    blocks = [Block("text", text), formula]
    if wanted := options_for(name, calibration.X.shape[1]):
        text = f"The command writes its files, C code included, with {wanted}: a single rule is a "
        blocks.append(Block("text", text + "straight line."))
    return "What to use instead", blocks


def _merit(results):
    """The table for all rows in range, the limits, and one line per held-out group."""
    table = results.merit
    whole = table[(table["group"] == "all") & ~table["figure"].isin(_COUNTS)]
    known = whole[whole[["before", "after"]].notna().any(axis=1)]
    lines = []
    for _, line in known.iterrows():
        cells = [
            cell
            for side in ("before", "after")
            for cell in (_shown(line[side]), _interval(line[f"{side}_low"], line[f"{side}_high"]))
        ]
        lines.append((_words(line["figure"]), *cells, signs(line["unit"])))
    resampled = table.attrs["resampled"]["all"]
    head = ["figure", "before", "95 % interval", "after", "95 % interval", "unit"]
    blocks = [_table(head, lines, f"Intervals by resampling {resampled}")]
    for note, part in whole[whole["note"] != ""].groupby("note", sort=False):
        blocks.append(Block("soft", f"{', '.join(map(_words, part['figure']))}: {note}"))
    if results.checks:
        blocks += [Block("heading", "Limits of the specification"), _specification(results)]
    groups = table[table["group"] != "all"]
    if len(groups):
        blocks += _by_group(results, groups)
    return "Figures of merit", blocks


def _specification(results):
    lines = []
    for limit, value, result, remark in results.checks:
        low, high = figures(limit.low), figures(limit.high)
        required = f"{low} to {high}"
        if limit.low == -limit.high:
            required = f"size at most {high}"
        elif np.isinf(limit.high):
            required = f"at least {low}"
        elif np.isinf(limit.low):
            required = f"at most {high}"
        if not limit.text.endswith(limit.unit):
            required += f" ({signs(limit.text)})"  # typed in another unit than the report's
        unit = signs(limit.unit)
        lines.append((_words(limit.figure), required, _shown(value), unit, result, remark))
    caption = "After compensation by the fuzzy rules, on the held-out rows in range"
    return _table(["figure", "required", "after", "unit", "result", "remark"], lines, caption)


def _by_group(results, groups):
    kind = results.calibration.split.kind.split("+")[0]
    after = groups.pivot(index="group", columns="figure", values="after")
    before = groups[groups["figure"] == "residual_rms"].set_index("group")["before"]
    lines = []
    for group in groups["group"].unique():
        line = after.loc[group]
        factor = line["reduction_factor"]
        errors = [before[group], line["residual_rms"], line["residual_peak"]]
        reduction = f"{figures(factor)} ×" if np.isfinite(factor) else "–"
        counts = [f"{line[name]:,.0f}" for name in ("rows", "rows_refused")]
        lines.append((group, *counts, *map(_shown, errors), reduction))
    unit = results.symbol
    errors = [f"RMS before [{unit}]", f"RMS after [{unit}]", f"peak after [{unit}]"]
    head = [kind, "rows", "out of range", *errors, "reduction"]
    return [Block("heading", f"By held-out {kind}"), _table(head, lines)]


def _pictures(results):
    found = [picture for plan in PICTURES if (picture := draw(plan, results)) is not None]
    blocks = [Block("pictures", found)]
    if isinstance(results.of_allan, str):
        blocks.append(Block("soft", f"Allan deviation: {results.of_allan}."))
    return "Pictures", blocks


def _use(results):
    """The box of the calibration, and what lies beyond."""
    calibration = results.calibration
    compensator, recipe = calibration.compensator, calibration.recipe
    policy = "no rate is given"
    if recipe.outside != "nan":
        policy = policy_in_words(recipe.outside, calibration.rules[-1].model_.max_extrapolation)
    text = (
        f"Outside the ranges below, input by input, a row is flagged (status 1) and {policy}. "
        "Inside them, rows near which there are hardly any data "
        f"(coverage below {compensator.min_coverage:g}) are flagged too (status 4). The C code "
        "that --c writes flags the same rows with the same numbers."
    )
    ends = calibration.X.agg(["min", "max"]).T
    blocks = [Block("text", text), _box(calibration, ends.index, ends.to_numpy())]
    if (picture := draw_coverage(calibration)) is not None:
        blocks.append(Block("pictures", [picture]))
    return "Where it may be used", blocks


def _sure(results):
    """The uncertainty budget, and the bounds over a box of inputs."""
    calibration, budget, certain = results.calibration, results.budget, results.certain
    between = f"between the means of the {held_out_groups(calibration)}"
    if not np.isfinite(budget.scatter):
        between = "not known: fewer than two held-out groups have rows in range"
    posterior = "posterior of the rules, RMS over the rows"
    if np.isnan(budget.model):
        posterior = "not known: the rules have too many parameters"
    ends = _interval(budget.scatter_low, budget.scatter_high, results.shown)
    lines = [
        ("noise", results.shown(budget.noise), "", "of a row, within its group"),
        ("not repeatable", results.shown(budget.scatter), ends, between),
        ("model", results.shown(budget.model), "", posterior),
        ("combined", results.shown(budget.combined), "", "root of the sum of squares"),
        ("for comparison", results.shown(rms(results.error_after)), "", "RMS error, held-out rows"),
    ]
    head = ["part", f"standard deviation [{results.symbol}]", "95 % interval", "meaning"]
    caption = "Of one compensated row in range, in a group that the model has not seen"
    size, place = certain.attained
    names = certain.found.input_names
    at = ", ".join(
        f"{_words(name)} {value:.5g} {_unit_of(calibration, name)}"
        for name, value in zip(names, _rounded(place), strict=True)
    )
    what = (
        "addition of the rules to the arcsine law" if calibration.recipe.physics else "compensation"
    )
    proven = [
        (f"largest {what}, proven", f"{results.shown(certain.largest)} {results.symbol}", ""),
        ("largest that was met", f"{results.shown(size)} {results.symbol}", f"at {at}"),
    ]
    if certain.rate_rises is not None:
        told = "proven" if certain.rate_rises else "not proven"
        proven.append(("the compensated rate follows the output, never against it", told, ""))
    return "How sure", [
        _table(head, lines, caption),
        Block("soft", _BUDGET),
        Block("heading", "What is proven"),
        _table(["over the box below", "result", "remark"], proven),
        _box(calibration, names, _rounded(certain.found.box)),
        Block("soft", _PROOF),
    ]


def _rules(results):
    """The rules in pictures and as text."""
    calibration, blocks = results.calibration, []
    if calibration.recipe.physics:
        law = law_table(calibration.compensator.estimator.base_, calibration.recipe)
        text = "The rules give what the arcsine law leaves of the rate; its prediction is added."
        blocks += [Block("text", text), Block("details", law, "The arcsine law")]
    if (picture := draw_memberships(calibration)) is not None:
        blocks.append(Block("pictures", [picture]))
    text, steps = rules_text(calibration, results.readability), on_board(calibration.compensator)
    blocks.append(Block("details", text, "All rules as text"))
    return "The rules", [*blocks, Block("details", steps, "What to compute on board")]


def _reading(results):
    """Whether the rules can be read one by one."""
    found = results.readability
    blocks = [Block("text", _ALONE), *(Block("warn", sentence) for sentence in found.findings)]
    if not found.findings:
        text = "Nothing measured here speaks against reading the rules one by one."
        blocks.append(Block("text", text))
    lines = [
        (_READING.get(name, _words(name)), figures(value), f"{found.limits.get(name, '–')}")
        for name, value in found.summary.items()
        if np.isfinite(value)
    ]
    return "Can the rules be read?", [*blocks, _table(["figure", "value", "limit"], lines)]


def _log(results):
    """The log: its size, ranges and scale factor; and the options of the command."""
    calibration, rows = results.calibration, results.log
    counts = {"rows": calibration.n_rows}
    if calibration.is_thinned:
        counts["rows kept, drawn at random"] = len(rows)
    if calibration.n_fit_rows < len(rows):
        counts["rows fitted to, chosen at random"] = calibration.n_fit_rows
    counts |= {f"{name}s": rows[name].nunique() for name in ("run", "device") if name in rows}
    lines = [(name, f"{count:,}", "") for name, count in counts.items()]
    for name in ("temperature", "rate", "output"):
        unit = "°/s" if name == "rate" else _unit_of(calibration, name)
        lines.append((name, f"{rows[name].min():.5g} to {rows[name].max():.5g}", unit))
    if calibration.recipe.output_unit in SIGNALS:
        unit = f"{calibration.recipe.output_unit} per °/s"
        lines.append(("scale factor", f"{calibration.compensator.scale_factor:.8g}", unit))
    blocks = [_table(["quantity", "value", "unit"], lines)]
    if results.options.options:
        text = "\n".join(f"{name}: {value}" for name, value in results.options.options)
        blocks.append(Block("details", text, "Options of the command"))
    return "The log and the options", blocks


def _box(calibration, names, ends):
    lines = [
        (_words(name), f"{low:.5g}", f"{high:.5g}", _unit_of(calibration, name))
        for name, (low, high) in zip(names, ends, strict=True)
    ]
    return _table(["input", "from", "to", "unit"], lines)


def _table(head, lines, caption=""):
    return Block("table", pd.DataFrame(list(lines), columns=head), caption)


def _interval(low, high, shown=figures):
    return f"[{shown(low)}, {shown(high)}]" if np.isfinite([low, high]).all() else ""


def _shown(value):
    return figures(value) if np.isfinite(value) else "–"


def _times(before, after):
    return f"{figures(before / after if after else float('inf'))} ×"


def _rounded(values):
    """What rounding leaves of zero, where a box is in the units before a scaler, is zero."""
    return np.round(values, 9) + 0.0


def _words(name):
    return name.replace("_", " ")


def _unit_of(calibration, name):
    return signs(_UNITS.get(name, calibration.recipe.output_unit))


def _terms_text(terms):
    """Numbers of fuzzy terms in words."""
    return f"terms {' × '.join(map(str, terms))}" if terms else "structure left to ANFISRegressor"


def _programs():
    """The programs that figures depend on, with their versions."""
    return (
        f"skanfis {__version__} with scikit-learn {sklearn.__version__}, NumPy {np.__version__}, "
        f"SciPy {scipy.__version__} and Python {platform.python_version()}"
    )
