"""The report of a calibration as one page of HTML: tables, pictures, rules, limits."""

import numpy as np
import scipy
import sklearn

from .. import __version__
from ..export import export_text
from ..inspection import MembershipDisplay
from ._html import Page
from ._units import SIGNALS
from .compensator import features
from .displays import (
    AllanDisplay,
    CoverageDisplay,
    ErrorDisplay,
    GroupResidualDisplay,
    HysteresisDisplay,
    ResidualSurfaceDisplay,
    ScaleFactorErrorDisplay,
)
from .displays._style import PER_UNIT, SYMBOL, figures
from .report import gyro_report

__all__ = ["report_page", "rules_text"]

_PER_MINUTE = 60.0
_SMALL = 0.05  # deg/s
_CLEARLY = 0.05  # degC/min, below which a temperature neither rises nor falls
_COUNTS = ("rows", "rows_refused", "rows_outside")
_UNEVEN = 0.01
_MOST_GROUPS = 40
_MOST_ROWS_SHOWN = 20_000
_UNITS = {"time": "s", "temperature": "°C", "temperature_rate": "°C/s"}
_POLICIES = {
    "clip": "the value at the edge is held",
    "linear": "the model goes on linearly",
    "nan": "no rate is given",
}
_SIGNS = (("degC", "°C"), ("deg", "°"), ("sqrt(h)", "√h"))


def report_page(calibration, title):
    """The report of a calibration, as the text of an HTML file."""
    page = Page(f"Gyro compensation: {title}", _subtitle(calibration))
    results = _Results(calibration)
    _headline(page, results)
    _check(page, results)
    _merit(page, results)
    _pictures(page, results)
    _limits(page, results)
    _rules(page, results)
    _data(page, results)
    page.footer(
        f"Made by skanfis {__version__} with scikit-learn {sklearn.__version__}, NumPy "
        f"{np.__version__} and SciPy {scipy.__version__}. "
        "Figures of merit in the terms of IEEE Std 952."
    )
    return page.render()


class _Results:
    """What several parts of the report need.

    ``after`` is the held-out compensated rate where a row was in range, NaN elsewhere, and so is
    ``before``: a flagged row is not to be trusted, and has a figure of its own.
    """

    def __init__(self, calibration):
        self.calibration = calibration
        self.log, self.rate = calibration.log, calibration.rate
        self.after = np.where(calibration.inside, calibration.after, np.nan)
        self.in_range = np.isfinite(self.after)
        self.beyond = ~calibration.inside & np.isfinite(calibration.after)
        self.before = np.where(self.in_range, calibration.before, np.nan)
        self.error_before = (self.before - self.rate)[self.in_range]
        self.error_after = (self.after - self.rate)[self.in_range]
        inputs = calibration.X
        self.temperature = self.log["temperature"].to_numpy()
        self.temperature_rate = (
            _PER_MINUTE * inputs["temperature_rate"].to_numpy()
            if "temperature_rate" in inputs
            else None
        )
        self.time = self.log["time"].to_numpy() if "time" in self.log else None
        self.since_power_on = (
            features(self.log, ("time",), time_constant=1.0)["time"].to_numpy()
            if self.time is not None
            else None
        )
        self.run = self.log["run"].astype(str).to_numpy(dtype=object) if "run" in self.log else None

    @property
    def unit(self):
        """Unit for errors: that in which they are no long row of zeros."""
        return "deg/s" if _rms(self.error_before) > _SMALL else "deg/h"

    def shown(self, error):
        """An error [deg/s] in the unit for errors."""
        return figures(PER_UNIT[self.unit] * error)

    @property
    def gain(self):
        """Reduction factor over the rows in range."""
        return _rms(self.error_before) / _rms(self.error_after)

    @property
    def warms_and_cools(self):
        """Whether the temperature both rises and falls."""
        rates = self.temperature_rate
        return rates is not None and rates.min() < -_CLEARLY < _CLEARLY < rates.max()


def _subtitle(calibration):
    what = "Arcsine law and fuzzy rules" if calibration.recipe.physics else "Fuzzy rules (ANFIS)"
    inputs = ", ".join(_words(name) for name in calibration.recipe.inputs)
    return f"{what} that predict the gyro's {_target(calibration)} from {inputs}."


def _target(calibration):
    return "rate" if calibration.recipe.physics else "rate error"


def _headline(page, results):
    calibration = results.calibration
    beyond = results.beyond
    after = results.error_after
    unit = SYMBOL[results.unit]
    other = "deg/h" if results.unit == "deg/s" else "deg/s"
    rms_after = f"{figures(PER_UNIT[other] * _rms(after))} {SYMBOL[other]}"
    cards = [
        ("RMS error before", f"{results.shown(_rms(results.error_before))} {unit}", "same rows"),
        (
            "RMS error after",
            f"{results.shown(_rms(after))} {unit}",
            f"{rms_after}, held-out rows in range",
        ),
        ("Reduction", f"{figures(results.gain)} ×", "before over after"),
        (
            "Largest error after",
            f"{results.shown(np.abs(after).max())} {unit}",
            "held-out rows in range",
        ),
        ("Rules", f"{_rules_of(calibration).n_rules_}", _terms_text(calibration)),
    ]
    if beyond.any():
        remark = f"{beyond.mean():.1%} of the held-out rows, all flagged"
        error = calibration.after[beyond] - results.rate[beyond]
        cards.append(("RMS out of range", f"{results.shown(_rms(error))} {unit}", remark))
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
    lines = [("no compensation", _rms(results.error_before)), *calibration.baselines.items()]
    lines.append((f"this model ({_terms_text(calibration)})", best))
    page.table(
        ("compensation", f"RMS error, held out [{SYMBOL[results.unit]}]"),
        [(name, results.shown(value)) for name, value in lines],
        "Beside simpler compensations, on the same folds and, for speed, on fewer rows",
    )
    if len(calibration.tried) > 1:
        lines = "\n".join(
            f"{','.join(map(str, terms)):>12}  {figures(found)}"
            for terms, found in calibration.tried
        )
        page.preformatted(
            f"terms of {', '.join(calibration.recipe.inputs)}; held-out RMS error [°/s]\n{lines}",
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
    for note, lines in whole[whole["note"] != ""].groupby("note", sort=False):
        page.paragraph(f"{', '.join(map(_words, lines['figure']))}: {note}", kind="soft")
    if few:
        _merit_by_group(page, results, report)


def _merit_by_group(page, results, report):
    kind = results.calibration.split.kind.split("+")[0]
    parts = report[report["group"] != "all"]
    after = parts.pivot(index="group", columns="figure", values="after")
    before = parts[parts["figure"] == "residual_rms"].set_index("group")["before"]
    lines = [
        (
            str(group),
            f"{after.at[group, 'rows']:,.0f}",
            f"{after.at[group, 'rows_refused']:,.0f}",
            results.shown(before[group]),
            results.shown(after.at[group, "residual_rms"]),
            results.shown(after.at[group, "residual_peak"]),
            f"{figures(after.at[group, 'reduction_factor'])} ×",
        )
        for group in parts["group"].unique()
    ]
    unit = SYMBOL[results.unit]
    errors = (f"RMS before [{unit}]", f"RMS after [{unit}]", f"peak after [{unit}]")
    page.heading(f"By held-out {kind}")
    page.table((kind, "rows", "out of range", *errors, "reduction"), lines)


def _pictures(page, results):
    page.section("Pictures")
    common = (results.rate, results.before, results.after)
    entries = []
    if results.time is not None:
        entries.append(
            (
                _drawn(
                    ErrorDisplay,
                    2,
                    *common,
                    position=results.since_power_on,
                    position_label="time since power-on [s]",
                    unit=results.unit,
                ),
                "Error against time, before and after",
                "Error against time. Bands reach from the smallest to the largest error.",
            )
        )
    entries.append(
        (
            _drawn(
                ErrorDisplay,
                2,
                *common,
                position=results.temperature,
                position_label="temperature [°C]",
                unit=results.unit,
            ),
            "Error against temperature, before and after",
            "Error against temperature.",
        )
    )
    if np.ptp(results.rate) > 0:
        entries.append(
            (
                _drawn(ScaleFactorErrorDisplay, 2, *common, temperature=results.temperature),
                "Scale-factor error against rate at three temperatures, before and after",
                "Scale-factor error against rate, in three bands of temperature.",
            )
        )
    if results.warms_and_cools:
        options = {
            "temperature": results.temperature,
            "temperature_rate": results.temperature_rate,
        }
        entries.append(
            (
                _drawn(HysteresisDisplay, 2, *common, **options),
                "Bias against temperature, warming and cooling apart, before and after",
                "Bias while warming and while cooling; other than in the table, what depends on the "
                "rate is taken off. Temperature alone cannot close a loop.",
            )
        )
    if np.ptp(results.rate) > 0:
        entries.append(
            (
                _drawn(
                    ResidualSurfaceDisplay,
                    2,
                    *common,
                    rows=1,
                    temperature=results.temperature,
                    unit=results.unit,
                ),
                "Mean residual and number of rows over temperature and rate",
                "What is left over temperature and rate (left), and where there are data (right).",
            )
        )
    groups = results.calibration.split.labels
    entries.append(
        (
            _drawn(
                GroupResidualDisplay,
                1,
                *common,
                height=1.6 + 0.2 * min(np.unique(groups.astype(str)).size, 30),
                groups=groups,
                unit=results.unit,
            ),
            "RMS error of every held-out group, before and after",
            "Every held-out group, the worst at the top.",
        )
    )
    no_allan = _why_no_allan(results)
    if not no_allan:
        entries.append(_allan_entry(results))
    page.figures(entries)
    if no_allan:
        page.paragraph(f"Allan deviation: {no_allan}.", kind="soft")


def _limits(page, results):
    calibration = results.calibration
    compensator = calibration.compensator
    page.section("Where it may be used")
    page.paragraph(
        f"Outside the ranges below, input by input, a row is flagged (status 1) and "
        f"{_POLICIES[calibration.recipe.outside]}. Inside them, rows near which there are hardly "
        f"any data (coverage below {compensator.min_coverage:g}) are flagged too (status 4). The C "
        "code that skanfis.export writes flags the same rows with the same numbers."
    )
    model = _rules_of(calibration)
    X = calibration.X.iloc[_even(len(calibration.X))]
    low, high = calibration.X.min(), calibration.X.max()
    page.table(
        ("input", "from", "to", "unit"),
        [
            (_words(name), f"{low[name]:.5g}", f"{high[name]:.5g}", _unit_of(calibration, name))
            for name in calibration.X
        ],
        "Range of the calibration",
    )
    if {"temperature", "output"} <= set(calibration.X) and hasattr(model, "coverage"):
        page.figures(
            [
                (
                    _drawn_coverage(calibration, X),
                    "Coverage over temperature and output, with the range of the calibration",
                    "Coverage by the calibration data; other inputs at their medians.",
                )
            ]
        )


def _rules(page, results):
    calibration = results.calibration
    estimator = calibration.compensator.estimator
    rules = getattr(estimator, "residual_", estimator)
    page.section("The rules")
    if calibration.recipe.physics:
        page.paragraph(
            "The rules give what the arcsine law leaves of the rate; the law's prediction is added."
        )
        page.preformatted(_law_text(estimator.base_), "The arcsine law")
    with_terms = {term["input"] for term in _rules_of(calibration).memberships_}
    if with_terms:
        X = calibration.X.iloc[_even(len(calibration.X))]
        page.figures(
            [
                (
                    _drawn_memberships(rules, X, len(with_terms)),
                    "Membership functions before and after training, over histograms of the data",
                    "Fuzzy terms before training (dashed) and after, over the data.",
                )
            ]
        )
    page.preformatted(rules_text(calibration), "All rules as text")
    page.preformatted(_on_board(calibration.compensator), "What to compute on board")


def _on_board(compensator):
    """The steps around the model, as they run on the gyro's processor."""
    arguments = ", ".join(compensator.inputs)
    lines = []
    if "temperature_rate" in compensator.inputs:
        lines += [
            "/* at power-on: temperature_rate = 0 and previous = temperature; then every h seconds */",
            f"temperature_rate += (1 - exp(-h / {compensator.time_constant:g}))",
            "    * ((temperature - previous) / h - temperature_rate);",
            "previous = temperature;",
        ]
    if compensator.predicts == "error":
        lines.append(f"rate = output / {compensator.scale_factor:.9g} - error({arguments});")
    else:
        lines.append(f"rate = law(output, temperature) + rules({arguments});")
    return "\n".join(lines)


def rules_text(calibration):
    """The rules as sentences."""
    estimator = calibration.compensator.estimator
    if calibration.recipe.physics:
        return export_text(estimator.residual_, output_names=["rate beyond the law"]) + "\n"
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
        lines.append(("time between rows, median", f"{_interval(results):.4g}", "s"))
    ranges = {"temperature": "°C", "rate": "°/s", "output": _unit_of(calibration, "output")}
    for name, unit in ranges.items():
        lines.append((name, f"{log[name].min():.5g} to {log[name].max():.5g}", unit))
    if calibration.recipe.output_unit in SIGNALS:
        unit = f"{calibration.recipe.output_unit} per °/s"
        lines.append(("scale factor", f"{calibration.compensator.scale_factor:.8g}", unit))
    page.table(("", "", ""), lines)


def _drawn(display, n_axes, *columns, rows=None, height=4.2, **options):
    """A figure of its own, so that pyplot, and with it the screen, is never asked."""
    figure = _figure(6.2 if rows is None else 7.0, height if rows is None else 3.4)
    shape = (n_axes, 1) if rows is None else (rows, n_axes)
    shared = {"sharex": True} if rows is None else {"sharey": True}
    axes = figure.subplots(*shape, squeeze=False, **shared).ravel()
    display.from_predictions(*columns, ax=axes if n_axes > 1 else axes[0], **options)
    return figure


def _figure(width, height):
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def _drawn_coverage(calibration, X):
    figure = _figure(6.2, 4.0)
    units = {"output": calibration.recipe.output_unit, "temperature_rate": "degC/s"}
    estimator = calibration.compensator.estimator
    CoverageDisplay.from_estimator(estimator, X, units=units, ax=figure.subplots())
    return figure


def _drawn_memberships(rules, X, n_inputs):
    figure = _figure(6.2, 0.6 + 1.9 * n_inputs)
    axes = np.atleast_1d(figure.subplots(n_inputs, 1))
    MembershipDisplay.from_estimator(rules, X, ax=list(axes))
    return figure


def _why_no_allan(results):
    """Why there is no Allan curve; empty where there is one."""
    try:
        import allantools  # noqa: F401
    except ImportError:
        return "allantools is not installed (pip install 'skanfis[allan]')"
    if results.time is None:
        return "the log has no time"
    steps = _steps(results)
    if not steps.size or np.ptp(steps) > _UNEVEN * np.median(steps):
        return "the rows are not evenly spaced in time"
    if not _runs_in_range(results).any():
        return "no run is in range from end to end"
    return ""


def _allan_entry(results):
    whole = _runs_in_range(results)
    figure = _figure(6.2, 4.4)
    AllanDisplay.from_predictions(
        results.rate[whole],
        results.before[whole],
        results.after[whole],
        sampling_interval=_interval(results),
        run=None if results.run is None else results.run[whole],
        ax=figure.subplots(),
    )
    caption = "Allan deviation of the error, over the runs that are in range from end to end."
    return figure, "Allan deviation before and after", caption


def _runs_in_range(results):
    if results.run is None:
        return results.in_range
    lost = np.unique(results.run[~results.in_range].astype(str))
    return ~np.isin(results.run.astype(str), lost)


def _steps(results):
    steps = np.diff(results.time)
    return steps if results.run is None else steps[results.run[1:] == results.run[:-1]]


def _interval(results):
    return float(np.median(_steps(results)))


def _value(line, which):
    value = line[which]
    if not np.isfinite(value):
        return "–"
    low, high = line[f"{which}_low"], line[f"{which}_high"]
    known = np.isfinite([low, high]).all()
    return figures(value), f"[{figures(low)}, {figures(high)}]" if known else ""


def _law_text(law):
    lines = [f"at {law.reference_temperature_:.6g} °C; powers of the difference, lowest first"]
    for name in ("amplitude_", "sagnac_factor_", "bias_"):
        values = ", ".join(f"{value:.8g}" for value in getattr(law, name))
        lines.append(f"{_words(name.rstrip('_'))}: {values}")
    return "\n".join(lines)


def _rules_of(calibration):
    """The ANFIS at the end of the estimator."""
    estimator = calibration.compensator.estimator
    return getattr(estimator, "residual_", estimator)[-1]


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


def _even(n_rows):
    return np.unique(np.linspace(0, n_rows - 1, min(n_rows, _MOST_ROWS_SHOWN)).astype(int))


def _rms(errors):
    return float(np.sqrt(np.mean(errors**2)))
