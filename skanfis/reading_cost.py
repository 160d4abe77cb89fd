"""How much there is to read in the rules of a model: the numerals in their sentences."""

from .antecedent import Antecedent

# What a text does not say of the truth of a condition.
UNSAID = 0.01


def reading_cost(antecedent: Antecedent, n_slopes: int, n_outputs: int = 1) -> int:
    """Numerals that a person reads in the rules' sentences.

    A named term counts as one each time a rule says it, and not where others of the rule imply it.
    So do, of every output, the value of every rule and each slope, one that several rules have in
    common once (``n_slopes`` is of all rules). "No change with x", in place of such a one, counts
    as a slope. How many rows a rule stands for, its share, its error and its number do not count.
    """
    n_conditions = int((antecedent.without_implied(UNSAID).rule_terms >= 0).sum())
    return n_conditions + n_outputs * (antecedent.n_rules + n_slopes)
