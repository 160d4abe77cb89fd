"""What the command says of a calibration at its end, in a few lines."""

import numpy as np

from ._headline import headline
from ._reading import readability_of
from ._simpler import LAW_AND_LINE

__all__ = ["errors_and_verdict"]

# What makes the files of a simpler compensation: a single rule is a straight line.
_OPTIONS = {
    "straight line": "--terms {ones}",
    "arcsine law": "--physics --terms {ones}",
    LAW_AND_LINE: "--physics --terms {ones}",
}


def errors_and_verdict(calibration):
    """Lines: the error before and after, on the same rows, and which compensation to use."""
    before, after = (rates - calibration.rate for rates in (calibration.before, calibration.after))
    inside = calibration.in_range
    outside = ~calibration.inside & np.isfinite(after)
    peak = np.abs(after[inside]).max()
    lines = [
        f"error before   {_rms(before[inside]):.4g} deg/s RMS, on {inside.sum():,} held-out rows "
        "in range",
        f"error after    {_rms(after[inside]):.4g} deg/s RMS, peak {peak:.4g}, on the same rows",
    ]
    if outside.any():
        lines.append(
            f"out of range   {_rms(before[outside]):.4g} deg/s RMS before, "
            f"{_rms(after[outside]):.4g} after, on {outside.sum():,} held-out rows, all of them "
            "flagged"
        )
    title, reason = headline(calibration, "deg/s")
    lines.append(f"VERDICT        {title}. {reason.replace('°', 'deg')}")
    lines += _what_next(calibration)
    if findings := readability_of(calibration).findings:
        lines.append(f"rules          not fit to be read one by one. {findings[0]}")
    return lines


def _what_next(calibration):
    inputs, options = calibration.recipe.inputs, _OPTIONS.get(calibration.verdict.recommended)
    if options is None:
        return []
    wanted = options.format(ones=",".join("1" * len(inputs)))
    return [f"instead        {wanted} writes the files of it; the report has its formula"]


def _rms(errors):
    return float(np.sqrt(np.mean(errors**2)))
