r"""Every family of memberships in C: log mu(x) and its derivative by x.

In the templates a number that ends in R becomes a constant of the type the file is for; ``$d0``,
``$d1`` are distances of x from the term's locations, ``$p0``, ``$p1``, ... its other constants, all
as in ``_constants``; ``$name`` is the prefix of identifiers, ``$real`` the type.

log(1 + exp(-|u|)) stands where Python has log1p, which C89 lacks: it is as exact where it counts,
since an absolute error of log mu is a relative one of the strengths.
"""

from dataclasses import dataclass

from ...membership import MEMBERSHIPS

__all__ = ["BODIES", "HELPERS", "FamilyInC", "words_of"]


@dataclass(frozen=True)
class FamilyInC:
    """Bodies of functions of x and p, a term's constants, and the most that ``value`` takes."""

    value: str
    slope: str
    exponentials: int = 0
    logarithms: int = 0
    multiplications: int = 0


# Functions that bodies share. A flank with a foot is a function of s, which is zero at the foot and
# one at the shoulder.
HELPERS = {
    "log_sigmoid": """
/* Logarithm of 1 / (1 + exp(-u)). */
static $real $name_log_sigmoid($real u)
{
    const $real tail = $LOG(1.0R + $EXP(u < 0.0R ? u : -u));
    return (u < 0.0R ? u : 0.0R) - tail;
}
""",
    "sigmoid": """
/* 1 / (1 + exp(-u)). */
static $real $name_sigmoid($real u)
{
    const $real small = $EXP(u < 0.0R ? u : -u);
    return (u < 0.0R ? small : 1.0R) / (1.0R + small);
}
""",
    "linear": """
/* Logarithm of a straight flank over a floor; s is zero at its foot, one at its top. */
static $real $name_linear($real s)
{
    const $real below = -0.5R * (1.0R - s) * (1.0R - s);
    if (!(s < 1.0R)) {
        return 0.0R;
    }
    if (!(s > 0.0R)) {
        return $log_floor + below;
    }
    return $LOG(s + $floor * ($EXP(below) - s));
}
""",
    "linear_slope": """
/* Its derivative by s. */
static $real $name_linear_slope($real s)
{
    const $real t = 1.0R - s;
    $real low;
    if (!(s > 0.0R)) {
        return t;
    }
    low = $floor * $EXP(-0.5R * t * t);
    return (1.0R - $floor + t * low) / (s - $floor * s + low);
}
""",
    "spline": """
/* Logarithm of a flank of two parabolas over a floor; s is zero at its foot, one at its top. */
static $real $name_spline($real s)
{
    const $real t = 1.0R - s;
    const $real below = -0.5R * t * t;
    $real mu;
    if (!(s < 1.0R)) {
        return 0.0R;
    }
    if (!(s > 0.0R)) {
        return $log_floor + below;
    }
    mu = s < 0.5R ? 2.0R * s * s : 1.0R - 2.0R * t * t;
    return $LOG(mu + $floor * ($EXP(below) - mu));
}
""",
    "spline_slope": """
/* Its derivative by s. */
static $real $name_spline_slope($real s)
{
    const $real t = 1.0R - s;
    $real low, mu;
    if (!(s > 0.0R)) {
        return t;
    }
    mu = s < 0.5R ? 2.0R * s * s : 1.0R - 2.0R * t * t;
    low = $floor * $EXP(-0.5R * t * t);
    return (4.0R * (1.0R - $floor) * (s < 0.5R ? s : t) + t * low) / (mu - $floor * mu + low);
}
""",
}

_TWO_FEET = """
    const $real left = $d0 * $p0;
    const $real right = -$d1 * $p1;
    return $name_@(left < right ? left : right);
"""
_TWO_FEET_SLOPE = """
    const $real left = $d0 * $p0;
    const $real right = -$d1 * $p1;
    if (left < right) {
        return left < 1.0R ? $p0 * $name_@_slope(left) : 0.0R;
    }
    return right < 1.0R ? -$p1 * $name_@_slope(right) : 0.0R;
"""
# An input that is held at the edge of the box may lie on a corner. The last bit then decides on
# which side, or that it is the corner itself, where the slope is zero: so it is the corner that it
# is compared with, not the feet.
_TRIANGLE_SLOPE = """
    if ($d2 < 0.0R) {
        return $p0 * $name_@_slope($d0 * $p0);
    }
    return $d2 > 0.0R ? -$p1 * $name_@_slope(-$d1 * $p1) : 0.0R;
"""
_ONE_FOOT = """
    return $name_@($d0 * $p0);
"""
_ONE_FOOT_SLOPE = """
    const $real s = $d0 * $p0;
    return s < 1.0R ? $p0 * $name_@_slope(s) : 0.0R;
"""


def _two_sided(profile, multiplications, slope=_TWO_FEET_SLOPE):
    value, slope = (body.replace("@", profile) for body in (_TWO_FEET, slope))
    return FamilyInC(value, slope, 1, 1, multiplications)


def _one_sided():
    value, slope = (body.replace("@", "spline") for body in (_ONE_FOOT, _ONE_FOOT_SLOPE))
    return FamilyInC(value, slope, 1, 1, 6)


_BY_NAME = {
    "gaussian": FamilyInC(
        """
    const $real t = $d0 * $p0;
    return -t * t;
""",
        """
    return -2.0R * $d0 * $p0 * $p0;
""",
        multiplications=2,
    ),
    # 2 log |u| has a floor, log(1e-300), as in Python: at the centre mu is one.
    "bell": FamilyInC(
        """
    const $real u = $d0 * $p0;
    $real log_square = $smallest_log_square;
    if (u < 0.0R || u > 0.0R) {
        log_square = 2.0R * $LOG(u < 0.0R ? -u : u);
        if (log_square < $smallest_log_square) {
            log_square = $smallest_log_square;
        }
    }
    return $name_log_sigmoid(-$p1 * log_square);
""",
        """
    const $real u = $d0 * $p0;
    if (!(u < 0.0R || u > 0.0R)) {
        return 0.0R;
    }
    return -2.0R * $p1 * $p0 / u * $name_sigmoid(2.0R * $p1 * $LOG(u < 0.0R ? -u : u));
""",
        exponentials=1,
        logarithms=2,
        multiplications=3,
    ),
    "triangular": _two_sided("linear", 5, _TRIANGLE_SLOPE),
    "trapezoidal": _two_sided("linear", 5),
    "two_sided_gaussian": FamilyInC(
        """
    const $real d = $d0;
    const $real beyond = (d < 0.0R ? -d : d) - $p0;
    const $real t = beyond > 0.0R ? beyond * (d < 0.0R ? $p1 : $p2) : 0.0R;
    return -0.5R * t * t;
""",
        """
    const $real d = $d0;
    const $real beyond = (d < 0.0R ? -d : d) - $p0;
    const $real per_length = d < 0.0R ? -$p1 : $p2;
    return beyond > 0.0R ? -beyond * per_length * (d < 0.0R ? -per_length : per_length) : 0.0R;
""",
        multiplications=3,
    ),
    "pi_shaped": _two_sided("spline", 7),
    "s_shaped": _one_sided(),
    "z_shaped": _one_sided(),
    "sigmoid_difference": FamilyInC(
        """
    const $real u = $d0 * $p0;
    return $p2 + $name_log_sigmoid($p1 + u) + $name_log_sigmoid($p1 - u);
""",
        """
    const $real u = $d0 * $p0;
    return $p0 * ($name_sigmoid(-$p1 - u) - $name_sigmoid(u - $p1));
""",
        exponentials=2,
        logarithms=2,
        multiplications=1,
    ),
    "sigmoid_product": FamilyInC(
        """
    const $real d = $d0;
    return $name_log_sigmoid($p2 + d * $p0) + $name_log_sigmoid($p3 - d * $p1);
""",
        """
    const $real d = $d0;
    return $p0 * $name_sigmoid(-$p2 - d * $p0) - $p1 * $name_sigmoid(d * $p1 - $p3);
""",
        exponentials=2,
        logarithms=2,
        multiplications=2,
    ),
}

# By the class, since another class may go by the same name.
BODIES = {MEMBERSHIPS[name]: in_c for name, in_c in _BY_NAME.items()}


def words_of(terms):
    """What stands for the distances and constants of terms in their family's templates."""
    n, n_columns = terms.n_locations, terms.constants.shape[1]
    rest = [f" - p[{n + k}]" if terms.is_in_two else "" for k in range(n)]
    first = n * (1 + terms.is_in_two)
    distances = {f"d{k}": f"(x - p[{k}]{rest[k]})" for k in range(n)}
    return distances | {f"p{k - first}": f"p[{k}]" for k in range(first, n_columns)}
