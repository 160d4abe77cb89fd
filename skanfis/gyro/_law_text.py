"""The arcsine law as one line to be read, or typed into a spreadsheet."""

from ..policies import SILENT

__all__ = ["law_text", "past_phase"]


def law_text(law, names, unit="deg/s"):
    """The fitted law as a formula with its units, and what happens past the arcsine.

    ``names`` are those of all columns of X, ``unit`` is that of the output.
    """
    names = [names[j] for j in law.columns_]
    amplitude, sagnac, bias = (
        _polynomial(values) for values in (law.amplitude_, law.sagnac_factor_, law.bias_)
    )
    formula = (
        f"rate [deg/s] = arcsin(({names[0]} [{unit}]{_term(-law.offset_)}) / ({amplitude})) "
        f"/ ({sagnac}) - ({bias})"
    )
    if len(names) > 1:
        lag = _term(law.thermometer_lag_, f" s * {names[2]} [degC/s]") if len(names) > 2 else ""
        formula += f", t = {names[1]} [degC]{lag}{_term(-law.reference_temperature_)}"
    policy = past_phase(law.out_of_bounds, "rate")
    return f"{formula}\nBeyond a phase (the arcsin) of {law.max_phase:g} rad {policy}."


def past_phase(policy, what):
    """What happens beyond the largest phase, as a clause; ``what`` there is none of in silence."""
    if policy in SILENT:
        return f"there is no {what}"
    return "the phase is held there" if policy == "clip" else "the law goes on along its tangent"


def _polynomial(coefficients):
    """In powers of t, from the lowest."""
    text = f"{coefficients[0]:.8g}"
    for power, value in enumerate(coefficients[1:], start=1):
        text += _term(value, " t" if power == 1 else f" t^{power}")
    return text


def _term(value, factor=""):
    """What is to be added, with its sign; nothing for zero."""
    return f" {'-' if value < 0 else '+'} {abs(value):.8g}{factor}" if value else ""
