"""Which compensation to use, in words that report and command share."""

from ._columns import RATE_UNITS
from ._simpler import LAW_AND_LINE, NOTHING
from .displays._style import SYMBOL, figures

__all__ = ["ARTICLES", "headline", "held_out_groups"]

ARTICLES = {
    NOTHING: "no compensation",
    "constant": "a constant",
    "straight line": "a straight line",
    "arcsine law": "the arcsine law",
    LAW_AND_LINE: "the arcsine law and a line",
    "cubic polynomial": "a cubic polynomial",
}


def headline(calibration, unit):
    """A title, and a sentence that gives its reason; errors in ``unit``."""
    verdict = calibration.verdict
    if verdict.model_is_worth_it:
        return "The fuzzy rules are worth it", _for_the_model(calibration, unit)
    name = verdict.recommended
    title = f"Use {ARTICLES[name]} instead of the fuzzy rules"
    if name == NOTHING:
        title = "Leave the gyro as it is: no compensation that was tried is better"
    return title, _against_the_model(calibration, unit)


def held_out_groups(calibration):
    """Such as "12 held-out runs"."""
    kind, n_groups = calibration.split.kind.split("+")[0], calibration.verdict.n_groups
    if kind == "level":
        kind = "rate level"
    return f"{n_groups} held-out {kind}{'s' if n_groups > 1 else ''}"


def _for_the_model(calibration, unit):
    verdict = calibration.verdict
    simpler = [name for name in verdict.rms if name not in (NOTHING, verdict.model)]
    best = min(simpler, key=verdict.rms.get)
    gain = verdict.gains[best]
    return (
        f"They leave {_shown(verdict.rms[verdict.model], unit)} RMS of "
        f"{_shown(verdict.rms[NOTHING], unit)} on the held-out rows in range; the best of what is "
        f"simpler, {ARTICLES[best]}, leaves {_shown(verdict.rms[best], unit)} on the same rows. "
        f"Over the {held_out_groups(calibration)} that is {figures(gain.factor)} times as much in "
        f"the geometric mean (95 % interval {figures(gain.low)} to {figures(gain.high)})."
    )


def _against_the_model(calibration, unit):
    verdict = calibration.verdict
    name, groups = verdict.recommended, held_out_groups(calibration)
    left = {
        NOTHING: "Without any compensation the error is",
        "constant": "Subtracting a constant leaves",
    }.get(name, f"{ARTICLES[name].capitalize()} leaves")
    sentence = (
        f"{left} {_shown(verdict.rms[name], unit)} RMS on the held-out rows in range; the fuzzy "
        f"rules leave {_shown(verdict.rms[verdict.model], unit)} on the same rows. "
    )
    if verdict.n_groups == 1:
        return sentence + (
            "Only one held-out group has rows in range: how far errors scatter is not known, and "
            "nothing can be shown to be better. Log more groups that overlap."
        )
    return sentence + (
        "Nothing more elaborate that was tried is better by more than the scatter over the "
        f"{groups} can explain (95 %)."
    )


def _shown(error, unit):
    return f"{figures(RATE_UNITS[unit] * error)} {SYMBOL[unit]}"
