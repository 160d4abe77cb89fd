r"""The numbers in the rules' sentences, in the digits that matter; ``text`` has the words.

Every rule r has a centre c_r, the mean of the training rows weighted by its strength, and says

    f_r(x) = v_r + sum_(j in common) b_j (x_j - c_rj) + sum_(j its own) b_rj (x_j - c_rj) ,

its own value v_r there, slopes that it shares with other rules, and slopes of its own. The shared
slopes are written once, as a line about the mean x0 of all rows. The part of v_r

    sum_(j in common) b_j (c_rj - x0_j)

is the line's value at the centre. So f_r is also v_r less this part, plus the line at x, plus the
rule's own slopes. Text, HTML, tables, and the model as printed consist of these numbers.
"""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ..antecedent.tree import CRISP
from ..digits import MOST_DIGITS, rounded
from ..export.columns import categories, columns_of
from ..learning.data import never_changes
from ..model import TSKModel
from ..naming import WRITTEN, default_term_names, parameters_written
from ..reading_cost import UNSAID

# Numbers are written to this many digits of the noise's deviation.
PRECISION = 2
# Places that slopes count from are written to this many digits of the input's deviation.
_DIGITS_OF_PLACE = 2
# Decimals to which a mean is 0 or 1, rounding errors apart.
_DIGITS_OF_CASE = 6
# Least deviation of the noise, relative to the output's, for the digits; also if it is not known.
_FINEST = 1e-4


@dataclass(frozen=True, eq=False)
class Sentences:
    """The numbers in the sentences of a model's rules; built by :meth:`of`."""

    model: TSKModel  # with its terms as written
    says_where: np.ndarray  # terms whose name tells their place, (n_terms,)
    places: np.ndarray  # centres, to few digits; 0 or 1 for two-valued inputs, (n_rules, n_inputs)
    values: np.ndarray  # value of each rule at its place, (n_rules, n_outputs)
    of_common: np.ndarray  # the common line's part in it
    slopes: np.ndarray  # shared ones included, (n_rules, n_inputs, n_outputs)
    is_own: np.ndarray  # which of the slopes are in the rule's own sentence
    common_place: np.ndarray  # x0, to few digits, (n_inputs,)
    common: np.ndarray  # slopes of the common line; zero if not shared, (n_inputs, n_outputs)

    @classmethod
    def of(cls, model: TSKModel, precision: int = PRECISION):
        """The sentences of a model; with a precision of 17 digits nothing is lost."""
        slopes = model.consequents[:, 1:]
        scale, noise = _resolution(model, slopes)
        two_valued = model.two_valued
        digits, centers = max(_DIGITS_OF_PLACE, precision), model.rule_centers
        places, common_place = (
            np.where(two_valued, np.round(np.clip(at, 0.0, 1.0)), rounded(at, model.spread, digits))
            for at in (centers, model.reference)
        )
        is_common, told = model.common_slopes, slopes
        is_fixed = np.zeros(places.shape, dtype=bool)
        if precision < MOST_DIGITS:
            # An indicator that is 0 or 1 on all rows of a rule needs no slope there.
            is_fixed = two_valued & np.isin(np.round(centers, _DIGITS_OF_CASE), (0.0, 1.0))
            told, places, is_common = _from_a_level(model, slopes, places, is_common, ~is_fixed)
        values = np.einsum("rj,rjo->ro", places - model.reference, slopes)
        values += model.coefficients[:, 0]
        slopes = rounded(told, noise / model.spread[:, None], precision)
        first = is_common.argmax(axis=0), np.arange(model.n_inputs)
        common = np.where(np.any(is_common, axis=0, keepdims=True).T, slopes[first], 0.0)
        part = np.where(is_common[:, :, None], common, 0.0)
        slopes[is_fixed[:, :, None] & (common == 0.0)] = 0.0
        of_common = np.einsum("rj,rjo->ro", places - common_place, part)
        # If others share a slope, a rule without one has to say so.
        is_own = ~is_common[:, :, None] & ((slopes != 0.0) | (common != 0.0))
        # Digits of terms refer to the output's deviation, not to that of the noise.
        more = int(np.floor(np.log10(scale / noise)).max(initial=0.0))
        digits = min(precision + more, MOST_DIGITS)
        written, says_where = _written_terms(model, digits, min(UNSAID, 10.0**-precision))
        values, of_common = (rounded(one, noise, precision) for one in (values, of_common))
        of_rules = places, values, of_common, slopes, is_own
        return cls(written, says_where, *of_rules, common_place, common)

    @property
    def printed(self) -> TSKModel:
        """The model with the numbers as written."""
        model = self.model
        own = np.where(self.is_own, self.slopes, 0.0)
        part = np.where(self.is_own, 0.0, self.common)
        constant = self.values - self.of_common
        constant -= np.einsum("rj,rjo->ro", self.places - model.reference, own)
        constant -= np.einsum("j,rjo->ro", self.common_place - model.reference, part)
        coefficients = np.concatenate([constant[:, None], own + part], axis=1)
        return replace(model, coefficients=coefficients[:, : model.coefficients.shape[1]])

    @property
    def n_numbers(self) -> np.ndarray:
        """Numerals in the sentence of each rule, (n_rules,)."""
        conditions = (self.model.antecedent.rule_terms >= 0).sum(axis=1)
        return conditions + self.model.n_outputs + self.is_own.sum(axis=(1, 2))

    @property
    def reading_cost(self) -> int:
        """Numerals in the sentences of all rules, and in the common line."""
        return int(self.n_numbers.sum() + np.count_nonzero(self.common))


def _from_a_level(model, slopes, places, is_common, is_told):
    """Slopes, places and shared slopes if a rule gives its value at one level of a category.

    If every row has one of the levels, their slopes are known only up to a constant. So one level
    needs no slope: the commonest of the rule. The others get the difference, if that takes no more
    numbers. Of two levels, the difference also replaces a slope that only one of them shares; if
    both share theirs, the difference is shared.
    """
    slopes, places, is_common = slopes.copy(), places.copy(), is_common.copy()
    whole = [one.inputs for one in categories(model).values() if not one.others]
    for one, other in (own for own in whole if len(own) == 2):
        if (has_both := is_common[:, one] & is_common[:, other]).any():
            slopes[:, one] -= slopes[:, other]
            slopes[:, other], places[:, other] = 0.0, 1.0 - places[:, one]
            is_common[:, one], is_common[:, other] = has_both, False
    for own, (r, center) in product(map(np.array, whole), enumerate(model.rule_centers)):
        free = own[~is_common[:, own].any(axis=0)]
        if free.size < own.size and (own.size > 2 or not is_told[r, free].any()):
            continue
        base = free[center[free].argmax()]
        changes = np.where(is_told[r, own, None], slopes[r, own] - slopes[r, base], 0.0)
        now = slopes[r, free] * is_told[r, free, None]
        if np.count_nonzero(changes) <= np.count_nonzero(now):
            slopes[r, own], places[r, own], is_common[r, own] = changes, own == base, False
    return slopes, places, is_common


def _resolution(model, slopes):
    """Deviations of every output, and of its noise, (n_outputs,) each; positive."""
    target, finest = model.target, np.full(model.n_outputs, _FINEST)
    if target is None:
        change = np.abs(slopes) * (model.maximum - model.minimum)[:, None]
        scale = np.ptp(model.coefficients[:, 0], axis=0) + change.max(axis=(0, 1))
    else:
        # An output that never changes has digits of its value, and asks for none of the terms.
        is_constant = never_changes(target.minimum, target.maximum)
        scale = np.where(is_constant, _FINEST * np.abs(target.maximum), target.spread)
        finest[is_constant] = 1.0
    scale = np.where(scale > 0.0, scale, 1.0)
    noise = 0.0 * scale if model.posterior is None else model.posterior.noise
    return scale, np.clip(noise, finest * scale, scale)


def _written_terms(model, digits, unsaid):
    """The model with its terms as written, and which of their names tell their place.

    A name that the user has given stays. Unless all digits are written, two things are left out.
    A cut with no training row near it becomes crisp, if its width changes no digit. A condition
    goes that others of the rule imply up to ``unsaid``, as "sort is not a" beside "sort is b".
    """
    antecedent = model.antecedent
    default, of_digits = default_term_names(model), default_term_names(model, digits)
    names, says_where = list(model.term_names), np.zeros(len(default), dtype=bool)
    groups, start, seen = [], 0, model.seen_values
    sure = np.log(10.0 ** max(digits, PRECISION) - 1.0) if digits < MOST_DIGITS else np.inf
    for group in antecedent.groups:
        ends = (end[group.inputs] for end in (model.minimum, model.maximum))
        theta = _rounded_theta(group, digits, *ends)
        is_written = antecedent.grid_counts is None and group.family in WRITTEN
        for k, t in enumerate(range(start, start + group.n_terms)):
            says_where[t] = is_written and names[t] == default[t]
            if says_where[t]:
                names[t] = of_digits[t]
                told = parameters_written(names[t], group.family, group.theta[:, k])
                theta[:, k] = place, log_width = told
                on_input = np.concatenate(seen[group.inputs[k]]) if seen else place
                nearest = np.abs(on_input - place).min()
                is_side = names[t][0] in "<>" and "±" in names[t]
                if is_side and nearest > sure * np.exp(log_width):
                    names[t] = names[t].partition(" ±")[0]
                    theta[1, k] -= np.log(CRISP)
        groups.append(replace(group, theta=theta))
        start += group.n_terms
    written = replace(antecedent, groups=tuple(groups))
    if digits < MOST_DIGITS:
        written = written.without_implied(unsaid, columns_of(model))
    return replace(model, antecedent=written, term_names=tuple(names)), says_where


def _rounded_theta(group, digits, low, high):
    """Rounded parameters of terms: places to digits of the width, others to their own digits.

    The logarithm of a membership changes with the square of the distance in widths. From a square
    of ten on, the farthest row needs more digits.
    """
    natural = group.family.natural(group.theta)
    parameters = group.family.parameters
    width = natural[[one.kind for one in parameters].index("log_width")]
    farthest = np.maximum(high - natural[0], natural[0] - low) / width
    digits = digits + np.log10(np.maximum(farthest**2 / 10.0, 1.0)).astype(int)
    theta = np.empty_like(natural)
    for row, parameter, values in zip(theta, parameters, natural, strict=True):
        if parameter.kind == "location":
            row[:] = rounded(values, width, digits)
        else:
            row[:] = np.log(rounded(values, values, digits))
    return theta
