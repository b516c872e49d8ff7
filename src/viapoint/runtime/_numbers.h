/* The lower and the higher of two numbers, and where one stands among ascending ones.
 *
 * Plain comparisons: unlike fmin and fmax they compile to one instruction, also in wide loops. Where one of the
 * two is not a number the second is taken.
 */
#ifndef VIAPOINT_NUMBERS_H
#define VIAPOINT_NUMBERS_H

#include <stddef.h>

static inline double lower(double a, double b) { return a < b ? a : b; }
static inline double higher(double a, double b) { return a > b ? a : b; }

/* The last of `count` ascending x that is at most `at`; -1: none is. */
static inline ptrdiff_t last_below(const double *x, ptrdiff_t count, double at)
{
    ptrdiff_t low = 0, high = count;
    while (low < high) {
        ptrdiff_t middle = (low + high) / 2;
        if (x[middle] <= at) low = middle + 1;
        else high = middle;
    }
    return low - 1;
}

#endif
