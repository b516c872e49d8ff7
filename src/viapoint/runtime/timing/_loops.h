/* Inner loops of the compiled core: elementwise over knots or pieces, so that compilers vectorise them.
 *
 * One call handles both sides of the rows of one axis. `u` is the upper side (room = limit - y), `l` the
 * lower (room = limit + y). Sums over rows are kept per element and added up at the end, in the order of
 * the numpy twin. Not here: step lengths, factorisation, the loop of iterations (_core.pyx).
 */
#ifndef VIAPOINT_LOOPS_H
#define VIAPOINT_LOOPS_H

#include <math.h>

#include "../_numbers.h"
#include "../_wide.h"

WIDE static void bands2(int n, const double *restrict lo, const double *restrict hi, const double *restrict c,
                   double *restrict y) {
    for (int i = 0; i < n; i++) y[i] = lo[i] * c[i] + hi[i] * c[i + 1];
}

WIDE static void bands3(int n, const double *restrict jm, const double *restrict j0, const double *restrict jp,
                   const double *restrict c, double *restrict y) {
    for (int i = 0; i < n; i++) y[i] = jm[i] * c[i] + j0[i] * c[i + 1] + jp[i] * c[i + 2];
}

/* Residuals, inverse slacks, products and worst residuals of both sides. */
WIDE static void measure(int n, const double *restrict above, const double *restrict below, const double *restrict y,
                    double *restrict s, double *restrict z, double *restrict r, double *restrict inv,
                    double *restrict s2, double *restrict z2, double *restrict r2, double *restrict inv2,
                    double *restrict gap, double *restrict worst) {
    for (int i = 0; i < n; i++) {
        double ru = above[i] - y[i] - s[i], rl = below[i] + y[i] - s2[i];
        r[i] = ru;
        r2[i] = rl;
        inv[i] = 1.0 / s[i];
        inv2[i] = 1.0 / s2[i];
        gap[i] += s[i] * z[i] + s2[i] * z2[i];
        double w = lower(ru, rl);
        worst[i] = lower(worst[i], w);
    }
}

/* Weights z/s of both sides: their sum and difference; forces -w r of both: difference and sum. */
WIDE static void weigh(int n, const double *restrict z, const double *restrict r, const double *restrict inv,
                  const double *restrict z2, const double *restrict r2, const double *restrict inv2,
                  double *restrict both, double *restrict skew, double *restrict force, double *restrict total) {
    for (int i = 0; i < n; i++) {
        double wu = z[i] * inv[i], wl = z2[i] * inv2[i];
        double fu = -wu * r[i], fl = -wl * r2[i];
        both[i] = wu + wl;
        skew[i] = wu - wl;
        force[i] = fu - fl;
        total[i] = fu + fl;
    }
}

/* d = ds/s of the predictor on both sides, extremes and products. */
WIDE static void predict(int n, const double *restrict curve, const double *restrict y, const double *restrict s,
                    const double *restrict z, const double *restrict r, const double *restrict inv,
                    double *restrict d, const double *restrict s2, const double *restrict z2,
                    const double *restrict r2, const double *restrict inv2, double *restrict d2,
                    double *restrict low, double *restrict high, double *restrict first, double *restrict second) {
    for (int i = 0; i < n; i++) {
        double tu = (r[i] + (curve[i] - y[i])) * inv[i], tl = (r2[i] + (curve[i] + y[i])) * inv2[i];
        double gu = s[i] * z[i] * tu, gl = s2[i] * z2[i] * tl;
        d[i] = tu;
        d2[i] = tl;
        first[i] += gu + gl;
        second[i] += gu * tu + gl * tl;
        double least = lower(tu, tl), most = higher(tu, tl);
        low[i] = lower(low[i], least);
        high[i] = higher(high[i], most);
    }
}

/* Centring terms (mu - ds dz)/s replace d; forces of both sides: difference and sum. */
WIDE static void centre(int n, double mu, double product, const double *restrict s, const double *restrict z,
                   const double *restrict r, const double *restrict inv, double *restrict d,
                   const double *restrict s2, const double *restrict z2, const double *restrict r2,
                   const double *restrict inv2, double *restrict d2, double *restrict force,
                   double *restrict total) {
    for (int i = 0; i < n; i++) {
        double cu = (mu + product * (s[i] * z[i]) * d[i] * (1.0 + d[i])) * inv[i];
        double cl = (mu + product * (s2[i] * z2[i]) * d2[i] * (1.0 + d2[i])) * inv2[i];
        double fu = cu - z[i] * inv[i] * r[i], fl = cl - z2[i] * inv2[i] * r2[i];
        d[i] = cu;
        d2[i] = cl;
        force[i] = fu - fl;
        total[i] = fu + fl;
    }
}

/* Corrector's steps: ds replaces r, dz replaces d; extremes of ds/s and dz/z. */
WIDE static void direct(int n, const double *restrict curve, const double *restrict y, const double *restrict z,
                   double *restrict r, const double *restrict inv, double *restrict d, const double *restrict z2,
                   double *restrict r2, const double *restrict inv2, double *restrict d2, double *restrict low,
                   double *restrict dual) {
    for (int i = 0; i < n; i++) {
        double su = r[i] + (curve[i] - y[i]), sl = r2[i] + (curve[i] + y[i]);
        double zu = d[i] - z[i] - z[i] * inv[i] * su, zl = d2[i] - z2[i] - z2[i] * inv2[i] * sl;
        r[i] = su;
        r2[i] = sl;
        d[i] = zu;
        d2[i] = zl;
        double us = su * inv[i], ls = sl * inv2[i], uz = zu / z[i], lz = zl / z2[i];
        double primal = lower(us, ls), other = lower(uz, lz);
        low[i] = lower(low[i], primal);
        dual[i] = lower(dual[i], other);
    }
}

WIDE static void advance(int n, double step, const double *restrict change, double *restrict x) {
    for (int i = 0; i < n; i++) x[i] += step * change[i];
}

/* Jerk slacks follow the curved bound, as far as `growth` times themselves. */
WIDE static void follow(int n, double growth, const double *restrict room, const double *restrict y, double *restrict s,
                   double *restrict s2) {
    for (int i = 0; i < n; i++) {
        double ru = room[i] - y[i], rl = room[i] + y[i];
        double bu = growth * s[i], bl = growth * s2[i];
        bu = lower(ru, bu);
        bl = lower(rl, bl);
        s[i] = higher(s[i], bu);
        s2[i] = higher(s2[i], bl);
    }
}

/* Hessian contributions of acceleration rows: on the coefficient before a knot, behind it, and mixed. */
WIDE static void square2(int n, const double *restrict lo, const double *restrict hi, const double *restrict w,
                    double *restrict before, double *restrict behind, double *restrict mixed) {
    for (int i = 0; i < n; i++) {
        double high = w[i] * hi[i];
        behind[i] += high * hi[i];
        before[i] += w[i] * lo[i] * lo[i];
        mixed[i] += high * lo[i];
    }
}

/* Hessian contributions of jerk rows; g: slope of the right side. */
WIDE static void square3(int n, const double *restrict jm, const double *restrict j0, const double *restrict jp,
                    const double *restrict g, const double *restrict both, const double *restrict skew,
                    double *restrict own, double *restrict before, double *restrict behind,
                    double *restrict with_before, double *restrict with_behind, double *restrict across) {
    for (int i = 0; i < n; i++) {
        double tilt = both[i] * j0[i] - skew[i] * g[i], ahead = both[i] * jp[i];
        own[i] += tilt * j0[i] - g[i] * skew[i] * j0[i] + g[i] * g[i] * both[i];
        behind[i] += ahead * jp[i];
        before[i] += both[i] * jm[i] * jm[i];
        with_behind[i] += tilt * jp[i];
        with_before[i] += tilt * jm[i];
        across[i] += ahead * jm[i];
    }
}

WIDE static void back2(int n, const double *restrict lo, const double *restrict hi, const double *restrict force,
                  double *restrict before, double *restrict behind) {
    for (int i = 0; i < n; i++) {
        behind[i] += force[i] * hi[i];
        before[i] += force[i] * lo[i];
    }
}

WIDE static void back3(int n, const double *restrict jm, const double *restrict j0, const double *restrict jp,
                  const double *restrict g, const double *restrict force, const double *restrict total,
                  double *restrict own, double *restrict before, double *restrict behind) {
    for (int i = 0; i < n; i++) {
        own[i] += force[i] * j0[i] - g[i] * total[i];
        behind[i] += force[i] * jp[i];
        before[i] += force[i] * jm[i];
    }
}

/* Differences of one axis y (n,) at ticks over its limits, raising speed (n-1,), acceleration (n-2,), jerk (n-3,). */
WIDE static void differences(int n, double by_v, double by_a, double by_d, double by_j, const double *restrict y,
                        double *restrict speed, double *restrict acceleration, double *restrict jerk) {
    double milder = lower(by_d, by_a);
    for (int i = 0; i < n - 1; i++) {
        double ratio = fabs(y[i + 1] - y[i]) * by_v;
        speed[i] = higher(ratio, speed[i]);
    }
    for (int i = 0; i < n - 2; i++) {
        double before = y[i + 1] - y[i], after = y[i + 2] - y[i + 1];
        double along = fabs(after) >= fabs(before) ? by_a : by_d;
        double scale = before * after < 0.0 ? milder : along;
        double ratio = fabs(after - before) * scale;
        acceleration[i] = higher(ratio, acceleration[i]);
    }
    for (int i = 0; i < n - 3; i++) {
        double first = y[i + 1] - y[i], second = y[i + 2] - y[i + 1], third = y[i + 3] - y[i + 2];
        double ratio = fabs((third - second) - (second - first)) * by_j;
        jerk[i] = higher(ratio, jerk[i]);
    }
}

/* Factor the pentadiagonal matrix with diagonals a, b, e (first and second below) as L D L'; 0 if not positive. */
static int factor(int n, double *restrict a, double *restrict b, double *restrict e) {
    for (int i = 0; i < n; i++) {
        if (i >= 1) a[i] -= b[i - 1] * b[i - 1] * a[i - 1];
        if (i >= 2) a[i] -= e[i - 2] * e[i - 2] * a[i - 2];
        if (!(a[i] > 0.0)) return 0;
        if (i >= 1) b[i] -= e[i - 1] * b[i - 1] * a[i - 1];
        double inverse = 1.0 / a[i];
        b[i] *= inverse;
        e[i] *= inverse;
    }
    return 1;
}

/* Solve L D L' x = r in place, with the factors of `factor`. */
static void substitute(int n, const double *restrict a, const double *restrict b, const double *restrict e,
                       double *restrict r) {
    for (int i = 0; i < n; i++) {
        if (i >= 1) r[i] -= b[i - 1] * r[i - 1];
        if (i >= 2) r[i] -= e[i - 2] * r[i - 2];
    }
    for (int i = 0; i < n; i++) r[i] /= a[i];
    for (int i = n - 1; i >= 0; i--) {
        if (i + 1 < n) r[i] -= b[i] * r[i + 1];
        if (i + 2 < n) r[i] -= e[i] * r[i + 2];
    }
}

static double lowest(int n, const double *x, double start) {
    for (int i = 0; i < n; i++) start = lower(start, x[i]);
    return start;
}

static double highest(int n, const double *x, double start) {
    for (int i = 0; i < n; i++) start = higher(start, x[i]);
    return start;
}

static double sum(int n, const double *x) {
    double total = 0.0;
    for (int i = 0; i < n; i++) total += x[i];
    return total;
}

#endif
