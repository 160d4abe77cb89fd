"""The report of a calibration as one page of HTML: tables, pictures, rules, limits."""

import numpy as np
import scipy
import sklearn

from .. import __version__
from ..export import export_text
from ..export._reading import policy_in_words
from ._html import Page
from ._law_text import law_text
from ._pictures import PICTURES, draw_coverage, draw_memberships, why_no_allan
from ._reading import readability_of
from ._results import Results, rms, rules_of
from ._units import SIGNALS
from .displays._style import PER_UNIT, SYMBOL, figures
from .report import gyro_report

__all__ = ["report_page", "rules_text"]

_COUNTS = ("rows", "rows_refused", "rows_outside")
_MOST_GROUPS = 40
_UNITS = {"time": "s", "temperature": "°C", "temperature_rate": "°C/s"}
_FIGURES_OF_READING = {
    "strongest_alone": "strongest rule alone, off the model, RMS [sd]",
    "disagreement": "disagreement of the rules, RMS [sd]",
    "greatest_sum": "greatest sum of the sizes of contributions [ranges]",
    "rules_beyond": "rules whose value at their own center lies far beyond the range",
    "least_truth": "truth of the least true term",
    "greatest_crossing": "highest crossing of neighbouring terms",
}
_SIGNS = (("degC", "°C"), ("deg", "°"), ("sqrt(h)", "√h"))


def report_page(calibration, title):
    """The report of a calibration, as the text of an HTML file."""
    page = Page(f"Gyro compensation: {title}", _subtitle(calibration))
    results = Results(calibration)
    _headline(page, results)
    _check(page, results)
    _merit(page, results)
    _pictures(page, results)
    _limits(page, results)
    _rules(page, results)
    _reading(page, results)
    _data(page, results)
    page.footer(
        f"Made by skanfis {__version__} with scikit-learn {sklearn.__version__}, NumPy "
        f"{np.__version__} and SciPy {scipy.__version__}. "
        "Figures of merit in the terms of IEEE Std 952."
    )
    return page.render()


def _subtitle(calibration):
    what = "Arcsine law and fuzzy rules" if calibration.recipe.physics else "Fuzzy rules (ANFIS)"
    inputs = ", ".join(_words(name) for name in calibration.recipe.inputs)
    return f"{what} that predict the gyro's {_target(calibration)} from {inputs}."


def _target(calibration):
    return "rate" if calibration.recipe.physics else "rate error"


def _headline(page, results):
    calibration = results.calibration
    for sentence in calibration.cautions:
        page.paragraph(f"Warning: {sentence}", kind="warn")
    beyond = results.beyond
    after = results.error_after
    unit = SYMBOL[results.unit]
    other = "deg/h" if results.unit == "deg/s" else "deg/s"
    rms_after = f"{figures(PER_UNIT[other] * rms(after))} {SYMBOL[other]}"
    cards = [
        ("RMS error before", f"{results.shown(rms(results.error_before))} {unit}", "same rows"),
        (
            "RMS error after",
            f"{results.shown(rms(after))} {unit}",
            f"{rms_after}, held-out rows in range",
        ),
        ("Reduction", f"{figures(results.gain)} ×", "before over after"),
        (
            "Largest error after",
            f"{results.shown(np.abs(after).max())} {unit}",
            "held-out rows in range",
        ),
        ("Rules", f"{rules_of(calibration).n_rules_}", _terms_text(calibration)),
    ]
    if beyond.any():
        remark = f"{beyond.mean():.1%} of the held-out rows, all flagged"
        error = calibration.after[beyond] - results.rate[beyond]
        cards.append(("RMS out of range", f"{results.shown(rms(error))} {unit}", remark))
    page.cards(cards)


def _check(page, results):
    calibration = results.calibration
    page.section("How it was checked")
    page.paragraph(
        f"Every row was compensated by a model that had not seen its group: "
        f"{calibration.split.sentence}. A row outside the range of that model's training data is "
        "flagged, as it would be on board, and has a figure of its own above. The figures and "
        "pictures that follow are of the rows in range."
    )
    if calibration.recipe.terms == "search":
        page.paragraph(
            "The numbers of fuzzy terms were chosen on the same folds, from "
            f"{len(calibration.tried)} candidates: the figures are a little better than a campaign "
            "to come will give."
        )
    for message in calibration.warnings:
        page.paragraph(message, kind="warn")
    candidates = {tuple(terms or ()): found for terms, found in calibration.tried}
    best = candidates[tuple(calibration.terms or ())]
    lines = [("no compensation", rms(results.error_before)), *calibration.baselines.items()]
    lines.append((f"this model ({_terms_text(calibration)})", best))
    page.table(
        ("compensation", f"RMS error, held out [{SYMBOL[results.unit]}]"),
        [(name, results.shown(value)) for name, value in lines],
        "Beside simpler compensations, on the same folds and, for speed, on fewer rows",
    )
    if len(calibration.tried) > 1:
        text = "\n".join(
            f"{','.join(map(str, terms)):>12}  {figures(found)}"
            for terms, found in calibration.tried
        )
        page.preformatted(
            f"terms of {', '.join(calibration.recipe.inputs)}; held-out RMS error [°/s]\n{text}",
            "Structures that were tried",
        )


def _merit(page, results):
    groups = results.calibration.split.labels
    few = np.unique(groups.astype(str)).size <= _MOST_GROUPS
    report = gyro_report(
        results.rate,
        results.calibration.before,
        results.after,
        temperature=results.temperature,
        temperature_rate=results.temperature_rate,
        time=results.time,
        run=results.run,
        groups=groups if few else None,
        # At rest there is no scale factor; any full scale will do.
        full_scale=np.abs(results.rate).max() or 1.0,
        random_state=0,
    )
    page.section("Figures of merit")
    whole = report[(report["group"] == "all") & ~report["figure"].isin(_COUNTS)]
    known = whole[whole[["before", "after"]].notna().any(axis=1)]
    lines = [
        (
            _words(line["figure"]),
            _value(line, "before"),
            _value(line, "after"),
            _signs(line["unit"]),
        )
        for _, line in known.iterrows()
    ]
    resampled = report.attrs["resampled"]["all"]
    caption = f"95 % intervals in brackets, by resampling {resampled}"
    page.table(("figure", "before", "after", "unit"), lines, caption)
    for note, part in whole[whole["note"] != ""].groupby("note", sort=False):
        page.paragraph(f"{', '.join(map(_words, part['figure']))}: {note}", kind="soft")
    if few:
        _merit_by_group(page, results, report)


def _merit_by_group(page, results, report):
    kind = results.calibration.split.kind.split("+")[0]
    parts = report[report["group"] != "all"]
    after = parts.pivot(index="group", columns="figure", values="after")
    before = parts[parts["figure"] == "residual_rms"].set_index("group")["before"]
    lines = []
    for group in parts["group"].unique():
        line = after.loc[group]
        shown = [
            results.shown(before[group]),
            results.shown(line["residual_rms"]),
            results.shown(line["residual_peak"]),
            f"{figures(line['reduction_factor'])} ×",
        ]
        if line["rows"] == line["rows_refused"]:
            shown = ["–"] * len(shown)  # no row in range, no error of such rows
        lines.append((str(group), f"{line['rows']:,.0f}", f"{line['rows_refused']:,.0f}", *shown))
    unit = SYMBOL[results.unit]
    errors = (f"RMS before [{unit}]", f"RMS after [{unit}]", f"peak after [{unit}]")
    page.heading(f"By held-out {kind}")
    page.table((kind, "rows", "out of range", *errors, "reduction"), lines)


def _pictures(page, results):
    page.section("Pictures")
    page.figures([picture for draw in PICTURES if (picture := draw(results)) is not None])
    if reason := why_no_allan(results):
        page.paragraph(f"Allan deviation: {reason}.", kind="soft")


def _limits(page, results):
    calibration = results.calibration
    compensator, recipe = calibration.compensator, calibration.recipe
    page.section("Where it may be used")
    policy = "no rate is given"
    if recipe.outside != "nan":
        policy = policy_in_words(recipe.outside, recipe.max_extrapolation)
    page.paragraph(
        f"Outside the ranges below, input by input, a row is flagged (status 1) and {policy}. "
        "Inside them, rows near which there are hardly any data "
        f"(coverage below {compensator.min_coverage:g}) are flagged too (status 4)."
    )
    page.paragraph("The C code that --c writes flags the same rows with the same numbers.")
    low, high = calibration.X.min(), calibration.X.max()
    page.table(
        ("input", "from", "to", "unit"),
        [
            (_words(name), f"{low[name]:.5g}", f"{high[name]:.5g}", _unit_of(calibration, name))
            for name in calibration.X
        ],
        "Range of the calibration",
    )
    if (picture := draw_coverage(calibration)) is not None:
        page.figures([picture])


def _rules(page, results):
    calibration = results.calibration
    page.section("The rules")
    if calibration.recipe.physics:
        page.paragraph(
            "The rules give what the arcsine law leaves of the rate; the law's prediction is added."
        )
        page.preformatted(_law_table(calibration), "The arcsine law")
    if (picture := draw_memberships(calibration)) is not None:
        page.figures([picture])
    page.preformatted(rules_text(calibration), "All rules as text")
    page.preformatted(_on_board(calibration.compensator), "What to compute on board")


def _reading(page, results):
    found = readability_of(results.calibration)
    page.section("Can the rules be read?")
    page.paragraph(
        "The model is the mean of its rules by their strengths. Whether each rule holds by itself "
        "is measured on the rows of the log; standard deviation (sd) and range are those of what "
        'the rules were taught. The page "What to believe of a rule" of the documentation of '
        "skanfis says more."
    )
    for sentence in found.findings:
        page.paragraph(sentence, kind="warn")
    if not found.findings:
        page.paragraph("Nothing measured here speaks against reading the rules one by one.")
    lines = [
        (
            _FIGURES_OF_READING[name],
            f"{value:.3g}" if name == "rules_beyond" else figures(value),
            f"{found.limits[name]:g}" if name in found.limits else "–",
        )
        for name, value in found.summary.items()
        if np.isfinite(value)
    ]
    page.table(("figure", "value", "limit"), lines)


def _on_board(compensator):
    """The steps around the model, as they run on the gyro's processor."""
    arguments = ", ".join(compensator.inputs)
    lines = []
    if "temperature_rate" in compensator.inputs:
        lines += [
            "/* at power-on temperature_rate = 0, previous = temperature; then every h seconds */",
            f"temperature_rate += (1 - exp(-h / {compensator.time_constant:g}))",
            "    * ((temperature - previous) / h - temperature_rate);",
            "previous = temperature;",
        ]
    if compensator.predicts == "error":
        lines.append(f"rate = output / {compensator.scale_factor:.9g} - error({arguments});")
    else:
        lines.append(f"rate = law({arguments}) + rules({arguments});")
    return "\n".join(lines)


def rules_text(calibration):
    """The rules as sentences, after the formula of the law where there is one."""
    estimator = calibration.compensator.estimator
    if calibration.recipe.physics:
        rules = export_text(estimator.residual_, output_names=["rate beyond the law"])
        return f"{_formula(calibration)}\nTo this rate is added what the rules give.\n\n{rules}\n"
    return export_text(estimator, output_names=["error"]) + "\n"


def _data(page, results):
    calibration = results.calibration
    log = results.log
    page.section("The log")
    lines = [("rows", f"{len(log):,}", "")]
    for name in ("run", "device"):
        if name in log:
            lines.append((f"{name}s", f"{log[name].nunique():,}", ""))
    if calibration.n_fit_rows < len(log):
        lines.append(("rows fitted to, chosen at random", f"{calibration.n_fit_rows:,}", ""))
    if results.time is not None:
        lines.append(("time between rows, median", f"{results.interval:.4g}", "s"))
    ranges = {"temperature": "°C", "rate": "°/s", "output": _unit_of(calibration, "output")}
    for name, unit in ranges.items():
        lines.append((name, f"{log[name].min():.5g} to {log[name].max():.5g}", unit))
    if calibration.recipe.output_unit in SIGNALS:
        unit = f"{calibration.recipe.output_unit} per °/s"
        lines.append(("scale factor", f"{calibration.compensator.scale_factor:.8g}", unit))
    page.table(("quantity", "value", "unit"), lines)


def _value(line, which):
    value = line[which]
    if not np.isfinite(value):
        return "–"
    low, high = line[f"{which}_low"], line[f"{which}_high"]
    known = np.isfinite([low, high]).all()
    return figures(value), f"[{figures(low)}, {figures(high)}]" if known else ""


def _formula(calibration):
    law, recipe = calibration.compensator.estimator.base_, calibration.recipe
    return law_text(law, recipe.inputs, recipe.output_unit)


def _law_table(calibration):
    law = calibration.compensator.estimator.base_
    lines = [
        _formula(calibration),
        f"at {law.reference_temperature_:.6g} °C; powers of the difference, lowest first",
    ]
    for name in ("amplitude_", "sagnac_factor_", "bias_"):
        values = ", ".join(f"{value:.8g}" for value in getattr(law, name))
        lines.append(f"{_words(name.rstrip('_'))}: {values}")
    if law.temperature_rate is not None:
        lines.append(f"lag of the thermometer: {law.thermometer_lag_:.6g} s")
    return "\n".join(lines)


def _terms_text(calibration):
    if calibration.terms is None:
        return "structure left to ANFISRegressor"
    return "terms " + " × ".join(map(str, calibration.terms))


def _unit_of(calibration, name):
    return _signs(_UNITS.get(name, calibration.recipe.output_unit))


def _signs(unit):
    for name, sign in _SIGNS:
        unit = unit.replace(name, sign)
    return unit


def _words(name):
    return name.replace("_", " ")
