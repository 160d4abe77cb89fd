"""The arcsine law as one line to be read, or typed into a spreadsheet."""

__all__ = ["law_text"]

_POLICIES = {
    "clip": "the phase is held there",
    "linear": "the law goes on along its tangent",
    "nan": "there is no rate",
    "raise": "there is no rate",
}


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
    policy = _POLICIES[law.out_of_bounds]
    return f"{formula}\nBeyond a phase (the arcsin) of {law.max_phase:g} rad {policy}."


def _polynomial(coefficients):
    """In powers of t, from the lowest."""
    text = f"{coefficients[0]:.8g}"
    for power, value in enumerate(coefficients[1:], start=1):
        text += _term(value, " t" if power == 1 else f" t^{power}")
    return text


def _term(value, factor=""):
    """What is to be added, with its sign; nothing for zero."""
    return f" {'-' if value < 0 else '+'} {abs(value):.8g}{factor}" if value else ""
