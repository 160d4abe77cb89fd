r"""Every family of memberships in C: log mu(x) and its derivative by x.

In the templates x is an input about the reference and p the constants of a term, as in
``_numbers``; see ``dialect`` for the other words.

log(1 + exp(-|u|)) stands where Python has log1p, which C89 lacks: it is as exact where it counts,
since an absolute error of log mu is a relative one of the strengths.
"""

from functools import reduce

from ...membership import FAMILIES, PRODUCTS

# A flank with a foot: a function of s, which is zero at the foot and one at the shoulder, over a
# floor. @ is its name, and it has a mu and a slope between the two.
_FLANK = {
    "@": """
/* Logarithm of a flank over a floor; s is zero at its foot, one at its top. */
static $real $name_@($real s)
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
    mu = $mu;
    return $LOG(mu + $floor * ($EXP(below) - mu));
}
""",
    "@_slope": """
/* Its derivative by s. */
static $real $name_@_slope($real s)
{
    const $real t = 1.0R - s;
    $real low, mu;
    if (!(s > 0.0R)) {
        return t;
    }
    mu = $mu;
    low = $floor * $EXP(-0.5R * t * t);
    return ($steep + t * low) / (mu - $floor * mu + low);
}
""",
}


def _flank(profile, mu, steep):
    """Helpers of a profile: mu between foot and shoulder, and (1 - floor) times its slope."""
    words = {"@": profile, "$mu": mu, "$steep": steep}
    return {
        name.replace("@", profile): reduce(lambda t, w: t.replace(*w), words.items(), text)
        for name, text in _FLANK.items()
    }


# Functions that bodies share.
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
    **_flank("linear", "s", "1.0R - $floor"),
    **_flank(
        "spline",
        "s < 0.5R ? 2.0R * s * s : 1.0R - 2.0R * t * t",
        "4.0R * (1.0R - $floor) * (s < 0.5R ? s : t)",
    ),
}


def _two_feet(profile):
    value = """
    const $real left = (x - p[0]) * p[2];
    const $real right = (p[1] - x) * p[3];
    return $name_@(left < right ? left : right);
"""
    slope = """
    const $real left = (x - p[0]) * p[2];
    const $real right = (p[1] - x) * p[3];
    if (left < right) {
        return left < 1.0R ? p[2] * $name_@_slope(left) : 0.0R;
    }
    return right < 1.0R ? -p[3] * $name_@_slope(right) : 0.0R;
"""
    return value.replace("@", profile), slope.replace("@", profile)


# An input that is held at the edge of the box may lie on a corner, where the slope is zero: by the
# distances from the feet, the last bit would decide on which side.
_TRIANGLE_SLOPE = """
    if (x < p[4]) {
        return p[2] * $name_linear_slope((x - p[0]) * p[2]);
    }
    return x > p[4] ? -p[3] * $name_linear_slope((p[1] - x) * p[3]) : 0.0R;
"""
_ONE_FOOT = (
    """
    return $name_spline((x - p[0]) * p[1]);
""",
    """
    const $real s = (x - p[0]) * p[1];
    return s < 1.0R ? p[1] * $name_spline_slope(s) : 0.0R;
""",
)


def _sigmoids(gain, left, right, at_left, at_right):
    """A rise times a fall, whose constants are at these places."""
    value = f"""
    const $real d = x - p[0];
    return {gain}$name_log_sigmoid(p[{at_left}] + d * p[{left}])
        + $name_log_sigmoid(p[{at_right}] - d * p[{right}]);
"""
    slope = f"""
    const $real d = x - p[0];
    return p[{left}] * $name_sigmoid(-p[{at_left}] - d * p[{left}])
        - p[{right}] * $name_sigmoid(d * p[{right}] - p[{at_right}]);
"""
    return value, slope


_SIDE = (
    """
    return $name_log_sigmoid((x - p[0]) * p[1]);
""",
    """
    return p[1] * $name_sigmoid((p[0] - x) * p[1]);
""",
)


# Bodies of functions of x and p: the value, and its derivative by x.
_BY_NAME = {
    "gaussian": (
        """
    const $real t = (x - p[0]) * p[1];
    return -t * t;
""",
        """
    return -2.0R * (x - p[0]) * p[1] * p[1];
""",
    ),
    # 2 log |u| has a floor, log(1e-300), as in Python: at the centre mu is one.
    "bell": (
        """
    const $real u = (x - p[0]) * p[1];
    $real log_square = $smallest_log_square;
    if (u < 0.0R || u > 0.0R) {
        log_square = 2.0R * $LOG(u < 0.0R ? -u : u);
        if (log_square < $smallest_log_square) {
            log_square = $smallest_log_square;
        }
    }
    return $name_log_sigmoid(-p[2] * log_square);
""",
        """
    const $real u = (x - p[0]) * p[1];
    if (!(u < 0.0R || u > 0.0R)) {
        return 0.0R;
    }
    return -2.0R * p[2] * p[1] / u * $name_sigmoid(2.0R * p[2] * $LOG(u < 0.0R ? -u : u));
""",
    ),
    "triangular": (_two_feet("linear")[0], _TRIANGLE_SLOPE),
    "trapezoidal": _two_feet("linear"),
    "two_sided_gaussian": (
        """
    const $real d = x - p[0];
    const $real beyond = (d < 0.0R ? -d : d) - p[1];
    const $real t = beyond > 0.0R ? beyond * (d < 0.0R ? p[2] : p[3]) : 0.0R;
    return -0.5R * t * t;
""",
        """
    const $real d = x - p[0];
    const $real beyond = (d < 0.0R ? -d : d) - p[1];
    const $real per_length = d < 0.0R ? -p[2] : p[3];
    return beyond > 0.0R ? -beyond * per_length * (d < 0.0R ? -per_length : per_length) : 0.0R;
""",
    ),
    "pi_shaped": _two_feet("spline"),
    "s_shaped": _ONE_FOOT,
    "z_shaped": _ONE_FOOT,
    "sigmoid_difference": _sigmoids("p[3] + ", 1, 1, 2, 2),
    **{one.name: _sigmoids("", 1, 2, 3, 4) for one in PRODUCTS.values()},
    "sigmoid_rising": _SIDE,
    "sigmoid_falling": _SIDE,
}

# By the class, since another class may go by the same name.
BODIES = {FAMILIES[name]: in_c for name, in_c in _BY_NAME.items()}

# Exponentials, logarithms and multiplications that a value takes at most.
COSTS = {
    "gaussian": (0, 0, 2),
    "bell": (1, 2, 3),
    "triangular": (1, 1, 5),
    "trapezoidal": (1, 1, 5),
    "two_sided_gaussian": (0, 0, 3),
    "pi_shaped": (1, 1, 7),
    "s_shaped": (1, 1, 6),
    "z_shaped": (1, 1, 6),
    "sigmoid_difference": (2, 2, 2),
    **{one.name: (2, 2, 2) for one in PRODUCTS.values()},
    "sigmoid_rising": (1, 1, 1),
    "sigmoid_falling": (1, 1, 1),
}
