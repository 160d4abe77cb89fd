"""What the command says of a calibration at its end, in a few lines."""

import numpy as np

from ._headline import headline
from ._reading import readability_of
from ._simpler import options_for
from .metrics import rms

__all__ = ["errors_and_verdict"]


def errors_and_verdict(calibration):
    """Lines: the error before and after, on the same rows, and which compensation to use."""
    before, after = (rates - calibration.rate for rates in (calibration.before, calibration.after))
    inside = calibration.in_range
    outside = ~calibration.inside & np.isfinite(after)
    peak = np.abs(after[inside]).max()
    lines = [
        f"error before   {rms(before[inside]):.4g} deg/s RMS, on {inside.sum():,} held-out rows "
        "in range",
        f"error after    {rms(after[inside]):.4g} deg/s RMS, peak {peak:.4g}, on the same rows",
    ]
    if outside.any():
        lines.append(
            f"out of range   {rms(before[outside]):.4g} deg/s RMS before, "
            f"{rms(after[outside]):.4g} after, on {outside.sum():,} held-out rows, all of them "
            "flagged"
        )
    title, reason = headline(calibration, "deg/s")
    lines.append(f"VERDICT        {title}. {reason.replace('°', 'deg')}")
    recipe = calibration.recipe
    if wanted := options_for(calibration.verdict.recommended, len(recipe.inputs)):
        lines.append(f"instead        {wanted} writes the files of it; the report has its formula")
    if findings := readability_of(calibration).findings:
        lines.append(f"rules          not fit to be read one by one. {findings[0]}")
    return lines
