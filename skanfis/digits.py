"""Numbers as people read them: as many digits as matter, no exponent while there is room."""

import numpy as np

# More than these tell no two doubles apart, and give back no other double.
MOST_DIGITS = 17


def rounded(values, unit, digits):
    """Values to so many digits of a unit; each is the number nearest to its decimals."""
    decimals = digits - 1 - np.floor(np.log10(unit)).astype(int)
    # Python's own rounding is right to the last digit, and at every size; NumPy's is not.
    return np.vectorize(round, otypes=[float])(np.asarray(values, dtype=float), decimals) + 0.0


def plain(value):
    """A number that has been rounded, as it is."""
    return repr(float(value) + 0.0).removesuffix(".0")


def in_digits(value, digits):
    """Write so many significant digits."""
    return plain(f"{float(value):.{digits - 1}e}")


def range_in_digits(low, high, digits):
    """Write "0.1 to 63.5", to so many digits of the width, or, where there is none, of the ends."""
    if 0.0 < (width := float(high) - float(low)) < np.inf:
        return " to ".join(map(plain, rounded([low, high], width, digits)))
    return " to ".join(in_digits(end, digits) for end in (low, high))


def told_apart(values, fewest):
    """Numbers in ``fewest`` digits, or as many as tell them apart, as those of time stamps."""
    for digits in range(fewest, MOST_DIGITS + 1):
        texts = [in_digits(value, digits) for value in values]
        if len(set(texts)) == len(set(values)):
            break
    return texts
