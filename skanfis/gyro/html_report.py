"""Write the report of a calibration as one HTML page: verdict, tables, pictures, rules, limits."""

import platform
from importlib.resources import files as resources
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import scipy
import sklearn

from .. import __version__
from ..digits import counted
from ..inspection.labels import printable
from ..policies import SILENT, policy_in_words
from ._columns import SIGNALS
from ._headline import (
    ARTICLES,
    against_reading,
    flagged_text,
    headline,
    held_out_groups,
    proven_bounds,
    rules_text,
    written_text,
)
from ._simpler import NAMES, NOTHING
from .c_code import LAW_GOES_ON
from .c_compensator import input_units, notes_on
from .compose import rules_of
from .displays import signs, three_digits
from .metrics import rms

# Figures on the first page, with a picture; the others follow.
_FIRST = (
    "residual_rms", "residual_peak", "reduction_factor", "bias", "bias_temperature_sensitivity",
    "hysteresis", "scale_factor_error", "scale_factor_nonlinearity",
)  # fmt: skip
_ON_FIRST_PAGE = "error-by-temperature"
# Names of the figures in the standards; docs/gyro_metrics.rst says how each is computed.
_TERMS = {
    "scale_factor_error": "scale factor error (528, 1780)",
    "scale_factor_nonlinearity": "linearity error, largest (528, 952)",
    "scale_factor_nonlinearity_rms": "linearity error, RMS (528, 952)",
    "scale_factor_asymmetry": "asymmetry error (528, 952)",
    "scale_factor_repeatability": "scale factor repeatability (528, 952, 1780)",
    "scale_factor_temperature_sensitivity": "scale factor temperature sensitivity (952)",
    "bias": "bias (528, 952, 1780)",
    "bias_repeatability": "bias repeatability (528, 952, 1780)",
    "bias_temperature_sensitivity": "bias temperature sensitivity, D_T (952)",
    "bias_ramp_sensitivity": "bias temperature ramp sensitivity, D_Tdot (952)",
    "hysteresis": "hysteresis error (528)",
    "angle_random_walk": "angle random walk, N (528, 952)",
    "bias_instability": "bias instability, B (528, 952)",
    "rate_random_walk": "rate random walk, K (528, 952)",
}
_PROOF = (
    "This holds for the compensator, at every point in the range of the calibration. It does not "
    "say how well the compensator fits the gyro."
)


class Block(NamedTuple):
    """Part of a section: text, warn, soft, heading, table, pictures, or details, closed or open."""

    kind: str
    content: Any
    title: str = ""


def report_page(results, title):
    """The report of a calibration, as the text of an HTML file; ``results`` a Results."""
    calibration = results.calibration
    recipe, name = calibration.recipe, calibration.written
    what = "Arcsine law and fuzzy rules" if recipe.physics else "Fuzzy rules (ANFIS)"
    what = what if calibration.writes_model else ARTICLES[name].capitalize()
    target = "rate" if calibration.compensator.predicts == "rate" else "rate error"
    cautions = [f"Warning: {signs(told)}" for told in calibration.cautions(results.unit)]
    if recipe.assumed:
        cautions.append(f"Units assumed: {'; '.join(recipe.assumed.values())}.")
    sections = (_check, _merit, _pictures, _sure, _written, _use, _log)
    kept = calibration.verdict.recommended != NOTHING
    kept = kept and all(check.result == "pass" for check in results.checks)
    verdict, *reasons = headline(calibration, results.unit)
    if results.checks:
        reasons.append(f"Specification: {specification(results.checks)}.")
    reasons.append(f"The files, and the figures below, are of {written_text(calibration)}.")
    return _template().render(
        title=f"Gyro compensation: {title}",
        subtitle=f"{what}: the gyro's {target} from "
        f"{', '.join(map(_words, calibration.compensator.inputs))}.",
        verdict=verdict,
        verdict_kind="good" if kept else "bad",
        reasons=map(signs, reasons),
        cautions=cautions,
        first=[_summary(results), _identity(results)],
        sections=[make(results) for make in sections],
        footer=f"Made by skanfis {__version__} with scikit-learn {sklearn.__version__}, NumPy "
        f"{np.__version__}, SciPy {scipy.__version__} and Python {platform.python_version()}. "
        "Figures of merit in the terms of IEEE Std 528-2019, 952 and 1780-2022; see their table.",
    )


def check_installed(pdf=False):
    """Raise ImportError if a package for the report is missing, before the long calibration."""
    for name in ("matplotlib", "jinja2", *(["weasyprint"] if pdf else [])):
        try:
            __import__(name)
        except (ImportError, OSError) as error:
            # OSError comes from Pango, which draws the text of a PDF.
            reason = printable(str(error)).partition("\n")[0]
            told = f"the report needs {name}: pip install {name} ({reason})"
            raise ImportError(told + pdf * "; or print report.html from a browser") from error


def _template():
    check_installed()
    from jinja2 import Environment

    environment = Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, finalize=_without_hidden_signs
    )
    source = resources("skanfis.gyro").joinpath("report.html.jinja").read_text(encoding="utf-8")
    return environment.from_string(source)


def _without_hidden_signs(value):
    """Text for the page; text that is markup already stays as it is."""
    if hasattr(value, "__html__"):
        return value
    return "\n".join(map(printable, str(value).split("\n")))


def specification(checks):
    """How many limits are kept, and which are not."""
    n_kept = sum(check.result == "pass" for check in checks)
    parts = [f"{n_kept} of {counted(len(checks), 'limit')} kept"]
    for result, words in (("fail", "not kept"), ("not measured", "could not be measured")):
        names = [_words(check.limit.figure) for check in checks if check.result == result]
        parts += [f"{words}: {', '.join(names)}"] if names else []
    return "; ".join(parts)


def _summary(results):
    """For readers of one page: the figures that count, and where they hold."""
    calibration, figures = results.calibration, results.merit.set_index("figure")
    known = figures.reindex(_FIRST)[["before", "after", "unit"]].dropna(subset="after")
    lines = [
        (_words(name), three_digits(before), three_digits(after), signs(unit))
        for name, before, after, unit in known.itertuples()
    ]
    first = [each for name, each in results.pictures.items() if name == _ON_FIRST_PAGE]
    blocks = [
        _table(["figure", "before", "after", "unit"], lines, "On held-out rows in range"),
        Block("soft", flagged_text(calibration)),
        _box(calibration, "It may be used from"),
        Block("pictures", first),
    ]
    return "Summary", blocks


def _identity(results):
    """What identifies this calibration, and is needed to repeat it."""
    names = {"serial": "device, serial number", "operator": "operator", "made": "made"}
    lines = [(name, results.entries.get(key) or "not given") for key, name in names.items()]
    blocks = [_table(["what", "entry"], lines)]
    if results.files:
        blocks.append(_table(["file of the log", "bytes", "SHA-256"], results.files))
    text = f"Errors and biases are in {results.symbol} throughout, and rates of the table in °/s."
    blocks.append(Block("soft", text))
    if results.typed:
        blocks.append(Block("details", results.typed, "Options of the command"))
    return "This calibration", blocks


def _check(results):
    """How the calibration was checked, and simpler compensations on the same rows."""
    calibration, verdict = results.calibration, results.calibration.verdict
    text = (
        "Every row was compensated by a model that had not seen its group: "
        f"{calibration.split.sentence}. A row outside the range of that model's training data is "
        "flagged, as it would be on board. All figures and pictures are of the rows in range."
    )
    blocks = [Block("text", text)]
    beyond = ~calibration.inside & np.isfinite(calibration.after)
    if beyond.any():
        error = results.shown(rms((calibration.after - results.rate)[beyond]))
        text = f"On the flagged rows the RMS error after is {error} {results.symbol}."
        blocks.append(Block("text", text))
    blocks += [Block("warn", message) for message in calibration.warnings]
    text = (
        'All on the same held-out rows in range. "This model" is the fuzzy rules. It is better by '
        "as many times as the other's RMS error is larger, in the geometric mean over "
        f"{held_out_groups(calibration)}. Recommended is the simplest compensation that no simpler "
        "one beats, and no more elaborate one by 2 %, interval included."
    )
    blocks += [Block("heading", "Beside simpler compensations"), Block("soft", text)]
    lines = []
    for name, error in verdict.rms.items():
        gain, better, interval = verdict.gains.get(name), "–", ""
        if gain is not None:
            better, interval = f"{three_digits(gain.factor)} ×", _interval(gain.low, gain.high)
        use = "recommended" if name == verdict.recommended else ""
        factor = verdict.rms[NOTHING] / error if error else np.inf
        lines.append(
            (name, results.shown(error), f"{three_digits(factor)} ×", better, interval, use)
        )
    error = f"RMS error [{results.symbol}]"
    head = ["compensation", error, "reduction", "this model better by", "95 % interval", "result"]
    missing = [simple for simple in calibration.simpler if simple.missing]
    notes = [Block("soft", f"{simple.name}: {simple.missing}") for simple in missing]
    return "How it was checked", [*blocks, _table(head, lines), *notes]


def _merit(results):
    table, lines = results.merit, []
    for _, line in table[table[["before", "after"]].notna().any(axis=1)].iterrows():
        cells = []
        for side in ("before", "after"):
            value, low, high = (line[f"{side}{end}"] for end in ("", "_low", "_high"))
            cells += [three_digits(value), _interval(low, high)]
        name, unit = line["figure"], signs(line["unit"])
        lines.append((_words(name), *cells, unit, _TERMS.get(name, "none")))
    head = ["figure", "before", "95 % interval", "after", "95 % interval", "unit", "IEEE term"]
    blocks = [_table(head, lines, f"Intervals by resampling {table.attrs['resampled']}")]
    for note, part in table[table["note"] != ""].groupby("note", sort=False):
        blocks.append(Block("soft", f"{', '.join(map(_words, part['figure']))}: {note}"))
    if results.checks:
        checks = [
            (_words(limit.figure), limit.number, three_digits(value), signs(limit.unit), *told)
            for limit, value, *told in results.checks
        ]
        caption = "After compensation, on the held-out rows in range"
        head = ["figure", "required", "after", "unit", "result", "remark"]
        blocks += [Block("heading", "Limits of the specification"), _table(head, checks, caption)]
    return "Figures of merit", blocks


def _pictures(results):
    others = [each for name, each in results.pictures.items() if name != _ON_FIRST_PAGE]
    blocks = [Block("pictures", others)]
    if results.no_allan:
        blocks.append(Block("soft", f"Allan deviation: {results.no_allan}."))
    return "Pictures", blocks


def _use(results):
    calibration = results.calibration
    compensator = calibration.compensator
    model = rules_of(compensator.estimator).model
    policy = policy_in_words(model.out_of_bounds, model.max_extrapolation)
    if compensator.predicts == "rate" and model.out_of_bounds not in SILENT:
        added = f"; in what is added, {policy}" if model.coefficients.any() else ""
        policy = f"{LAW_GOES_ON}{added}"
    text = (
        f"A row with an input outside its range below is flagged (status 1): {policy}. A row "
        "near which there are hardly any calibration data "
        f"(coverage below {compensator.min_coverage:g}) is flagged too (status 4). The C code "
        "that --c writes flags the same rows with the same numbers."
    )
    pictures = Block("pictures", list(results.coverage()))
    return "Where it may be used", [Block("text", text), _box(calibration), pictures]


def _sure(results):
    calibration = results.calibration
    largest, rate_rises = proven_bounds(calibration)
    added = calibration.compensator.predicts == "rate"
    if largest == 0.0:
        what = "added to the arcsine law" if added else "subtracted"
        text = f"Nothing is {what}, so there is nothing to bound."
        return "What is proven", [Block("text", text)]
    what = "addition to the arcsine law" if added else "compensation"
    proven = [(f"largest {what}, proven", f"{results.shown(largest)} {results.symbol}")]
    if rate_rises is not None:
        told = "proven" if rate_rises else "not proven"
        proven.append(("the compensated rate rises and falls as the indicated one does", told))
    table = _table(["in the range of the calibration", "result"], proven)
    return "What is proven", [table, Block("soft", _PROOF)]


def _written(results):
    """The written compensation: a formula, or rules in pictures and text, with cautions."""
    calibration, name = results.calibration, results.calibration.written
    if not calibration.writes_model:
        text = (
            f"{ARTICLES[name].capitalize()}, fitted to the same rows as the final model. --write "
            f"chooses another, with a report of its own: rules, {', '.join(NAMES)}."
        )
        formula = Block("open", rules_text(calibration), "What to compute")
        return "What is written", [Block("text", text), formula, _on_board(calibration)]
    against = against_reading(calibration)
    n_rules = counted(calibration.rules[-1].n_rules_, "rule")
    fit = "Nothing measured here speaks against reading the rules one by one."
    return "The rules", [
        Block("pictures", list(results.memberships())),
        Block("details", rules_text(calibration), f"All rules as text ({n_rules})"),
        _on_board(calibration),
        Block("heading", "Can the rules be read?"),
        *([Block("warn", sentence) for sentence in against] or [Block("text", fit)]),
    ]


def _on_board(calibration):
    notes = ["y[0] is the output of the C code.", *notes_on(calibration.compensator)]
    return Block("details", "\n".join(notes), "What to compute on board")


def _log(results):
    calibration, rows = results.calibration, results.log
    counts = {"rows": len(rows)}
    if calibration.n_fit_rows < len(rows):
        counts["rows fitted to, chosen at random"] = calibration.n_fit_rows
    counts |= {f"{name}s": rows[name].nunique() for name in ("run", "device") if name in rows}
    lines = [(name, f"{count:,}", "") for name, count in counts.items()]
    for name in ("temperature", "rate", "output"):
        ends = f"{rows[name].min():.5g} to {rows[name].max():.5g}"
        lines.append((name, ends, _unit_of(calibration, name)))
    if calibration.recipe.output_unit in SIGNALS:
        unit = f"{calibration.recipe.output_unit} per °/s"
        lines.append(("scale factor", f"{calibration.compensator.scale_factor:.8g}", unit))
    return "The log", [_table(["quantity", "value", "unit"], lines)]


def _box(calibration, caption=""):
    X = calibration.X[list(calibration.compensator.inputs)]
    lines = [
        (_words(name), f"{low:.5g}", f"{high:.5g}", _unit_of(calibration, name))
        for name, low, high in X.agg(["min", "max"]).T.itertuples()
    ]
    return _table(["input", "from", "to", "unit"], lines, caption)


def _table(head, lines, caption=""):
    return Block("table", pd.DataFrame(list(lines), columns=head), caption)


def _interval(low, high):
    return f"[{three_digits(low)}, {three_digits(high)}]" if np.isfinite(low + high) else ""


def _words(name):
    return name.replace("_", " ")


def _unit_of(calibration, name):
    return signs(input_units(calibration.compensator)[name])
