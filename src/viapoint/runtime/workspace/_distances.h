/* Distances between segments, cuboids and polygons, one pair at a time: the formulas of distances.py and
   boxes.py, which say where they come from. Points are three doubles. */

#include <math.h>

#include "../_numbers.h"

static const double NEAR_PARALLEL = 1e-10;
static const double TINY = 1e-300;

static inline double within(double x, double a, double b) { return x < a ? a : x > b ? b : x; }
static inline double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static inline void minus(const double *a, const double *b, double *out)
{
    for (int i = 0; i < 3; i++) out[i] = a[i] - b[i];
}

static inline void between(const double *a, const double *b, double t, double *out)
{
    for (int i = 0; i < 3; i++) out[i] = a[i] + t * (b[i] - a[i]);
}

static inline double point_segment(const double *point, const double *start, const double *end)
{
    double along[3], towards[3];
    minus(end, start, along);
    minus(point, start, towards);
    double t = within(dot(towards, along) / higher(dot(along, along), TINY), 0.0, 1.0);
    for (int i = 0; i < 3; i++) towards[i] -= t * along[i];
    return sqrt(dot(towards, towards));
}

static inline double segment_segment(const double *p0, const double *p1, const double *q0, const double *q1)
{
    double u[3], v[3], gap[3];
    minus(p1, p0, u);
    minus(q1, q0, v);
    minus(p0, q0, gap);
    double a = dot(u, u), b = dot(u, v), e = dot(v, v), c = dot(u, gap), f = dot(v, gap);
    double area = a * e - b * b;
    double s = within((b * f - c * e) / higher(area, TINY), 0.0, 1.0);
    double t = within((b * s + f) / higher(e, TINY), 0.0, 1.0);
    s = within((b * t - c) / higher(a, TINY), 0.0, 1.0);
    for (int i = 0; i < 3; i++) gap[i] += s * u[i] - t * v[i];
    double distance = sqrt(dot(gap, gap));
    if (area <= NEAR_PARALLEL * a * e) {
        double first = lower(point_segment(p0, q0, q1), point_segment(p1, q0, q1));
        double second = lower(point_segment(q0, p0, p1), point_segment(q1, p0, p1));
        distance = lower(distance, lower(first, second));
    }
    return distance;
}

static inline double point_box(const double *point, const double *half)
{
    double outside = 0.0, deepest = -INFINITY;
    for (int i = 0; i < 3; i++) {
        double over = fabs(point[i]) - half[i];
        deepest = higher(deepest, over);
        if (over > 0.0) outside += over * over;
    }
    return outside > 0.0 ? sqrt(outside) : deepest;
}

static inline double excess(double x, double half) { return x - within(x, -half, half); }

/* Depth of the deepest point of a segment that meets its cuboid. */
static double depth_in_box(const double *start, const double *along, const double *half)
{
    double offset[6], slope[6], t[17], deepest = -INFINITY;
    int count = 2;
    for (int i = 0; i < 3; i++) {
        offset[i] = half[i] - start[i];
        offset[3 + i] = half[i] + start[i];
        slope[i] = -along[i];
        slope[3 + i] = along[i];
    }
    t[0] = 0.0;
    t[1] = 1.0;
    for (int i = 0; i < 6; i++)
        for (int j = i + 1; j < 6; j++)
            if (slope[i] != slope[j])
                t[count++] = within((offset[j] - offset[i]) / (slope[i] - slope[j]), 0.0, 1.0);
    for (int k = 0; k < count; k++) {
        double least = INFINITY;
        for (int i = 0; i < 6; i++) least = lower(least, offset[i] + t[k] * slope[i]);
        deepest = higher(deepest, least);
    }
    return deepest;
}

static double segment_box(const double *start, const double *end, const double *half)
{
    double along[3], t[8] = {0.0, 1.0};
    double t_down = 0.0, t_up = 1.0, g_down = -INFINITY, g_up = INFINITY;
    int count = 2;
    minus(end, start, along);
    for (int i = 0; i < 3; i++)
        if (along[i] != 0.0) {
            t[count++] = within((-half[i] - start[i]) / along[i], 0.0, 1.0);
            t[count++] = within((half[i] - start[i]) / along[i], 0.0, 1.0);
        }
    for (int k = 0; k < count; k++) {
        double slope = 0.0;
        for (int i = 0; i < 3; i++) slope += excess(start[i] + t[k] * along[i], half[i]) * along[i];
        if (slope <= 0.0) {
            t_down = higher(t_down, t[k]);
            g_down = higher(g_down, slope);
        }
        if (slope >= 0.0) {
            t_up = lower(t_up, t[k]);
            g_up = lower(g_up, slope);
        }
    }
    double share = 0.0;
    if (isfinite(g_down)) share = !isfinite(g_up) ? 1.0 : g_up > g_down ? -g_down / (g_up - g_down) : 0.5;
    double nearest = t_down + share * (t_up - t_down), square = 0.0;
    for (int i = 0; i < 3; i++) {
        double gap = excess(start[i] + nearest * along[i], half[i]);
        square += gap * gap;
    }
    return square > 0.0 ? sqrt(square) : -depth_in_box(start, along, half);
}

/* A bound on it from below: that of the cuboid in which the segment is the diagonal. */
static inline double segment_box_bound(const double *start, const double *end, const double *half)
{
    double square = 0.0;
    for (int i = 0; i < 3; i++) {
        double gap = higher(lower(start[i], end[i]), -higher(start[i], end[i])) - half[i];
        if (gap > 0.0) square += gap * gap;
    }
    return sqrt(square);
}

/* Whether a point is over a convex polygon of `count` corners, counter-clockwise about its normal. */
static int over_polygon(const double *point, const double *corners, int count, const double *normal)
{
    for (int k = 0; k < count; k++) {
        const double *a = corners + 3 * k, *b = corners + 3 * ((k + 1) % count);
        double edge[3], towards[3], inward[3];
        minus(b, a, edge);
        minus(point, a, towards);
        for (int i = 0; i < 3; i++) {
            int j = (i + 1) % 3, l = (i + 2) % 3;
            inward[i] = normal[j] * edge[l] - normal[l] * edge[j];
        }
        if (!(dot(towards, inward) >= 0.0)) return 0;
    }
    return 1;
}

static double segment_polygon(
    const double *start, const double *end, const double *corners, int count, const double *normal)
{
    double distance = INFINITY, from[3], place[3];
    for (int k = 0; k < count; k++)
        distance = lower(distance, segment_segment(start, end, corners + 3 * k, corners + 3 * ((k + 1) % count)));
    minus(start, corners, from);
    double h0 = dot(from, normal);
    minus(end, corners, from);
    double h1 = dot(from, normal);
    if (fabs(h0) < distance && over_polygon(start, corners, count, normal)) distance = fabs(h0);
    if (fabs(h1) < distance && over_polygon(end, corners, count, normal)) distance = fabs(h1);
    if ((h0 < 0.0) != (h1 < 0.0)) {
        between(start, end, h0 / (h0 - h1), place);
        if (over_polygon(place, corners, count, normal)) return 0.0;
    }
    return distance;
}

/* Cuboids: `count` rotations R_base_box row by row, centres in the base, half extents; and the shell of their
   union, `pieces` polygons of `sides` corners with their normals. */
struct Boxes {
    int count, pieces, sides;
    const double *R, *centre, *half, *corners, *normals;
};

static inline void into_box(const struct Boxes *boxes, int k, const double *point, double *out)
{
    const double *R = boxes->R + 9 * k;
    double from[3];
    minus(point, boxes->centre + 3 * k, from);
    for (int j = 0; j < 3; j++) out[j] = from[0] * R[j] + from[1] * R[3 + j] + from[2] * R[6 + j];
}

static inline double box_clearance(
    const struct Boxes *boxes, int k, const double *start, const double *end, double radius, double ample)
{
    double a[3], b[3];
    into_box(boxes, k, start, a);
    into_box(boxes, k, end, b);
    double bound = segment_box_bound(a, b, boxes->half + 3 * k) - radius;
    return bound < ample ? segment_box(a, b, boxes->half + 3 * k) - radius : bound;
}

static double point_boxes(const struct Boxes *boxes, const double *point)
{
    double least = INFINITY, at[3];
    for (int k = 0; k < boxes->count; k++) {
        into_box(boxes, k, point, at);
        least = lower(least, point_box(at, boxes->half + 3 * k));
    }
    return least;
}

/* How far a segment is outside of the union; `scratch` holds twice as many doubles as there are cuboids. */
static double excursion(const struct Boxes *boxes, const double *start, const double *end, double *scratch)
{
    double *enter = scratch, *leave = scratch + boxes->count, reached = -INFINITY, place[3];
    for (int k = 0; k < boxes->count; k++) {
        const double *half = boxes->half + 3 * k;
        double a[3], b[3], first = -INFINITY, last = INFINITY;
        int misses = 0;
        into_box(boxes, k, start, a);
        into_box(boxes, k, end, b);
        for (int i = 0; i < 3; i++) {
            double along = b[i] - a[i], one = (-half[i] - a[i]) / along, other = (half[i] - a[i]) / along;
            if (fabs(along) > 0.0) {
                first = higher(first, lower(one, other));
                last = lower(last, higher(one, other));
            } else {
                first = higher(first, 0.0);
                last = lower(last, 1.0);
                misses |= fabs(a[i]) > half[i];
            }
        }
        misses |= first > last;
        first = misses ? 1.0 : within(first, 0.0, 1.0);
        last = misses ? 0.0 : within(last, 0.0, 1.0);
        int at = k;
        for (; at > 0 && enter[at - 1] > first; at--) {
            enter[at] = enter[at - 1];
            leave[at] = leave[at - 1];
        }
        enter[at] = first;
        leave[at] = last;
    }
    double most = higher(point_boxes(boxes, start), point_boxes(boxes, end));
    for (int k = 0; k < boxes->count; k++) {
        reached = higher(reached, leave[k]);
        between(start, end, 0.5 * (reached + (k + 1 < boxes->count ? enter[k + 1] : 1.0)), place);
        most = higher(most, point_boxes(boxes, place));
    }
    return higher(most, 0.0);
}

/* How far a capsule is from leaving the union, as Union.clearance. */
static double union_clearance(const struct Boxes *boxes, const double *start, const double *end, double radius,
    double ample, double joined, double *scratch)
{
    double depth = -INFINITY, a[3], b[3], from[3];
    for (int k = 0; k < boxes->count; k++) {
        const double *half = boxes->half + 3 * k;
        into_box(boxes, k, start, a);
        into_box(boxes, k, end, b);
        depth = higher(depth, -higher(point_box(a, half), point_box(b, half)));
    }
    int inside = boxes->count > 1 && depth < radius + ample;
    if (inside && point_boxes(boxes, start) <= joined && point_boxes(boxes, end) <= joined) {
        double nearest = INFINITY;
        for (int k = 0; k < boxes->pieces; k++) {
            const double *corners = boxes->corners + 3 * k * boxes->sides, *normal = boxes->normals + 3 * k;
            minus(start, corners, from);
            double h0 = dot(from, normal);
            minus(end, corners, from);
            double h1 = dot(from, normal), gap = (h0 > 0.0) == (h1 > 0.0) ? lower(fabs(h0), fabs(h1)) : 0.0;
            if (gap < radius + ample) gap = segment_polygon(start, end, corners, boxes->sides, normal);
            nearest = lower(nearest, gap);
        }
        depth = higher(depth, nearest);
    } else if (inside)
        depth = higher(depth, 0.0);
    if (depth <= 0.0) depth = -excursion(boxes, start, end, scratch);
    return depth - radius;
}
