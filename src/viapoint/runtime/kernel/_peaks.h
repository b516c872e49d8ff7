/* Inner loop of the peak meter: axes side by side, so that compilers vectorise it. */
#ifndef VIAPOINT_PEAKS_H
#define VIAPOINT_PEAKS_H

#include <math.h>
#include <stddef.h>

#include "../_numbers.h"
#include "../_wide.h"

/* Raise peaks (3, axes) to the first three differences of rows (count, axes), `stride` numbers from row to row.
   `before` (3, axes) is the row before them with its first two differences; it ends as the last row's. */
WIDE static void differences(ptrdiff_t count, ptrdiff_t axes, ptrdiff_t stride, const double *restrict rows,
                             double tick, double *restrict before, double *restrict peaks)
{
    double *restrict position = before, *restrict speed = before + axes, *restrict acceleration = before + 2 * axes;
    double *restrict fastest = peaks, *restrict steepest = peaks + axes, *restrict roughest = peaks + 2 * axes;
    for (ptrdiff_t row = 0; row < count; row++, rows += stride) {
        for (ptrdiff_t k = 0; k < axes; k++) {
            double first = (rows[k] - position[k]) / tick;
            double second = (first - speed[k]) / tick;
            double third = fabs((second - acceleration[k]) / tick), size = fabs(first), bend = fabs(second);
            fastest[k] = higher(size, fastest[k]);
            steepest[k] = higher(bend, steepest[k]);
            roughest[k] = higher(third, roughest[k]);
            position[k] = rows[k];
            speed[k] = first;
            acceleration[k] = second;
        }
    }
}

#endif
