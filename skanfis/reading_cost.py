"""How much there is to read in the rules of a model: the numerals in their sentences."""


def reading_cost(conditions, slopes, n_outputs: int = 1) -> int:
    """Numerals that a person reads in the rules' sentences.

    A condition counts as one each time a rule says it, and so do a rule's own value and each of its
    slopes, of every output. How many rows a rule stands for, its share, its error and its number
    are not counted.

    Parameters
    ----------
    conditions : iterable of int
        Of each rule, how many inputs its IF part names.
    slopes : iterable of int
        Of each rule, how many slopes its THEN part has.
    n_outputs : int

    Returns
    -------
    int
    """
    return sum(conditions) + n_outputs * sum(1 + own for own in slopes)
