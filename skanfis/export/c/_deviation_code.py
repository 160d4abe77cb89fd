"""Templates of the functions that ``_deviation`` writes."""

from ...membership import MEMBERSHIPS

__all__ = [
    "BEYOND",
    "BY_DISTANCE",
    "CHANGES_OF",
    "DECLARATION",
    "DECLARATION_OF_INTERVAL",
    "GROWTH",
    "INNER",
    "INNER_WITHOUT",
    "INTERVAL",
    "KNOWN",
    "KNOWN_OF_PREMISES",
    "MOVED",
    "PREMISES",
    "PRODUCTS",
    "SUM",
    "TEST",
    "TO_POINT",
]

# Of every family what g[1], g[2] .. are, with s its derivative by x; g[0] is -s. A flank with a
# foot has t = 1 - d * p over its length 1 / p.
_LEFT, _RIGHT = "s * (1.0R - $d0 * $p0) / $p0", "-s * (1.0R + $d1 * $p1) / $p1"
_FEET = f"""
    g[1] = s > 0.0R ? {_LEFT} : 0.0R;
    g[2] = s < 0.0R ? {_RIGHT} : 0.0R;
"""
_PLATEAU = (
    _FEET
    + """    g[3] = 0.5R * ($d0 - $d1 - 1.0R / $p0 - 1.0R / $p1) * (s > 0.0R ? s : -s);
"""
)
_SHOULDER = f"""
    g[1] = {_LEFT};
"""
_CHANGES = {
    "gaussian": """
    g[1] = -s * $d0;
""",
    "bell": """
    const $real u = $d0 * $p0;
    g[1] = -s * $d0;
    g[2] = u < 0.0R || u > 0.0R ? s * $d0 * $LOG(u < 0.0R ? -u : u) : 0.0R;
""",
    "triangular": _FEET,
    "trapezoidal": _PLATEAU,
    "pi_shaped": _PLATEAU,
    "two_sided_gaussian": """
    g[1] = s > 0.0R ? -s * ($d0 + $p0) : 0.0R;
    g[2] = s < 0.0R ? -s * ($d0 - $p0) : 0.0R;
    g[3] = $p0 * (s > 0.0R ? s : -s);
""",
    "s_shaped": _SHOULDER,
    "z_shaped": _SHOULDER,
    "sigmoid_difference": """
    const $real u = $d0 * $p0;
    g[1] = $p1 * ($name_sigmoid(-$p1 - u) + $name_sigmoid(u - $p1) + 2.0R * ($EXP(-$p2) - 1.0R));
    g[2] = -s * $d0 - g[1];
""",
    "sigmoid_product": """
    const $real rise = $p2 + $d0 * $p0, fall = $p3 - $d0 * $p1;
    const $real by_rise = $name_sigmoid(-rise), by_fall = $name_sigmoid(-fall);
    g[1] = by_rise * $p2 + by_fall * $p3;
    g[2] = -by_rise * rise;
    g[3] = -by_fall * fall;
""",
}
CHANGES_OF = {MEMBERSHIPS[name]: body for name, body in _CHANGES.items()}

PRODUCTS = """
    f = $name_factor;
    for (a = 0; a < $n; ++a) {
        $real sum = 0.0R;
        for (b = 0; b <= a; ++b) {
            sum += *f++ * phi[b];
        }
        u[a] = sum;
    }
"""
PREMISES = """
    for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
        for (a = 0; a < $n_terms; ++a) {
            t[a] = 0.0R;
        }
$sums
        for (a = 0; a < $n_parameters; ++a) {
            change[a] = g[a] * t[$name_deviation_term[a]] * $name_inverse_unit[o];
        }
        for (a = 0; a < $q; ++a) {
            $real sum = 0.0R;
            for (b = 0; b < $n_parameters; ++b) {
                sum += $name_premises[a][b] * change[b];
            }
            for (b = 0; b < $n; ++b) {
                sum -= $name_cross[o][a][b] * phi[b];
            }
            v[o * $q + a] = sum;
        }
    }
"""
INNER = """
/* Inner product of two of what $name_halves writes, of output o. */
static $real $name_inner(const $real *h, const $real *k, int o)
{
    $real sum = 0.0R, of_premises = 0.0R;
    long a;
    for (a = 0; a < $n; ++a) {
        sum += h[a] * k[a];
    }
    sum *= $name_noise[o] * $name_noise[o];
    for (a = 0; a < $q; ++a) {
        of_premises += h[$n + o * $q + a] * k[$n + o * $q + a];
    }
    sum += of_premises;
$known    return sum;
}
"""
INNER_WITHOUT = """
/* Inner product of two of what $name_halves writes, of output o. */
static $real $name_inner(const $real *h, const $real *k, int o)
{
    $real sum = 0.0R;
    long a;
    for (a = 0; a < $n; ++a) {
        sum += h[a] * k[a];
    }
    sum *= $name_noise[o] * $name_noise[o];
$known    return sum;
}
"""
KNOWN = """
    {
        int j;
        for (j = 0; j < $n_pinned; ++j) {
            const $real *p = $name_pinned[o][j];
            $real one = 0.0R, other = 0.0R;
            for (a = 0; a < $n; ++a) {
                one += p[a] * h[a];
                other += p[a] * k[a];
            }
$of_premises            sum -= one * other;
        }
        if (h == k && sum < 0.0R) {
            sum = 0.0R;
        }
    }
"""
KNOWN_OF_PREMISES = """            for (a = 0; a < $q; ++a) {
                one += p[$n + a] * h[$n + o * $q + a];
                other += p[$n + a] * k[$n + o * $q + a];
            }
"""
BEYOND = """
    for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
        off[o] = 0.0R;
    }
    if (status != $NAME_IN_RANGE) {
        static const $real of_slope[$n_steps] = { $of_slope };
        static const $real at_edge[$n_steps] = { $at_edge };
        $real length = 0.0R, top = 0.0R, part;
        for (i = 0; i < $NAME_N_INPUTS; ++i) {
            e[i] = (x[i] - c[i]) * $measure;
            top = e[i] > top ? e[i] : -e[i] > top ? -e[i] : top;
        }
        for (i = 0; i < $NAME_N_INPUTS && top > 0.0R; ++i) {
            length += e[i] / top * (e[i] / top);
        }
        length = top * $SQRT(length);
        part = length > 0.0R ? $step / length : 0.0R;
        for (a = 0; a < $all; ++a) {
            slope[a] = half[a] = 0.0R;
        }
        for (k = 0; k < $n_steps; ++k) {
$inside
            for (a = 0; a < $all; ++a) {
                slope[a] += of_slope[k] * near[a];
                half[a] += at_edge[k] * near[a];
            }
        }
        for (a = 0; a < $all; ++a) {
            slope[a] *= length / $step;
        }
$unfollowed
    }
"""
# A step inside: to a point, or, in single precision, by a distance that no digit is lost of.
TO_POINT = """
            for (i = 0; i < $NAME_N_INPUTS; ++i) {
                e[i] = c[i] - (($real)(k + 1)) * ((x[i] - c[i]) * part);
            }
            $name_halves(e, near);
"""
BY_DISTANCE = """
            for (i = 0; i < $NAME_N_INPUTS; ++i) {
                e[i] = (($real)(k + 1)) * ((x[i] - c[i]) * part);
            }
            $name_halves(c, e, near);
"""
MOVED = """
/* Constants of term i, for x - e in place of x. */
static const $real *$name_moved$k(int i, $real e, $real *p)
{
    int m;
    for (m = 0; m < $n_constants; ++m) {
        p[m] = $name_terms$k[i][m];
    }
    for (m = $first; m < $last; ++m) {
        p[m] += e;
    }
    return p;
}
"""

SUM = """
    for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
        $real square = $name_noise[o] * $name_noise[o] + $name_inner(half, half, o);
$growth        deviation[o] = $SQRT(square) * $name_unit[o];
    }
    return status;
}
"""
GROWTH = """        if (status != $NAME_IN_RANGE) {
            const $real both = $name_inner(half, slope, o);
            const $real left = off[o] * $name_inverse_unit[o];
            square += $name_inner(slope, slope, o) + left * left;
            square += both > 0.0R ? 2.0R * both : 0.0R;
        }
"""

INTERVAL = """
int $name_interval(const $real x[$NAME_N_INPUTS],
    $real lower[$NAME_N_OUTPUTS], $real upper[$NAME_N_OUTPUTS])
{
    static const $real reach[$NAME_N_OUTPUTS] = $reach;
    $real y[$NAME_N_OUTPUTS], deviation[$NAME_N_OUTPUTS];
    int o, status = $name_predict(x, y);
    if (status & $NAME_NO_OUTPUT) {
        (void)$NAME_REJECT(lower, status);
        return $NAME_REJECT(upper, status);
    }
    (void)$name_deviation(x, deviation);
    for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
        lower[o] = y[o] - reach[o] * deviation[o];
        upper[o] = y[o] + reach[o] * deviation[o];
    }
    return status;
}
"""

DECLARATION = """
/* Writes the standard deviation of a new measurement about what $name_predict answers, and returns
   the same status, but for the coverage, which it does not judge. */
int $name_deviation(const $real x[$NAME_N_INPUTS], $real deviation[$NAME_N_OUTPUTS]);
"""
DECLARATION_OF_INTERVAL = """
/* Writes the ends of an interval that is to cover $percent % of new measurements, and returns the
   status of $name_predict. */
int $name_interval(const $real x[$NAME_N_INPUTS],
    $real lower[$NAME_N_OUTPUTS], $real upper[$NAME_N_OUTPUTS]);
"""

TEST = """
static const $real $name_test_deviation[$n_test][$NAME_N_OUTPUTS] =
$deviations;

/* As much as they may be off. */
static const $real $name_test_deviation_tolerance[$n_test][$NAME_N_OUTPUTS] =
$tolerance;

/* Returns 0, or 2000 and the number of the first row that fails. */
static int $name_deviation_test(void)
{
    int i, o;
    for (i = 0; i < $n_test; ++i) {
        $real s[$NAME_N_OUTPUTS];
        const int status = $name_deviation($name_test_x[i], s);
        if (status != ($name_test_status[i] & ~$NAME_UNCOVERED)) {
            return 2001 + i;
        }
        for (o = 0; o < $NAME_N_OUTPUTS && !(status & $NAME_NO_OUTPUT); ++o) {
            const $real off = s[o] - $name_test_deviation[i][o];
            const $real allowed = $name_test_deviation_tolerance[i][o]$factor;
            if (!(off <= allowed && -off <= allowed)) {
                return 2001 + i;
            }
        }
    }
    return 0;
}
"""
