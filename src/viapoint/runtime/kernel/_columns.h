/* Inner loops of the path's axis functions: Chebyshev polynomials at places, and their sums over columns.
 *
 * Every column is summed by itself in the order of the numpy twin, so that widths of vectors change no bit.
 */
#ifndef VIAPOINT_COLUMNS_H
#define VIAPOINT_COLUMNS_H

#include <stddef.h>

#include "../_wide.h"

#define NODES 12
#define LANES 4

/* Polynomials T0 ... T11 at x in -1 ... 1. */
static inline void polynomials(double x, double *basis) {
    basis[0] = 1.0;
    basis[1] = x;
    for (int k = 2; k < NODES; k++) basis[k] = 2.0 * x * basis[k - 1] - basis[k - 2];
}

/* Polynomials, or other weights, times rows (NODES, axes) of `count` columns, a constant, in registers. */
static inline void some(int count, const double *restrict basis, const double *restrict row, ptrdiff_t axes,
                        double *restrict values) {
    double total[LANES];
    for (int i = 0; i < count; i++) total[i] = basis[0] * row[i];
    for (int k = 1; k < NODES; k++) {
        row += axes;
        for (int i = 0; i < count; i++) total[i] += basis[k] * row[i];
    }
    for (int i = 0; i < count; i++) values[i] = total[i];
}

/* The same of any number of columns. */
static inline void sums(const double *restrict basis, const double *restrict coeffs, ptrdiff_t axes,
                        ptrdiff_t columns, double *restrict values) {
    ptrdiff_t j = 0;
    for (; j + LANES <= columns; j += LANES) some(LANES, basis, coeffs + j, axes, values + j);
    for (; j + 2 <= columns; j += 2) some(2, basis, coeffs + j, axes, values + j);
    if (j < columns) some(1, basis, coeffs + j, axes, values + j);
}

/* Values (n, columns) at n places with these polynomials (n, NODES), each by the table (4, NODES, axes) of its
 * cell, of which `coeffs` is the first one's first column asked for. */
WIDE static void evaluated(ptrdiff_t n, const double *restrict bases, const long long *restrict cells,
                           const double *restrict coeffs, ptrdiff_t axes, ptrdiff_t columns,
                           double *restrict values) {
    for (ptrdiff_t i = 0; i < n; i++)
        sums(bases + i * NODES, coeffs + cells[i] * 4 * NODES * axes, axes, columns, values + i * columns);
}

/* Sums (cells, NODES, axes) of the values (cells, NODES, axes) of each cell with weights (NODES, NODES). */
WIDE static void weighed(ptrdiff_t cells, const double *restrict weights, const double *restrict values,
                         ptrdiff_t axes, double *restrict result) {
    for (ptrdiff_t i = 0; i < cells; i++, values += NODES * axes)
        for (ptrdiff_t k = 0; k < NODES; k++, result += axes)
            sums(weights + k * NODES, values, axes, axes, result);
}

#endif
