# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True, initializedcheck=False
"""Compiled arithmetic of the path's axis functions and their speeds: the twins are `chebyshev` and `speeds`."""

import numpy as np

from libc.math cimport INFINITY, fabs, isfinite, rint, sqrt

from viapoint.runtime.kernel import chebyshev as _twin

cdef extern from "../_numbers.h" nogil:
    Py_ssize_t last_below(const double *, Py_ssize_t, double)

cdef extern from "_columns.h" nogil:
    enum: NODES
    void polynomials(double, double *)
    void sums(const double *, const double *, Py_ssize_t, Py_ssize_t, double *)
    void evaluated(Py_ssize_t, const double *, const long long *, const double *, Py_ssize_t, Py_ssize_t, double *)
    void weighed(Py_ssize_t, const double *, const double *, Py_ssize_t, double *)

cdef enum:
    ORDERS = 4

cdef int TRAILING = _twin.TRAILING

cdef double ROUNDING = _twin.ROUNDING
cdef double TURN = 2.0 * np.pi
cdef double[:, ::1] TO_COEFFICIENTS = _twin.TO_COEFFICIENTS
cdef double[:, ::1] INTEGRATE = _twin.INTEGRATE

if _twin.DEGREE + 1 != NODES:
    raise ImportError("the compiled cells are of another degree than their twin's")


def coefficients(const double[:, :, ::1] values, bint rounded):
    """Values (C, D+1, m) at the nodes to Chebyshev coefficients; `rounded`: tiny ones are zero."""
    cdef Py_ssize_t cell, k, axes = values.shape[2]
    cdef double *row
    result = np.empty((values.shape[0], NODES, axes))
    cdef double[:, :, ::1] coeffs = result
    if not result.size:
        return result
    weighed(values.shape[0], &TO_COEFFICIENTS[0, 0], &values[0, 0, 0], axes, &coeffs[0, 0, 0])
    if rounded:
        for cell in range(values.shape[0]):
            row = &coeffs[cell, 2, 0]
            for k in range((NODES - 2) * axes):
                row[k] = 0.0 if fabs(row[k]) < ROUNDING else row[k]
    return result


def integrals(const double[:, :, ::1] rates, const double[::1] widths):
    """Integrals (C, D+1, m) from each cell's start up to its nodes, of functions given there."""
    cdef Py_ssize_t cell, k, axes = rates.shape[2]
    cdef double half
    cdef double *row
    result = np.empty((rates.shape[0], NODES, axes))
    cdef double[:, :, ::1] values = result
    if not result.size:
        return result
    weighed(rates.shape[0], &INTEGRATE[0, 0], &rates[0, 0, 0], axes, &values[0, 0, 0])
    for cell in range(rates.shape[0]):
        row, half = &values[cell, 0, 0], 0.5 * widths[cell]
        for k in range(NODES * axes):
            row[k] *= half
    return result


def derive(const double[:, :, ::1] coeffs, const double[::1] widths, double[:, :, :, ::1] table):
    """As `chebyshev.derive`."""
    cdef Py_ssize_t cell, order, k, j, axes = coeffs.shape[2]
    cdef double scale
    cdef double *low
    cdef double *high
    for cell in range(coeffs.shape[0]):
        table[cell, 0] = coeffs[cell]
        scale = 2.0 / widths[cell]
        for order in range(1, ORDERS):
            low, high = &table[cell, order - 1, 0, 0], &table[cell, order, 0, 0]
            for j in range(axes):
                high[(NODES - 1) * axes + j] = 0.0
            for k in range(NODES - 1, 0, -1):
                for j in range(axes):
                    high[(k - 1) * axes + j] = 2.0 * k * low[k * axes + j]
                    if k < NODES - 1:
                        high[(k - 1) * axes + j] += high[(k + 1) * axes + j]
            for j in range(axes):
                high[j] *= 0.5
            for k in range(NODES * axes):
                high[k] *= scale


def joined(
    const double[:, :, ::1] values,
    const double[:, :, ::1] coefficients,
    const double[::1] last,
    const long long[::1] owner,
    const unsigned char[::1] given,
    bint at_rest,
    const double[::1] turn,
    const double[::1] lower,
    const double[::1] upper,
    tuple gaps,
    double slack,
):
    """As `joining.Joiner._joined`, from the cells' values and coefficients (C, D+1, m) on: coefficients as they
    continue joints `last` (n,), and what the cells end in (C, n + k); None where something is at fault.

    `given` (S,) are the stretches whose joints are, `gaps` those to close, at rest and in motion.
    """
    cdef Py_ssize_t cells = values.shape[0], m = values.shape[2], n = turn.shape[0], driven = lower.shape[0]
    cdef Py_ssize_t cell, node, j
    cdef double to_close = gaps[0], at_stop = gaps[1], moving = gaps[2], before, gap, whole, largest
    cdef bint head, fixed, turned
    continued, finals = np.empty((cells, NODES, m)), np.empty((cells, driven))
    cdef double[:, :, ::1] coeffs = continued
    cdef double[:, ::1] ends = finals
    cdef double[::1] shift = np.zeros(driven), gapped = np.empty(n)
    coeffs[...] = coefficients
    for cell in range(cells):
        head = cell == 0 or owner[cell] != owner[cell - 1]
        fixed = given[owner[cell]]
        turned = False
        largest = 0.0
        for j in range(n):
            before = last[j] if cell == 0 else values[cell - 1, NODES - 1, j]
            gap = before - values[cell, 0, j]
            whole = turn[j] * rint(gap / TURN)
            gapped[j] = gap - whole
            largest = max(largest, fabs(gapped[j]))
            shift[j] += whole
            turned = turned or shift[j] != 0.0
        if not largest <= (at_stop if fixed or not head or (cell == 0 and at_rest) else moving):
            return None
        if fixed and turned:
            return None
        for node in range(NODES):
            for j in range(driven):
                before = values[cell, node, j] + shift[j]
                if not (before - upper[j] <= slack and lower[j] - before <= slack):
                    return None
        for j in range(driven):
            coeffs[cell, 0, j] += shift[j]
            ends[cell, j] = values[cell, NODES - 1, j] + shift[j]
        if head and largest > to_close:  # along the cell
            for j in range(n):
                coeffs[cell, 0, j] += 0.5 * gapped[j]
                coeffs[cell, 1, j] -= 0.5 * gapped[j]
    return continued, finals


def errors(const double[:, :, ::1] values, const double[:, :, ::1] coefficients, Py_ssize_t joints):
    """As `fitting._errors`."""
    cdef Py_ssize_t cell, node, j, m = values.shape[2]
    found = np.zeros((3, values.shape[0]))
    cdef double[:, ::1] error = found
    cdef double size
    for cell in range(values.shape[0]):
        for node in range(NODES - TRAILING, NODES):
            for j in range(m):
                size = fabs(coefficients[cell, node, j])
                if j < m - 4:
                    error[0, cell] = max(error[0, cell], size)
                else:
                    error[1, cell] = max(error[1, cell], size)
        for node in range(1, NODES):
            for j in range(joints):
                error[2, cell] = max(error[2, cell], fabs(values[cell, node, j] - values[cell, node - 1, j]))
    return found


def tcp_rates(
    const double[:, :, ::1] jacobian, const double[:, ::1] speeds, const double[:, :, ::1] X, const double[::1] lever
):
    """As `sampling._tcp_rates`."""
    cdef Py_ssize_t row, k, j, n = speeds.shape[1]
    cdef double twist[6]
    cdef double arm[3]
    result = np.empty((speeds.shape[0], 2))
    cdef double[:, ::1] rates = result
    for row in range(speeds.shape[0]):
        for k in range(6):
            twist[k] = jacobian[row, k, 0] * speeds[row, 0]
            for j in range(1, n):
                twist[k] += jacobian[row, k, j] * speeds[row, j]
        for k in range(3):
            arm[k] = X[row, k, 0] * lever[0] + X[row, k, 1] * lever[1] + X[row, k, 2] * lever[2]
        twist[0] += twist[4] * arm[2] - twist[5] * arm[1]
        twist[1] += twist[5] * arm[0] - twist[3] * arm[2]
        twist[2] += twist[3] * arm[1] - twist[4] * arm[0]
        rates[row, 0] = sqrt(twist[0] * twist[0] + twist[1] * twist[1] + twist[2] * twist[2])
        rates[row, 1] = sqrt(twist[3] * twist[3] + twist[4] * twist[4] + twist[5] * twist[5])
    return result


def evaluate(
    const double[::1] starts,
    const double[::1] widths,
    const double[:, :, :, ::1] table,
    const double[::1] s,
    tuple orders,
    Py_ssize_t first,
    Py_ssize_t last,
):
    """Derivatives of the asked orders at s (N,), of the columns from `first` to before `last`."""
    cdef Py_ssize_t row, count = s.shape[0], axes = table.shape[3], cell = 0
    cdef double x
    cdef int order
    results = []
    cdef long long[::1] cells = np.empty(count, dtype=np.int64)
    cdef double[:, ::1] bases = np.empty((count, NODES))
    cdef double[:, ::1] values
    for row in range(count):
        cell = _cell(starts, s[row], cell)
        cells[row] = cell
        x = min(max(2.0 * (s[row] - starts[cell]) / widths[cell] - 1.0, -1.0), 1.0)
        polynomials(x, &bases[row, 0])
    for order in orders:
        result = np.empty((count, last - first))
        values = result
        if count > 0 and last > first:
            evaluated(count, &bases[0, 0], &cells[0], &table[0, order, 0, first], axes, last - first, &values[0, 0])
        results.append(result)
    return results


cdef inline Py_ssize_t _cell(const double[::1] starts, double s, Py_ssize_t near) noexcept nogil:
    """The last cell that starts at or before s, or the first; `near` is tried before a search."""
    cdef Py_ssize_t count = starts.shape[0]
    if starts[near] <= s and (near == count - 1 or s < starts[near + 1]):
        return near
    return max(last_below(&starts[0], count, s), 0)


def rate_bounds(
    const double[::1] starts,
    const double[::1] widths,
    const double[:, :, :, ::1] table,
    const double[::1] s,
    const double[::1] begins,
    const double[:, ::1] rules,
    double still,
):
    """As `speeds.rate_bounds`."""
    cdef Py_ssize_t row, cell = 0, piece = 0
    result = np.empty(s.shape[0])
    cdef double[::1] bounds = result
    for row in range(s.shape[0]):
        bounds[row] = _bound(starts, widths, table, s[row], begins, rules, still, &cell, &piece)
    return result


def speed_ratio(
    const double[::1] starts,
    const double[::1] widths,
    const double[:, :, :, ::1] table,
    double before,
    const double[::1] s,
    const double[::1] begins,
    const double[:, ::1] rules,
    double still,
    double tick,
):
    """As `speeds.speed_ratio`."""
    cdef Py_ssize_t row, cell = 0, piece = 0
    cdef double ratio, largest = -INFINITY
    cdef double last = _bound(starts, widths, table, before, begins, rules, still, &cell, &piece), bound
    for row in range(s.shape[0]):
        bound = _bound(starts, widths, table, s[row], begins, rules, still, &cell, &piece)
        ratio = (s[row] - before) / tick / max(bound, last)
        largest = max(largest, ratio)
        before, last = s[row], bound
    return largest


cdef inline double _bound(
    const double[::1] starts,
    const double[::1] widths,
    const double[:, :, :, ::1] table,
    double s,
    const double[::1] begins,
    const double[:, ::1] rules,
    double still,
    Py_ssize_t *cell,
    Py_ssize_t *piece,
) noexcept nogil:
    """The bound at s; `cell` and `piece` are where it lies, near where they were."""
    cdef Py_ssize_t axes = table.shape[3]
    cdef double basis[NODES]
    cdef double rates[2]
    cdef const double *rule
    cdef double x, bound
    piece[0] = _cell(begins, s, piece[0])
    rule = &rules[piece[0], 0]
    if rule[1] == INFINITY and rule[2] == INFINITY and isfinite(rule[0]):
        return rule[0]  # whatever the rates are
    cell[0] = _cell(starts, s, cell[0])
    x = min(max(2.0 * (s - starts[cell[0]]) / widths[cell[0]] - 1.0, -1.0), 1.0)
    polynomials(x, basis)
    sums(basis, &table[cell[0], 1, 0, axes - 2], axes, 2, rates)
    bound = min(_slowest(rule + 1, rates[0], rates[1], still), rule[0])
    if not isfinite(bound):
        bound = min(_slowest(rule + 4, rates[0], rates[1], still), rule[3])
    return bound


cdef inline double _slowest(const double *speeds, double linear, double angular, double still) noexcept nogil:
    cdef double first = speeds[0] / linear if linear > still else INFINITY
    cdef double second = speeds[1] / angular if angular > still else INFINITY
    return min(first, second)
