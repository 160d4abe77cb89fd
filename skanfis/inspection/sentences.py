r"""What the rules say, number by number, in the digits that matter.

Every rule r has a centre c_r, the mean of the training rows weighted by its strength, and says

    f_r(x) = v_r + sum_(j in common) b_j (x_j - c_rj) + sum_(j its own) b_rj (x_j - c_rj) ,

its own value v_r there, slopes that it has in common with other rules, and slopes of its own. What
is common is said once, as a line about the mean x0 of all rows. Of v_r the part

    sum_(j in common) b_j (c_rj - x0_j)

is that line's at the centre, so that f_r is also v_r less this part, plus the line at x, plus the
rule's own slopes. Text, HTML, tables, and the model as it is printed are made of these numbers.
"""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ..antecedent.tree import CRISP
from ..digits import MOST_DIGITS, rounded
from ..export.columns import categories, columns_of
from ..model import TSKModel
from ..naming import WRITTEN, default_term_names, parameters_written
from ..reading_cost import UNSAID

# Digits of the noise's deviation to which numbers are written.
PRECISION = 2
# Digits of a deviation of an input to which the places are written that slopes count from.
_DIGITS_OF_PLACE = 2
# As rounding leaves a 0 or a 1.
_DIGITS_OF_CASE = 6
# Of an output's deviation: numbers are written no finer, and so fine where the noise is not known.
_FINEST = 1e-4


@dataclass(frozen=True, eq=False)
class Sentences:
    """What the rules of a model say; built by :meth:`of`."""

    model: TSKModel  # whose rules these are; its terms as they are written
    says_where: np.ndarray  # terms whose name says where they turn, (n_terms,)
    places: np.ndarray  # centers, to few digits; 0 or 1 where these are all, (n_rules, n_inputs)
    values: np.ndarray  # what each rule says there, (n_rules, n_outputs)
    of_common: np.ndarray  # what of it is the common line's part
    slopes: np.ndarray  # those in common as well, (n_rules, n_inputs, n_outputs)
    is_own: np.ndarray  # which of them the rule states itself
    common_place: np.ndarray  # (n_inputs,)
    common: np.ndarray  # the common line; zero where nothing is in common, (n_inputs, n_outputs)

    @classmethod
    def of(cls, model: TSKModel, precision: int = PRECISION):
        """What a model says; of 17 digits nothing is lost."""
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
            # A case that all rows of a rule are, or none is, changes nothing there.
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
        # Beside a common slope that of nothing is to be said as well.
        is_own = ~is_common[:, :, None] & ((slopes != 0.0) | (common != 0.0))
        # What terms may be off by is a part of the output's deviation, not of the noise.
        more = int(np.floor(np.log10(scale / noise)).max(initial=0.0))
        digits = min(precision + more, MOST_DIGITS)
        written, says_where = _written_terms(model, digits)
        values, of_common = (rounded(one, noise, precision) for one in (values, of_common))
        of_rules = places, values, of_common, slopes, is_own
        return cls(written, says_where, *of_rules, common_place, common)

    @property
    def printed(self) -> TSKModel:
        """The model that the written numbers are."""
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
    """Slopes and places of rules that say their value at one level of a category; what is common.

    Where all rows have a level their slopes are known but for a constant, and that level has none.
    It is the commonest one of the rule; of two levels, of which one has a common slope, the other:
    the slope that is left then stands in its place. All of it where that is no more to say.
    """
    slopes, places, is_common = slopes.copy(), places.copy(), is_common.copy()
    whole = [one.inputs for one in categories(model).values() if not one.others]
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
    """Deviation of every output, and of the noise about it, (n_outputs,) each; positive."""
    if model.target is None:
        change = np.abs(slopes) * (model.maximum - model.minimum)[:, None]
        scale = np.ptp(model.coefficients[:, 0], axis=0) + change.max(axis=(0, 1))
    else:
        scale = model.target.spread
    scale = np.where(scale > 0.0, scale, 1.0)
    noise = 0.0 * scale if model.posterior is None else model.posterior.noise
    return scale, np.clip(noise, _FINEST * scale, scale)


def _written_terms(model, digits):
    """The model with its terms as they are written, and which of them say by name where they turn.

    A name that somebody has given stays. Where every training row is on one side of a cut, to so
    many digits but not to all, the width is left out, and the cut is crisp. So are conditions that
    others of the same rule imply, as that it is no other level of a category.
    """
    antecedent = model.antecedent
    default, of_digits = default_term_names(model), default_term_names(model, digits)
    names, says_where = list(model.term_names), np.zeros(len(default), dtype=bool)
    groups, start, seen = [], 0, model.seen_values
    sure = np.log(10.0 ** max(digits, PRECISION) - 1.0) if digits < MOST_DIGITS else np.inf
    for group in antecedent.groups:
        theta = _rounded_theta(group, digits)
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
        written = written.without_implied(UNSAID, columns_of(model))
    return replace(model, antecedent=written, term_names=tuple(names)), says_where


def _rounded_theta(group, digits):
    """Parameters of terms: places to digits of the width, all others to so many digits."""
    natural = group.family.natural(group.theta)
    parameters = group.family.parameters
    width = natural[[one.kind for one in parameters].index("log_width")]
    theta = np.empty_like(natural)
    for row, parameter, values in zip(theta, parameters, natural, strict=True):
        if parameter.kind == "location":
            row[:] = rounded(values, width, digits)
        else:
            row[:] = np.log(rounded(values, values, digits))
    return theta
