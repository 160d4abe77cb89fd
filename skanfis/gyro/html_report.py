"""Write the report of a calibration as one HTML page: verdict, tables, pictures, rules, limits.

The sentences of the page are in ``report.html.jinja``; here are the functions that it calls.
"""

import platform
from importlib.resources import files as resources

import numpy as np
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


def report_page(results, title):
    """The report of a calibration, as the text of an HTML file; ``results`` a Results."""
    pictures = dict(results.pictures)
    return _template().render(
        title=title,
        results=results,
        calibration=results.calibration,
        recipe=results.calibration.recipe,
        compensator=results.calibration.compensator,
        first=[pictures.pop(name) for name in (_ON_FIRST_PAGE,) if name in pictures],
        others=list(pictures.values()),
        simpler_names=NAMES,
        versions=f"skanfis {__version__} with scikit-learn {sklearn.__version__}, NumPy "
        f"{np.__version__}, SciPy {scipy.__version__} and Python {platform.python_version()}",
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
    from jinja2 import Environment, StrictUndefined

    environment = Environment(
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_without_hidden_signs,
        undefined=StrictUndefined,
    )
    environment.filters |= {"words": _words, "signs": signs}
    environment.globals |= {function.__name__: function for function in _CALLED}
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


def what(calibration):
    """What is written, as the subject of a sentence."""
    if not calibration.writes_model:
        return ARTICLES[calibration.written].capitalize()
    return "Arcsine law and fuzzy rules" if calibration.recipe.physics else "Fuzzy rules (ANFIS)"


def is_good(results):
    """Whether a compensation is recommended, and all limits are kept."""
    is_kept = all(check.result == "pass" for check in results.checks)
    return is_kept and results.calibration.verdict.recommended != NOTHING


def summary(results):
    """Rows on the figures that count, for readers of one page: name, before, after, unit."""
    known = results.merit.set_index("figure").reindex(_FIRST).dropna(subset="after")
    for name, before, after, unit in known[["before", "after", "unit"]].itertuples():
        yield _words(name), three_digits(before), three_digits(after), signs(unit)


def flagged_error(results):
    """The RMS error of held-out rows out of range, if they have rates; else empty."""
    calibration = results.calibration
    error = calibration.after - calibration.rate
    beyond = ~calibration.inside & np.isfinite(error)
    return results.shown(rms(error[beyond])) if beyond.any() else ""


def compensations(results):
    """Rows on the compensations: name, error, reduction, how much better the model is, use."""
    verdict = results.calibration.verdict
    for name, error in verdict.rms.items():
        gain, better, ends = verdict.gains.get(name), "–", ""
        if gain is not None:
            better, ends = f"{three_digits(gain.factor)} ×", _interval(gain.low, gain.high)
        use = "recommended" if name == verdict.recommended else ""
        factor = verdict.rms[NOTHING] / error if error else np.inf
        yield name, results.shown(error), f"{three_digits(factor)} ×", better, ends, use


def merit(results):
    """Rows on the figures that the log gives: name, both values with intervals, unit, term."""
    table = results.merit
    for _, line in table[table[["before", "after"]].notna().any(axis=1)].iterrows():
        cells = []
        for side in ("before", "after"):
            value, low, high = (line[f"{side}{end}"] for end in ("", "_low", "_high"))
            cells += [three_digits(value), _interval(low, high)]
        name = line["figure"]
        yield _words(name), *cells, signs(line["unit"]), _TERMS.get(name, "none")


def merit_notes(results):
    """Why figures or intervals are missing, one sentence for all with the same reason."""
    table = results.merit
    for note, part in table[table["note"] != ""].groupby("note", sort=False):
        yield f"{', '.join(map(_words, part['figure']))}: {note}"


def limits(results):
    """Rows on the limits: figure, limit, value, unit, result, remark."""
    for limit, value, *told in results.checks:
        yield _words(limit.figure), limit.number, three_digits(value), signs(limit.unit), *told


def proven(results):
    """Rows on what is proven of the compensation; none if it is zero."""
    largest, rate_rises = proven_bounds(results.calibration)
    if largest == 0.0:
        return
    added = results.calibration.compensator.predicts == "rate"
    name = "addition to the arcsine law" if added else "compensation"
    yield f"largest {name}, proven", f"{results.shown(largest)} {results.symbol}"
    if rate_rises is not None:
        told = "proven" if rate_rises else "not proven"
        yield "the compensated rate rises and falls as the indicated one does", told


def policy(compensator):
    """What a row outside the range gets, as a clause."""
    model = rules_of(compensator.estimator).model
    told = policy_in_words(model.out_of_bounds, model.max_extrapolation)
    if compensator.predicts == "error" or model.out_of_bounds in SILENT:
        return told
    return LAW_GOES_ON + (f"; in what is added, {told}" if model.coefficients.any() else "")


def box(calibration):
    """Rows on the range in which the compensator may be used: input, ends, unit."""
    X = calibration.X[list(calibration.compensator.inputs)]
    for name, low, high in X.agg(["min", "max"]).T.itertuples():
        yield _words(name), f"{low:.5g}", f"{high:.5g}", _unit_of(calibration, name)


def log(calibration):
    """Rows on what the log holds: quantity, value, unit."""
    table = calibration.log
    counts = {"rows": len(table)}
    if calibration.n_fit_rows < len(table):
        counts["rows fitted to, chosen at random"] = calibration.n_fit_rows
    counts |= {f"{name}s": table[name].nunique() for name in ("run", "device") if name in table}
    for name, count in counts.items():
        yield name, f"{count:,}", ""
    for name in ("temperature", "rate", "output"):
        ends = f"{table[name].min():.5g} to {table[name].max():.5g}"
        yield name, ends, _unit_of(calibration, name)
    if calibration.recipe.output_unit in SIGNALS:
        unit = f"{calibration.recipe.output_unit} per °/s"
        yield "scale factor", f"{calibration.compensator.scale_factor:.8g}", unit


def _words(name):
    return name.replace("_", " ")


def _interval(low, high):
    return f"[{three_digits(low)}, {three_digits(high)}]" if np.isfinite(low + high) else ""


def _unit_of(calibration, name):
    return signs(input_units(calibration.compensator)[name])


# What the template calls, by these names.
_CALLED = (
    *(against_reading, box, compensations, counted, flagged_error, flagged_text, headline),
    *(held_out_groups, is_good, limits, log, merit, merit_notes, notes_on, policy, proven),
    *(rules_text, specification, summary, what, written_text),
)
