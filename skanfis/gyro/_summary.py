"""What the command says at its end, in a few lines."""

import numpy as np

from ._headline import headline
from .compensator import STATUS

__all__ = ["summary", "summary_of_rows"]


def summary(calibration, folder):
    """Lines on a calibration: the error before and after, on the same rows, and the verdict."""
    errors = {
        "before": calibration.before - calibration.rate,
        "after": calibration.after - calibration.rate,
    }
    inside = calibration.in_range
    outside = ~calibration.inside & np.isfinite(errors["after"])
    after = errors["after"][inside]
    lines = [
        f"error before   {_rms(errors['before'][inside]):.4g} deg/s RMS, on {inside.sum():,} "
        "held-out rows in range",
        f"error after    {_rms(after):.4g} deg/s RMS, peak {np.abs(after).max():.4g}, on the same "
        "rows",
    ]
    if outside.any():
        lines.append(
            f"out of range   {_rms(errors['before'][outside]):.4g} deg/s RMS before, "
            f"{_rms(errors['after'][outside]):.4g} after, on {outside.sum():,} held-out rows, all "
            "of them flagged"
        )
    title, reason = headline(calibration, "deg/s")
    mark = "verdict" if calibration.verdict.model_is_worth_it else "VERDICT"
    return [
        *lines,
        f"check          {calibration.split.sentence}",
        f"{mark}        {title}. {reason}",
        f"written to     {folder}: {', '.join(sorted(path.name for path in folder.iterdir()))}",
        *(f"WARNING        {sentence}" for sentence in calibration.cautions),
    ]


def summary_of_rows(log, compensated, compensator, target):
    """Lines on a log that was compensated."""
    status = compensated["status"].to_numpy()
    flagged = status != 0
    lines = [f"written        {target}: {len(log):,} rows, {flagged.sum():,} flagged"]
    for name, bit in STATUS.items():
        count = int(np.count_nonzero(status & bit))
        if count:
            lines.append(f"status {bit}       {count:,} rows {name.lower().replace('_', ' ')}")
    if "rate" not in log:
        return lines
    before, after = (
        (compensated[name] - log["rate"]).to_numpy()
        for name in ("rate_indicated", "rate_compensated")
    )
    for label, rows in (("all is well", ~flagged), ("flagged", flagged)):
        # Before and after are of the same rows: those that got a rate.
        rows = rows & np.isfinite(after)
        if rows.any():
            lines.append(
                f"RMS error      {_rms(before[rows]):.4g} deg/s before, {_rms(after[rows]):.4g} "
                f"after ({label})"
            )
    return lines


def _rms(errors):
    return float(np.sqrt(np.mean(errors**2)))
