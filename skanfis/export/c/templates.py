"""Templates of the C code of a model.

The words before a "|" are facts, see ``Source.facts``: a line is written if all of them hold.
``Dialect.write`` fills in ``$`` words. A helper or table is written only if it is used.
"""

_REJECT_UNTOUCHED = """
/* No outputs: y stays as it is. */
#define $NAME_REJECT(y, status) ((status) | $NAME_NO_OUTPUT)
"""
_REJECT_NAN = """
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
# The head of a loop over the inputs.
FINITE_INPUT = """
    for (i = 0; i < $NAME_N_INPUTS; ++i) {
        /* Also true for NaN, which fails every comparison. */
        if (!(x[i] >= -$MAX && x[i] <= $MAX)) {
            return $NAME_REJECT(y, $NAME_NOT_FINITE);
        }
"""

MEMBERSHIP = """
/* $what of a membership: $family. */
static $real $name_$of$family($real x, const $real *p)
{
$lines
}
"""
# Logarithms l of the terms of every table, or with "slope" their derivatives t along e.
TERMS = """
      |    for (i = 0; i < $count; ++i) {
share |        l[$at] = $name_$family(z[$name_term_input[$at]], $name_terms$table[i]);
slope |        t[$at] = e[$name_term_input[$at]]
slope |            * $name_d_$family(z[$name_term_input[$at]], $name_terms$table[i]);
      |    }
"""
# For every input of a grid: shares in place of logarithms, or the derivatives.
SHARES = """
share |    $name_normalise(&l[$start], $count);
slope |    $name_centre(&t[$start], &l[$start], $count);
"""
# Strengths w of rules, or the derivatives s of their logarithms. ONE is for a single rule without
# terms. A grid takes products of shares, so that there is one exponential per term, not per rule
# and input; a table takes normalised sums of logarithms.
ONE = """
share |    w[0] = 1.0R;
slope |    s[0] = 0.0R;
"""
TABLE = """
           |$terms
grid       |$shares
share none |    l[$n_terms] = 0.0R;
slope none |    t[$n_terms] = 0.0R;
           |    for (r = 0; r < $n_rules; ++r) {
share grid |        w[r] = 1.0R;
share sums |        w[r] = 0.0R;
slope      |        s[r] = 0.0R;
           |        for (k = 0; k < $n_places; ++k) {
share grid |            w[r] *= l[$name_rule_terms[r][k]];
share sums |            w[r] += l[$name_rule_terms[r][k]];
slope      |            s[r] += t[$name_rule_terms[r][k]];
           |        }
           |    }
share sums |    $name_normalise(w, $n_rules);
slope sums |    $name_centre(s, w, $n_rules);
"""
# From the root on, the strength of node i of a tree, w[$n_rules + i], is split between its two
# sides, with one exponential per node. Odds are limited to those 80 widths off the cut: 2e-35 does
# not change any sum of strengths. So no branch depends on the row's side of the cut.
TREE = """
share |    w[$n_rules] = 1.0R;
slope |    s[$n_rules] = 0.0R;
      |    for (i = 0; i < $n_nodes; ++i) {
      |        const $int k = $name_node_input[i];
slope |        const $real ahead = e[k] * $name_nodes[i][1];
      |        $real odds, above;
      |        $real u = (z[k] - $name_nodes[i][0]) * $name_nodes[i][1];
      |        u = u < -80.0R ? -80.0R : u;
      |        odds = $EXP(-u);
      |        above = 1.0R / (1.0R + odds);
share |        w[$name_node_ends[i][0]] = w[$n_rules + i] * above;
share |        w[$name_node_ends[i][1]] = w[$n_rules + i] * (odds * above);
slope |        s[$name_node_ends[i][0]] = s[$n_rules + i] + odds * above * ahead;
slope |        s[$name_node_ends[i][1]] = s[$n_rules + i] - above * ahead;
      |    }
"""

# Helpers that the functions below, or helpers below, may call.
_NORMALISE = """
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
# Near the foot of the only active term, its derivative is huge and almost equal to the mean, so
# that their difference would lose all digits. So the strongest term's is subtracted first.
_CENTRE = """
/* Subtracts from n derivatives their mean, weighted by the n shares. */
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
_NEAR = """
/* What a rule adds to the coverage: its share, which falls with the distance from its data. */
static $real $name_near(const $real *z, const $real *p)
{
    const $real *centre = p + 2, *factor = p + 2 + $NAME_N_INPUTS;
    $real square = 0.0R, beyond;
    int i, k;
    for (i = 0; i < $NAME_N_INPUTS; ++i) {
        $real t = 0.0R;
        for (k = 0; k <= i; ++k) {
            t += *factor++ * (z[k] - centre[k]);
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
_COVERAGE = """
/* The coverage in the box; once the sum is enough, no more rules are added. */
static $real $name_coverage(const $real *z, const $real *w, $real enough)
{
    $real covered = 0.0R;
    $int r;

    for (r = 0; r < $n_rules; ++r) {
        if (covered < enough && $name_support[r][0] > 0.0R) {
            covered += w[r] * $name_near(z, $name_support[r]);
        }
    }
    return covered;
}
"""
HELPERS = {"normalise": _NORMALISE, "centre": _CENTRE, "near": _NEAR, "coverage": _COVERAGE}

TANGENT = """
plain       |/* Adds the derivative of every output along e. */
moves       |/* Adds the derivative of every output along the way of the inputs of group g.
moves       |   Inputs of other groups than 0 and g are held at $name_tangent_at. */
plain       |static void $name_tangent($given, const $real *e, $real *change)
moves       |static void $name_tangent(const $real *at, const $real *way, $int g, $real *change)
            |{
table       |    $real t[$n_logarithms];
            |    $real s[$n_strengths];
moves table |    $real l[$n_logarithms];
moves       |    $real w[$n_strengths], z[$NAME_N_INPUTS], e[$NAME_N_INPUTS];
            |    $int r, o;
terms       |    $int i;
slopes      |    $int j;
table       |    $int k;
            |
moves       |    for (i = 0; i < $NAME_N_INPUTS; ++i) {
moves       |        const $int group = $name_tangent_group[i];
moves       |        e[i] = group == g ? way[i] : 0.0R;
moves       |        z[i] = group == 0 || group == g ? at[i] : $name_tangent_at[i];
moves       |    }
moves       |$strengths
            |$slopes
            |    for (r = 0; r < $n_rules; ++r) {
            |        for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
            |            $real f = $name_consequents[r][o][0], ahead = 0.0R;
slopes      |            for (j = 0; j < $n_slopes; ++j) {
slopes      |                f += $name_consequents[r][o][1 + j] * z[$slope_input];
slopes      |                ahead += $name_consequents[r][o][1 + j] * e[$slope_input];
slopes      |            }
            |            change[o] += w[r] * (s[r] * f + ahead);
            |        }
            |    }
            |}
"""
PREDICT = """
      |$linkageint $name_predict(const $real x[$NAME_N_INPUTS], $real y[$NAME_N_OUTPUTS])
      |{
      |    /* z: the inputs, held in the box, minus the reference. */
      |    $real z[$NAME_N_INPUTS], sum[$NAME_N_OUTPUTS], w[$n_strengths];
table |    $real l[$n_logarithms];
beyond|    $real e[$NAME_N_INPUTS];
linear|    $real change[$NAME_N_OUTPUTS];
covers|    $real top = 0.0R, enough = $limit;
covers|    $int best = 0;
      |    int status = $NAME_IN_RANGE;
      |    $int i, r, o;
slopes|    $int j;
table |    $int k;
      |
      |$finite_input
      |        z[i] = x[i];
      |        if (z[i] < $name_low[i]) {
      |            z[i] = $name_low[i];
      |            status = $NAME_OUT_OF_RANGE;
      |        }
      |        if (z[i] > $name_high[i]) {
      |            z[i] = $name_high[i];
      |            status = $NAME_OUT_OF_RANGE;
      |        }
beyond|        e[i] = x[i] - z[i];
      |        z[i] -= $name_reference[i];
      |    }
silent|    if (status != $NAME_IN_RANGE) {
silent|        return $NAME_REJECT(y, status);
silent|    }
      |$strengths
      |
      |    for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
      |        sum[o] = 0.0R;
      |    }
      |    for (r = 0; r < $n_rules; ++r) {
covers|        if (w[r] > top) {
covers|            top = w[r];
covers|            best = r;
covers|        }
      |        for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
      |            $real f = $name_consequents[r][o][0];
slopes|            for (j = 0; j < $n_slopes; ++j) {
slopes|                f += $name_consequents[r][o][1 + j] * z[$slope_input];
slopes|            }
      |            sum[o] += w[r] * f;
      |        }
      |    }
beyond|    if (status != $NAME_IN_RANGE) {
fades |        $real distance = 0.0R;
linear|        $real scale = 1.0R;
beyond|        for (i = 0; i < $NAME_N_INPUTS; ++i) {
fades |            const $real d = e[i] * $name_inverse_spread[i];
fades |            distance += d * d;
linear|            if (e[i] > $name_reach[i]) {
linear|                e[i] = $name_reach[i];
linear|            }
linear|            if (e[i] < -$name_reach[i]) {
linear|                e[i] = -$name_reach[i];
linear|            }
linear|            scale += (e[i] < 0.0R ? -e[i] : e[i]) * $name_inverse_spread[i];
beyond|        }
fades |        /* The coverage falls with the distance from the box: so more is asked for in it. */
fades |        enough = $limit * $EXP(0.5R * distance);
linear|        /* Along a part of the way, scaled back below: else products could overflow. */
linear|        for (i = 0; i < $NAME_N_INPUTS; ++i) {
linear|            e[i] /= scale;
linear|        }
linear|        for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
linear|            change[o] = 0.0R;
linear|        }
plain |        $name_tangent($taken, e, change);
moves |        for (i = 0; i < $n_groups; ++i) {
moves |            $name_tangent(z, e, i, change);
moves |        }
linear|        for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
linear|            sum[o] += scale * change[o];
linear|        }
beyond|    }
covers|    if (top * $name_near(z, $name_support[best]) < enough
covers|        && $name_coverage(z, w, enough) < enough) {
covers|        status |= $NAME_UNCOVERED;
covers|    }
      |    /* y is written last, so that it may be the same array as x. */
      |    for (o = 0; o < $NAME_N_OUTPUTS; ++o) {
      |        y[o] = $name_offset[o] + sum[o];
asked |        /* Also true for NaN, which only a fault can give. */
asked |        if (!(y[o] >= $name_output_low[o])) {
told  |        if (y[o] < $name_output_low[o]) {
held  |            y[o] = $name_output_low[o];
held  |        }
held  |        if (y[o] > $name_output_high[o]) {
held  |            y[o] = $name_output_high[o];
held  |        }
      |    }
      |    return status;
      |}
"""


def rejection(policy, std):
    """Template of the macro REJECT for a policy."""
    return _REJECT_NAN if policy == "nan" and std == "c99" else _REJECT_UNTOUCHED
