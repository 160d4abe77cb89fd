"""Which compensation to use: the simplest that no more elaborate one beats decisively.

All are judged on the same held-out rows. How many times smaller the elaborate one's error is, is
the geometric mean over the groups held out of the ratio of RMS errors, with the interval of
Student's t at 95 %: a mean of squares alone would be decided by a group ten times larger than the
others. "Decisively" means that the interval lies above 1.02, and that the RMS over all rows falls
by more than this, where one bad group shows. The models of different folds share training rows: the
interval is a little too narrow.
"""

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from .metrics import rms

__all__ = ["Gain", "Verdict", "judge"]

_CONFIDENCE = 0.95
_LEAST_GAIN = 1.02
# Errors smaller than this part of the uncompensated one are rounding, and equal.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Gain:
    """How many times smaller one error is than another; ``low``, ``high``: NaN for one group."""

    factor: float
    low: float
    high: float
    of_all_rows: float

    @property
    def is_decisive(self):
        """Whether it is above what scatter alone could give, and worth having."""
        return self.low > _LEAST_GAIN and self.of_all_rows > _LEAST_GAIN


@dataclass(frozen=True)
class Verdict:
    """RMS errors [deg/s] by name, the simplest first and the model last, and the name to use.

    ``gains`` has those of the model over each of the others.
    """

    rms: dict[str, float]
    gains: dict[str, Gain]
    n_groups: int
    recommended: str

    @property
    def model(self):
        """Name of the model that was judged."""
        return list(self.rms)[-1]

    @property
    def model_is_worth_it(self):
        """Whether the model is the one to use."""
        return self.recommended == self.model


def judge(errors, groups):
    """Judge compensations by their errors on the same rows, and what was held out together.

    ``errors`` are by name and in the order of complexity: "no compensation" first, the model last.
    """
    codes = np.unique(groups.astype(str), return_inverse=True)[1]
    of_all = {name: rms(error) for name, error in errors.items()}
    floor = _ROUNDING * next(iter(of_all.values())) or np.finfo(float).tiny
    sizes = {
        name: np.maximum(np.append(_rms_by_group(error, codes), of_all[name]), floor)
        for name, error in errors.items()
    }
    names = list(errors)
    recommended = next(
        name
        for place, name in enumerate(names)
        if not any(_gain(sizes[name], sizes[other]).is_decisive for other in names[place + 1 :])
    )
    gains = {name: _gain(sizes[name], sizes[names[-1]]) for name in names[:-1]}
    return Verdict(of_all, gains, int(codes.max()) + 1, recommended)


def _gain(simple, elaborate):
    """From RMS errors by group, the last that over all rows."""
    *logs, of_all = np.log(simple / elaborate)
    n, mean = len(logs), np.mean(logs)
    half = np.nan
    if n > 1:
        half = student.ppf(0.5 + 0.5 * _CONFIDENCE, n - 1) * np.std(logs, ddof=1) / np.sqrt(n)
    return Gain(*(float(np.exp(value)) for value in (mean, mean - half, mean + half, of_all)))


def _rms_by_group(error, codes):
    return np.sqrt(np.bincount(codes, error**2) / np.bincount(codes))
