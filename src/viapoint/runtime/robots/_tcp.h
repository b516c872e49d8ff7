/* Where the tool is, of many rows of joints: the formulas of anthropomorphic.py and of
 * rotations.matrix_to_quaternion, a block of rows side by side, so that compilers vectorise them.
 *
 * Asked for in every tick: sines and cosines are computed here, to the last place or the one before it, since
 * the C library's take one angle at a time. The arm is its row of packed numbers.
 */
#ifndef VIAPOINT_TCP_H
#define VIAPOINT_TCP_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "../_wide.h"

enum { BLOCK = 16, ANGLES = 6 * BLOCK };

static const double FAR_ROUND = 1e5; /* rad: up to here a quarter turn times its count loses no digit */

/* Sine and cosine: less the nearest quarter turns, then the series on -45 ... 45 degrees (fdlibm's). */
static inline void turn(double x, double *sine, double *cosine)
{
    double shifted = x * 6.36619772367581382433e-01 + 6755399441055744.0; /* the count in the lowest bits */
    double count = shifted - 6755399441055744.0;
    double r = (x - count * 1.57079632673412561417e+00) - count * 6.07710050650619224932e-11;
    double z = r * r;
    double odd = r + r * z * (-1.66666666666666324348e-01 + z * (8.33333333332248946124e-03
        + z * (-1.98412698298579493134e-04 + z * (2.75573137070700676789e-06
        + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)))));
    double even = 1.0 - (0.5 * z - z * z * (4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03
        + z * (2.48015872894767294178e-05 + z * (-2.75573143513906633035e-07
        + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11))))));
    uint64_t quarter, s, c;
    memcpy(&quarter, &shifted, 8);
    memcpy(&s, &odd, 8);
    memcpy(&c, &even, 8);
    uint64_t swapped = (s ^ c) & (0 - (quarter & 1));
    s ^= swapped ^ ((quarter & 2) << 62);
    c ^= swapped ^ (((quarter + 1) & 2) << 62);
    memcpy(sine, &s, 8);
    memcpy(cosine, &c, 8);
}

/* Sines and cosines of a block. */
WIDE static void turns(const double *restrict x, double *restrict s, double *restrict c)
{
    for (int i = 0; i < ANGLES; i++) turn(x[i], &s[i], &c[i]);
}

/* TCP positions p (3) and rotations R (9) of a block, by `hand`: from the wrist's frame to the tool, 12 numbers. */
WIDE static void poses(const double *restrict arm, const double *restrict hand, const double *restrict s,
                       const double *restrict c, double *restrict p, double *restrict R)
{
    double height = arm[0], a2x = arm[1], a3z = arm[2], along = arm[3], a4z = arm[4];
    for (int i = 0; i < BLOCK; i++) {
        double s1 = s[i], s2 = s[BLOCK + i], s3 = s[2 * BLOCK + i];
        double c1 = c[i], c2 = c[BLOCK + i], c3 = c[2 * BLOCK + i];
        double s4 = s[3 * BLOCK + i], s5 = s[4 * BLOCK + i], s6 = s[5 * BLOCK + i];
        double c4 = c[3 * BLOCK + i], c5 = c[4 * BLOCK + i], c6 = c[5 * BLOCK + i];
        double s23 = s2 * c3 + c2 * s3, c23 = c2 * c3 - s2 * s3;
        double upper[3] = {c5, s5 * s6, s5 * c6};
        double y[3] = {s4 * s5, c4 * c6 - s4 * c5 * s6, -c4 * s6 - s4 * c5 * c6};
        double lower[3] = {-c4 * s5, s4 * c6 + c4 * c5 * s6, c4 * c5 * c6 - s4 * s6};
        double W[9];
        for (int j = 0; j < 3; j++) {
            double x = c23 * upper[j] + s23 * lower[j];
            W[j] = c1 * x - s1 * y[j];
            W[3 + j] = s1 * x + c1 * y[j];
            W[6 + j] = c23 * lower[j] - s23 * upper[j];
        }
        double radial = a2x + a3z * s2 + along * c23 + a4z * s23;
        double wrist[3] = {radial * c1, radial * s1, height + a3z * c2 - along * s23 + a4z * c23};
        for (int k = 0; k < 3; k++) {
            const double *row = W + 3 * k;
            p[k * BLOCK + i] = wrist[k] + (row[0] * hand[3] + row[1] * hand[7] + row[2] * hand[11]);
            for (int j = 0; j < 3; j++)
                R[(3 * k + j) * BLOCK + i] = row[0] * hand[j] + row[1] * hand[4 + j] + row[2] * hand[8 + j];
        }
    }
}

/* Canonical quaternions (4) of rotations (9) of a block: the row of 4 q q' with the largest diagonal. */
WIDE static void quaternions(const double *restrict R, double half_turn, double *restrict q)
{
    for (int i = 0; i < BLOCK; i++) {
        double xx = R[i], yy = R[4 * BLOCK + i], zz = R[8 * BLOCK + i];
        double zy = R[7 * BLOCK + i], yz = R[5 * BLOCK + i], xz = R[2 * BLOCK + i], zx = R[6 * BLOCK + i];
        double yx = R[3 * BLOCK + i], xy = R[BLOCK + i];
        double w = 1.0 + xx + yy + zz, x = zy - yz, y = xz - zx, z = yx - xy, best = w, other;
        other = 1.0 + xx - yy - zz;
        if (other > best) best = other, w = zy - yz, x = other, y = yx + xy, z = xz + zx;
        other = 1.0 + yy - zz - xx;
        if (other > best) best = other, w = xz - zx, x = yx + xy, y = other, z = zy + yz;
        other = 1.0 + zz - xx - yy;
        if (other > best) best = other, w = yx - xy, x = xz + zx, y = zy + yz, z = other;
        double length = sqrt(w * w + x * x + y * y + z * z), least = half_turn * length;
        double leader = fabs(y) < least ? x : y;
        leader = fabs(z) < least ? leader : z;
        leader = fabs(w) < least ? leader : w;
        length = leader < 0.0 ? -length : length;
        q[i] = w / length;
        q[BLOCK + i] = x / length;
        q[2 * BLOCK + i] = y / length;
        q[3 * BLOCK + i] = z / length;
    }
}

/* Joints (count, 6), `stride` numbers from row to row, to TCP positions (count, 3) and quaternions (count, 4). */
static void tool_centre(const double *arm, const double *hand, const double *joints, long count, long stride,
                        double half_turn, double *position, double *quaternion)
{
    double angle[ANGLES], s[ANGLES], c[ANGLES], p[3 * BLOCK], R[9 * BLOCK], q[4 * BLOCK];
    for (long first = 0; first < count; first += BLOCK) {
        int rows = count - first < BLOCK ? (int)(count - first) : BLOCK, far = 0;
        for (int i = 0; i < BLOCK; i++) {
            const double *row = joints + (first + (i < rows ? i : rows - 1)) * stride;
            for (int k = 0; k < 6; k++) {
                double x = angle[k * BLOCK + i] = row[k] * arm[8 + k];
                far |= !(fabs(x) <= FAR_ROUND);
            }
        }
        turns(angle, s, c);
        for (int i = 0; far && i < ANGLES; i++)
            if (!(fabs(angle[i]) <= FAR_ROUND)) s[i] = sin(angle[i]), c[i] = cos(angle[i]);
        poses(arm, hand, s, c, p, R);
        quaternions(R, half_turn, q);
        for (int i = 0; i < rows; i++) {
            for (int k = 0; k < 3; k++) position[3 * (first + i) + k] = p[k * BLOCK + i];
            for (int k = 0; k < 4; k++) quaternion[4 * (first + i) + k] = q[k * BLOCK + i];
        }
    }
}

#endif
