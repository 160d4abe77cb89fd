"""A calibration in words: which compensation to use and why, what is proven, formulas."""

import numpy as np
import pandas as pd

from ..bounds import bounds, gradient_bounds
from ..digits import counted, percent
from ..export import fold
from ..export.c.dialect import STATUS
from ..inspection import export_text, readability
from ..inspection.text import wrapped
from ._columns import RATE_UNITS, evenly_chosen
from ._simpler import LAW_AND_LINE, NAMES, NOTHING
from .c_compensator import input_units
from .compensator import features
from .compose import FrozenRules, Polynomial, rules_of
from .displays import three_digits
from .metrics import rms
from .physics import past_phase
from .targets.error_model import ErrorModel

ARTICLES = {name: f"{'the' if 'law' in name else 'a'} {name}" for name in NAMES.values()}
ARTICLES[NOTHING] = NOTHING
# What a log cannot show, and what it has too few of: rates or temperatures; thermal cycles.
_FEW = "so few rates or temperatures cannot show what is left at others", "few: log five or more"
_CYCLE = "one thermal cycle cannot show whether more would repeat it", "cycle: record two more"
_DIGITS = 4  # of the noise: to these, numbers are exact enough for the text to err as the rules do
_MOST_ROWS = 20_000  # evenly chosen, to see whether the rules can be read
_MANY_FLAGGED = 0.2  # of the rows
_MOST_BOXES = 20_000  # per bound; more boxes would only make it tighter


def headline(calibration, unit):
    """A title, and a sentence that gives its reason; errors in ``unit``."""
    verdict, groups = calibration.verdict, held_out_groups(calibration)
    left = {
        name: f"{three_digits(RATE_UNITS[unit] * error)} {unit}"
        for name, error in verdict.rms.items()
    }
    use = verdict.recommended
    simpler = [name for name in verdict.rms if name not in (NOTHING, verdict.model)]
    best = min(simpler, key=verdict.rms.get) if use == verdict.model else use
    is_law = "law" in best and not calibration.recipe.physics
    hint = " Rules can learn what the law leaves: --physics." if is_law else ""
    if use == verdict.model:
        gain = verdict.gains[best]
        factor, low, high = map(three_digits, (gain.factor, gain.low, gain.high))
        return "The fuzzy rules are worth it", (
            f"They leave {left[use]} RMS of {left[NOTHING]} on the held-out rows in range; the "
            f"best of what is simpler, {ARTICLES[best]}, leaves {left[best]} on the same rows. "
            f"Over the {groups} that is {factor} times as much in the geometric mean (95 % "
            f"interval {low} to {high}).{hint}"
        )
    title = "Leave the gyro as it is" if use == NOTHING else f"Use {ARTICLES[use]}"
    if most := calibration.split.most:
        cannot, advice = _CYCLE if most == "constant" else _FEW
        title += f": {cannot}"
        why = f"Anything more was learnt and judged on the same {advice}, then calibrate again."
    else:
        none = ": none that was tried is better beyond chance"
        title += none if use == NOTHING else " instead of the fuzzy rules"
        why = (
            "Nothing more elaborate that was tried is better by more than the scatter over the "
            f"{groups} can explain (95 %).{hint}"
        )
        if verdict.n_groups == 1:
            why = (
                "Only one held-out group has rows in range: how far errors scatter between groups "
                "is not known, so nothing can be shown to be better. Log more groups that overlap."
                f"{hint}"
            )
    what = {
        NOTHING: "Without any compensation the error is",
        "constant": "Subtracting a constant leaves",
    }.get(use, f"{ARTICLES[use].capitalize()} leaves")
    return title, (
        f"{what} {left[use]} RMS on the held-out rows in range; the fuzzy rules leave "
        f"{left[verdict.model]} on the same rows. {why}"
    )


def held_out_groups(calibration):
    """Such as "12 held-out runs"."""
    n_groups = calibration.verdict.n_groups
    kind = calibration.split.kind.split("+")[0].replace("level", "rate level")
    n_all = np.unique(calibration.split.labels.astype(str)).size
    of_all = "" if n_all == n_groups else f" (of {n_all})"
    return f"{n_groups}{of_all} held-out {kind}{'s' if n_groups > 1 or of_all else ''}"


def flagged_text(calibration):
    """How many held-out rows were flagged, and what that means."""
    n_rows, n_flagged = calibration.inside.size, np.count_nonzero(~calibration.inside)
    if not n_flagged:
        return f"None of the {n_rows:,} held-out rows was flagged."
    X, share = calibration.X, n_flagged / n_rows
    named = beyond(
        (X.iloc[test][~calibration.inside[test]], *X.iloc[train].agg(["min", "max"]).to_numpy())
        for train, test in calibration.split.folds
    )
    advice = "They are the ends of the range, which no other group reaches."
    if share > _MANY_FLAGGED:
        advice = (
            "That is much: the figures say nothing of these rows. Log groups that overlap more, "
            "above all at both ends of the range, or hold out another kind (--groups)."
        )
    flagged = f"{n_flagged:,} of {n_rows:,} held-out rows ({percent(share)})"
    return f"{flagged} were flagged{named}. {advice}"


def beyond(parts):
    """In how many rows each input is out of range, in words; ``parts`` are tables, lows, highs."""
    counts = sum(((rows < low) | (rows > high)).sum() for rows, low, high in parts)
    named = [f"{name} in {n:,}" for name, n in counts.sort_values(ascending=False).items() if n]
    return f" ({', '.join(named)})" if named else ""


def errors_and_verdict(calibration, name_row="row {}".format):
    """Lines of the command: errors before and after, which compensation to use."""
    before, after = (rates - calibration.rate for rates in (calibration.before, calibration.after))
    inside = calibration.inside
    outside = ~inside & np.isfinite(after)
    sizes, constant = np.where(inside, np.abs(after), 0.0), calibration.verdict.rms["constant"]
    yield (
        f"error before   {rms(before[inside]):.4g} deg/s RMS, {constant:.4g} once a constant (the "
        f"output at rest) is taken off, on {inside.sum():,} held-out rows in range"
    )
    yield (
        f"error after    {rms(after[inside]):.4g} deg/s RMS on the same rows, half of them within "
        f"{np.median(sizes[inside]):.4g}, peak {sizes.max():.4g} ({name_row(int(sizes.argmax()))})"
    )
    if outside.any():
        errors = f"{rms(before[outside]):.4g} deg/s RMS before, {rms(after[outside]):.4g} after"
        yield f"out of range   {errors}, on {outside.sum():,} held-out rows, all of them flagged"
    yield f"flagged        {flagged_text(calibration)}"
    title, reason = headline(calibration, "deg/s")
    yield f"VERDICT        {title}. {reason}"
    yield f"written is     {written_text(calibration)}"
    if calibration.writes_model and (against := against_reading(calibration)):
        yield f"rules          against reading them one by one: {against[0]}"


def of_rates(compensator, log, rates):
    """Lines on the rates of a log: status, inputs out of range, errors where they are known."""
    status, rules = rates["status"], rules_of(compensator.estimator)
    is_out = (status & STATUS["OUT_OF_RANGE"]) != 0
    X = features(log, compensator.inputs, compensator.time_constant)[is_out]
    blame = beyond([(X.iloc[:, rules.positions], rules.model.minimum, rules.model.maximum)])
    yield f"flagged        {counted(f'{(status != 0).sum():,}', 'row')}"
    for name, bit in STATUS.items():
        if count := ((status & bit) != 0).sum():
            told = f"{counted(f'{count:,}', 'row')} {name.lower().replace('_', ' ')}"
            yield f"status {bit}       {told}{blame if name == 'OUT_OF_RANGE' else ''}"
    errors = rates[["rate_indicated", "rate_compensated"]].sub(log.get("rate", np.nan), axis=0)
    kinds = np.where(status == 0, "rows with status 0", "the flagged rows")
    for where, part in errors.dropna().groupby(pd.Series(kinds, errors.index)):
        before, after = map(rms, part.to_numpy().T)
        yield f"RMS error      {before:.4g} deg/s before, {after:.4g} after ({where})"


def written_text(calibration):
    """Which compensation is written, and whether it is the recommended one."""
    asked = calibration.recipe.write != "recommended"
    others = "as --write asks" if asked else "as recommended; --write chooses another"
    return f"{ARTICLES.get(calibration.written, 'the fuzzy rules')}, {others}"


def against_reading(calibration):
    """Reasons against reading the rules one by one; rounding is none, as the text has digits."""
    places = evenly_chosen(len(calibration.X), _MOST_ROWS)
    X, left = calibration.X.iloc[places], (calibration.before - calibration.rate)[places]
    if calibration.recipe.physics:
        left = calibration.rate[places] - calibration.model.base_.predict(X)
    # The rules are not judged on rows that the law refuses.
    known = np.isfinite(left)
    return readability(calibration.rules, X[known], left[known]).on_rules


def proven_bounds(calibration):
    """What is proven about the rules, or a cubic, in the range of the calibration.

    First the size that no compensation exceeds [deg/s], then whether the compensated rate always
    follows the output: None if output is no input, or the part beside the rules is not bounded.
    """
    compensator, X = calibration.compensator, calibration.X
    per_output, rules = 1.0 / compensator.scale_factor, compensator.estimator
    if isinstance(getattr(rules, "base_", None), Polynomial):
        error = ErrorModel(compensator, rules, X)
        return float(np.abs(error.ranges(*error.ends.T[:, :, None])[0]).max()), None
    rules = rules_of(rules).model
    found = bounds(rules, max_boxes=_MOST_BOXES)
    largest = float(np.abs([found.lower, found.upper]).max())
    if compensator.predicts == "rate" or "output" not in X:
        return largest, None
    # rate = output / factor - error: it follows the output if 1 / factor outweighs error's slope.
    slope = gradient_bounds(rules, "output", max_boxes=_MOST_BOXES)
    follows = slope.upper < per_output if per_output > 0.0 else slope.lower > per_output
    return largest, bool(follows[0])


def formula_of(calibration, name):
    """The formula of a simpler compensation, as lines of text."""
    simple = next(each for each in calibration.simpler if each.name == name)
    recipe, estimator = calibration.recipe, simple.estimator
    law = getattr(estimator, "base_", None)
    if name == LAW_AND_LINE:
        line = _line("line", estimator.residual_, recipe.inputs)
        return f"{law_text(law, recipe)}\n\nTo this rate is added the line:\n{line}"
    if simple.predicts == "rate":
        return law_text(law, recipe)
    text = _line("error", estimator, recipe.inputs) if law is None else _cubic(law, recipe.inputs)
    return f"{_rate_text(calibration)}\n{text}"


def rules_text(calibration):
    """The written compensation as text: units, then a formula, or cautions and rules."""
    recipe, caution = calibration.recipe, ""
    units = input_units(calibration.compensator)
    # The rate needs the output even if it is no input.
    columns = dict.fromkeys([*calibration.compensator.inputs, "output"])
    inputs = "".join(f", {name} in {units[name]}" for name in columns)
    told = wrapped(f"Units: rates and errors in deg/s{inputs}.") + "\n\n"
    if not calibration.writes_model:
        return f"{told}{formula_of(calibration, calibration.written)}\n"
    if against := against_reading(calibration):
        heading = "What speaks against reading the rules one by one:"
        caution = "\n".join([heading, *map(wrapped, against), "", ""])
    law = f"{_rate_text(calibration)}\nThe rules give the error:\n\n"
    if recipe.physics:
        law = f"{law_text(calibration.model.base_, recipe)}\nTo this rate the rules add:\n\n"
    # A folded model has no readability from training: so the text has the caution only once.
    names = ["rate beyond the law" if recipe.physics else "error"]
    rules = export_text(fold(calibration.rules), precision=_DIGITS, output_names=names)
    return f"{told}{law}{caution}{rules}\n"


def _rate_text(calibration):
    """How the rate follows from the output and the error."""
    factor = calibration.compensator.scale_factor
    return f"rate = output{'' if factor == 1.0 else f' / {factor:.9g}'} - error"


def law_text(law, recipe):
    """The fitted law as a formula with its units, and what happens past the arcsine."""
    names = [recipe.inputs[j] for j in law.columns_]
    amplitude, sagnac, bias = map(_in_powers, (law.amplitude_, law.sagnac_factor_, law.bias_))
    formula = (
        f"rate [deg/s] = arcsin({names[0]} [{recipe.output_unit}] "
        f"/ ({amplitude})) / ({sagnac}) - ({bias})"
    )
    if len(names) > 1:
        lag = _term(law.thermometer_lag_, f" s * {names[2]} [degC/s]") if len(names) > 2 else ""
        formula += f", t = {names[1]} [degC]{lag}{_term(-law.reference_temperature_)}"
    policy = past_phase(law.out_of_bounds, "rate")
    return f"{formula}\nBeyond a phase (the arcsin) of {law.max_phase:g} rad {policy}."


def _in_powers(coefficients):
    """A polynomial in t as text, the lowest power first."""
    powers = enumerate(coefficients[1:], start=1)
    terms = [_term(value, " t" if power == 1 else f" t^{power}") for power, value in powers]
    return f"{coefficients[0]:.8g}{''.join(terms)}"


def _term(value, factor=""):
    """A summand as text, with its sign; empty for zero."""
    return f" {'-' if value < 0 else '+'} {abs(value):.8g}{factor}" if value else ""


def _line(what, estimator, inputs):
    """The output of a single rule as text: a constant or a line."""
    model = FrozenRules.of(estimator, len(inputs)).model
    constant, *slopes = model.coefficients.ravel()
    lines = [f"{what} = {constant:.9g}"]
    for name, slope, reference in zip(inputs, slopes, model.reference, strict=False):
        lines.append(f"    {slope:+.9g} * ({name} - ({reference:.9g}))")
    return "\n".join(lines)


def _cubic(cubic, inputs):
    """A cubic as text, in standardised inputs, so that no digits are lost."""
    names = [f"z{j + 1}" for j in range(len(inputs))]
    lines = [
        f"{name} = ({column} - ({center:.9g})) / {scale:.9g}"
        for name, column, center, scale in zip(
            names, inputs, cubic.center, cubic.scale, strict=True
        )
    ]
    for value, row in zip(cubic.coefficients, cubic.powers, strict=True):
        powers = zip(names, row, strict=True)
        factors = [f"{name}^{k}" if k > 1 else name for name, k in powers if k]
        term = "    {:+.9g} * {}" if factors else "error = {:.9g}"
        lines.append(term.format(value, " * ".join(factors)))
    return "\n".join(lines)
