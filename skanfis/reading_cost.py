"""The reading cost of a model: how many numerals there are to read in its rules' sentences."""

from .antecedent import Antecedent

# A condition that others imply to within this truth value is not written.
UNSAID = 0.01


def reading_cost(antecedent: Antecedent, n_slopes: int, n_outputs: int) -> int:
    """Numerals that a person reads in the rules' sentences.

    One is counted for each term in a rule, unless other terms of the rule imply it; and, for every
    output, for the value of every rule and for each slope. A slope that several rules share counts
    once (``n_slopes`` is of all rules); "no change with x" in its place counts as a slope. How many
    rows a rule stands for, its share, its error and its number do not count.
    """
    n_conditions = int((antecedent.without_implied(UNSAID).rule_terms >= 0).sum())
    return n_conditions + n_outputs * (antecedent.n_rules + n_slopes)
