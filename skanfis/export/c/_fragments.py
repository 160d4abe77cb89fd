"""C that is the same for every model: helper functions, and pieces of the main one."""

__all__ = [
    "CENTRE",
    "FINITE_INPUT",
    "HOLD",
    "INPUTS",
    "LIMIT",
    "NEAR",
    "NORMALISE",
    "REJECT_NAN",
    "REJECT_UNTOUCHED",
    "SATURATE",
    "rejection",
]

NORMALISE = """
/* Turns n logarithms into shares that add up to one. */
static void $name_normalise($real *l, $int n)
{
    $int i;
    $real top = l[0], sum = 0.0R;
    for (i = 1; i < n; ++i) {
        if (l[i] > top) {
            top = l[i];
        }
    }
    for (i = 0; i < n; ++i) {
        l[i] = $EXP(l[i] - top);
        sum += l[i];
    }
    sum = 1.0R / sum;
    for (i = 0; i < n; ++i) {
        l[i] *= sum;
    }
}
"""

# Near the foot of the only term that speaks its derivative is huge, and all but the mean: what is
# left of it would have no digits.
CENTRE = """
/* Subtracts from n derivatives their mean by the n shares. */
static void $name_centre($real *s, const $real *share, $int n)
{
    $int i, top = 0;
    $real most, mean = 0.0R;
    for (i = 1; i < n; ++i) {
        if (share[i] > share[top]) {
            top = i;
        }
    }
    most = s[top];
    for (i = 0; i < n; ++i) {
        s[i] -= most;
        mean += share[i] * s[i];
    }
    for (i = 0; i < n; ++i) {
        s[i] -= mean;
    }
}
"""

NEAR = """
/* Of a rule in coverage: its share, falling with the distance from where its data lie. */
static $real $name_near(const $real *u, const $real *p)
{
    const $real *centre = p + 2, *factor = p + 2 + $NAME_N_INPUTS;
    $real square = 0.0R, beyond;
    int i, k;
    for (i = 0; i < $NAME_N_INPUTS; ++i) {
        $real t = 0.0R;
        for (k = 0; k <= i; ++k) {
            t += *factor++ * (u[k] - centre[k]);
        }
        square += t * t;
    }
    if (square <= p[1] * p[1]) {
        return p[0];
    }
    beyond = $SQRT(square) - p[1];
    return p[0] * $EXP(-0.5R * beyond * beyond);
}
"""

LIMIT = """
            if (e[i] > $name_reach[i]) {
                e[i] = $name_reach[i];
            } else if (e[i] < -$name_reach[i]) {
                e[i] = -$name_reach[i];
            }
"""

HOLD = """
        if (y[o] < $name_output_low[o]) {
            y[o] = $name_output_low[o];
        } else if (y[o] > $name_output_high[o]) {
            y[o] = $name_output_high[o];
        }
"""

REJECT_UNTOUCHED = """
/* No outputs: y stays as it is. */
#define $NAME_REJECT(y, status) ((status) | $NAME_NO_OUTPUT)
"""

REJECT_NAN = """
/* No outputs: y becomes NaN where there is such a thing, else it stays as it is. */
static int $name_reject($real *y, int status)
{
#ifdef NAN
    int o;
    for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
        y[o] = ($real)NAN;
    }
#else
    (void)y;
#endif
    return status | $NAME_NO_OUTPUT;
}
#define $NAME_REJECT(y, status) $name_reject(y, status)
"""

FINITE_INPUT = """
    for (i = 0; i < $NAME_N_INPUTS; ++i) {
        /* Not (a and b): NaN fails every comparison. */
        if (!(x[i] >= -$MAX && x[i] <= $MAX)) {
            return $NAME_REJECT(y, $NAME_NOT_FINITE);
        }
"""

INPUTS = """
        c[i] = x[i];
        if (c[i] < $name_low[i]) {
            c[i] = $name_low[i];
            status = $NAME_OUT_OF_RANGE;
        } else if (c[i] > $name_high[i]) {
            c[i] = $name_high[i];
            status = $NAME_OUT_OF_RANGE;
        }
"""

SATURATE = """
        /* Not (y < low): NaN, of a fault, fails every comparison. */
        if (!(y[o] >= $name_limits[o][0])) {
            y[o] = $name_limits[o][0];
        } else if (y[o] > $name_limits[o][1]) {
            y[o] = $name_limits[o][1];
        }
"""


def rejection(policy, std):
    """Template of the macro REJECT."""
    return REJECT_NAN if policy == "nan" and std == "c99" else REJECT_UNTOUCHED
