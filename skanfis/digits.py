"""Numbers written for people: only digits that matter, no exponent while there is room."""

import numpy as np

# 17 significant digits identify every double; more add nothing.
MOST_DIGITS = 17
_DECIMALS_OF_PERCENT = 9  # further ones are rounding errors
# Part of a unit of the last digit that counts as a rounding error.
_ROUNDING = 1e-6


def rounded(values, unit, digits):
    """Round values to ``digits`` significant digits of a unit."""
    decimals = digits - 1 - np.floor(np.log10(unit)).astype(int)
    # Python's own rounding is right to the last digit at every size; NumPy's is not.
    return np.vectorize(round, otypes=[float])(np.asarray(values, dtype=float), decimals) + 0.0


def plain(value):
    """Write a number that has been rounded, with all its digits."""
    return repr(float(value) + 0.0).removesuffix(".0")


def in_digits(value, digits):
    """Write a value with ``digits`` significant digits."""
    return plain(f"{float(value):.{digits - 1}e}")


def range_in_digits(low, high, digits):
    """Write "0.1 to 63.5", in ``digits`` digits of the width, or of the ends if that is zero."""
    if 0.0 < (width := float(high) - float(low)) < np.inf:
        return " to ".join(map(plain, rounded([low, high], width, digits)))
    return " to ".join(in_digits(end, digits) for end in (low, high))


def limits_in_digits(low, high, digits):
    """The ends of a range in ``digits`` digits of its width, rounded outwards: it still holds."""
    if not 0.0 < (width := float(high) - float(low)) < np.inf:
        return [plain(low), plain(high)]
    # Less than half a unit of the last digit: ends of no more digits stay as they are.
    room = (0.5 - _ROUNDING) * 10.0 ** (np.floor(np.log10(width)) - digits + 1)
    return [plain(end) for end in rounded([low - room, high + room], width, digits)]


def told_apart(values, fewest):
    """Write numbers in ``fewest`` digits, or in more if needed to tell them apart."""
    for digits in range(fewest, MOST_DIGITS + 1):
        texts = [in_digits(value, digits) for value in values]
        if len(set(texts)) == len(set(values)):
            break
    return texts


def percent(part):
    """Write "48 %", "6.5 %", and never "100 %" of a part that is less."""
    share = round(100.0 * part, _DECIMALS_OF_PERCENT)
    return f"{told_apart([share, 100.0], 2)[0]} %"


def counted(number_of, what):
    """Say "1 rule", "12 rules"."""
    return f"{number_of} {what}" + ("" if str(number_of) == "1" else "s")
