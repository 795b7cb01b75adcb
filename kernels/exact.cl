// Provides: Plane: a triangle as one lane's ray meets it, by the numbers as given, in float64 with error bounds and in expansions;
//           exact_inside, exact_after, exact_nearer: decisions that are right.
// Needs: expansion.cl, rays.cl, geometry.cl, triangle.cl.  Reads: nothing.
//
// With a, b, c the corners less the origin, d the direction, n = (v1 - v0) x (v2 - v0):
//   edge functions d.(b x c), d.(c x a), d.(a x b); rate = d.n; offset = a.n; t = offset / rate.
// Float64 errors, u = 2^-53: a difference is off by u of itself, a product of two by 3u, their difference and the third factor
// and sums add 4u: each triple product is off by at most 8u of its permanent (the same sum of absolute values); 16u is used,
// which also covers the rounding of the permanent.
#define DOUBLE_BOUND 0x1p-49
#define UNDERFLOW 0x1p-900  // a float64 result this small may have lost its sign to underflow

typedef struct {
    double edge[3], edge_error[3];
    double rate, rate_error;
    double offset, offset_error;
} Plane;

static inline void triple_double(const double *d, const double *p, const double *q, double *value, double *error) {
    double sum = 0, size = 0;
    for (int a = 0; a < 3; a++) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        sum += d[a] * (p[b] * q[c] - p[c] * q[b]);
        size += fabs(d[a]) * (fabs(p[b] * q[c]) + fabs(p[c] * q[b]));
    }
    *value = sum;
    *error = DOUBLE_BOUND * size + UNDERFLOW;
}

// rate and offset alone.
static inline void plane_distance_double(const Geometry *geometry, const double *origin, const double *direction, int slot, Plane *plane) {
    global const double *v = geometry->vertices + 9 * (size_t)slot;
    double corner[3], e1[3], e2[3];
    for (int a = 0; a < 3; a++) {
        corner[a] = v[a] - origin[a];
        e1[a] = v[3 + a] - v[a];
        e2[a] = v[6 + a] - v[a];
    }
    triple_double(direction, e1, e2, &plane->rate, &plane->rate_error);
    triple_double(corner, e1, e2, &plane->offset, &plane->offset_error);
}

// The edge functions alone.
static inline void plane_edges_double(const Geometry *geometry, const double *origin, const double *direction, int slot, Plane *plane) {
    global const double *v = geometry->vertices + 9 * (size_t)slot;
    double corner[3][3];
    for (int a = 0; a < 3; a++)
        for (int c = 0; c < 3; c++) corner[c][a] = v[3 * c + a] - origin[a];
    for (int c = 0; c < 3; c++)
        triple_double(direction, corner[(c + 1) % 3], corner[(c + 2) % 3], plane->edge + c, plane->edge_error + c);
}

// The same numbers without error, made only where float64 cannot decide.
static inline void exact_edges(const Geometry *geometry, const double *origin, const double *direction, int slot, Expansion *edge) {
    global const double *v = geometry->vertices + 9 * (size_t)slot;
    Expansion corner[3][3], d[3];
    for (int a = 0; a < 3; a++) {
        expansion_single(direction[a], d + a);
        for (int c = 0; c < 3; c++) expansion_difference(v[3 * c + a], origin[a], &corner[c][a]);
    }
    for (int c = 0; c < 3; c++) expansion_triple(d, corner[(c + 1) % 3], corner[(c + 2) % 3], edge + c);
}

static inline void exact_distance(const Geometry *geometry, const double *origin, const double *direction, int slot, Expansion *offset,
                           Expansion *rate) {
    global const double *v = geometry->vertices + 9 * (size_t)slot;
    Expansion corner[3], d[3], e1[3], e2[3];
    for (int a = 0; a < 3; a++) {
        expansion_single(direction[a], d + a);
        expansion_difference(v[a], origin[a], corner + a);
        expansion_difference(v[3 + a], v[a], e1 + a);
        expansion_difference(v[6 + a], v[a], e2 + a);
    }
    expansion_triple(corner, e1, e2, offset);
    expansion_triple(d, e1, e2, rate);
}

static inline int sign_double(double value, double error) { return value > error ? 1 : value < -error ? -1 : 0; }

// Whether the ray meets the closed triangle: no two edge functions of opposite sign, and not all zero (in the plane, or no area).
// `stage` rises to 2 where expansions were needed.
static inline int exact_inside(const Geometry *geometry, const double *origin, const double *direction, int slot, const Plane *plane, int *stage) {
    int positive = 0, negative = 0, unsure = 0;
    for (int c = 0; c < 3; c++) {
        const int sign = sign_double(plane->edge[c], plane->edge_error[c]);
        positive |= sign > 0;
        negative |= sign < 0;
        unsure |= sign == 0;
    }
    if (positive && negative) return 0;
    if (!unsure) return 1;
    *stage = 2;
    Expansion edge[3];
    exact_edges(geometry, origin, direction, slot, edge);
    positive = negative = 0;
    for (int c = 0; c < 3; c++) {
        positive |= expansion_sign(edge + c) > 0;
        negative |= expansion_sign(edge + c) < 0;
    }
    return positive != negative;
}

// The sign of t - limit.
static inline int exact_after(const Geometry *geometry, const double *origin, const double *direction, int slot, const Plane *plane, double limit,
                       int *stage) {
    if (!(fabs(limit) < INFINITY)) return limit > 0 ? -1 : 1;
    const double value = plane->offset - limit * plane->rate;
    const double error = plane->offset_error + fabs(limit) * plane->rate_error + 0x1p-51 * (fabs(plane->offset) + fabs(limit * plane->rate));
    const int sign = sign_double(value, error), rate_sign = sign_double(plane->rate, plane->rate_error);
    if (sign && rate_sign) return sign * rate_sign;
    *stage = 2;
    Expansion offset, rate;
    exact_distance(geometry, origin, direction, slot, &offset, &rate);
    const int true_rate_sign = expansion_sign(&rate);
    expansion_add_scaled(&offset, &rate, -limit);
    return expansion_sign(&offset) * true_rate_sign;
}

// The sign of t(slot) - t(other).
static inline int exact_nearer(const Geometry *geometry, const double *origin, const double *direction, int slot, const Plane *plane, int other,
                        int *stage) {
    Plane q;
    plane_distance_double(geometry, origin, direction, other, &q);
    const double left = plane->offset * q.rate, right = q.offset * plane->rate;
    const double error = plane->offset_error * fabs(q.rate) + fabs(plane->offset) * q.rate_error + plane->offset_error * q.rate_error +
                         q.offset_error * fabs(plane->rate) + fabs(q.offset) * plane->rate_error + q.offset_error * plane->rate_error;
    const int sign = sign_double(left - right, error * (1 + 0x1p-40) + 0x1p-50 * (fabs(left) + fabs(right)) + UNDERFLOW);
    const int signs = sign_double(plane->rate, plane->rate_error) * sign_double(q.rate, q.rate_error);
    if (sign && signs) return sign * signs;
    *stage = 2;
    Expansion offset, rate, other_offset, other_rate, difference;
    exact_distance(geometry, origin, direction, slot, &offset, &rate);
    exact_distance(geometry, origin, direction, other, &other_offset, &other_rate);
    difference.count = 0;
    expansion_add_product(&difference, &offset, &other_rate, 1.0);
    expansion_add_product(&difference, &other_offset, &rate, -1.0);
    return expansion_sign(&difference) * expansion_sign(&rate) * expansion_sign(&other_rate);
}

// t, u, v of a hit without error but for the last few bits; a zero is exactly zero.
static __attribute__((noinline)) void exact_record(const Geometry *geometry, const double *origin, const double *direction, int slot,
                                                   double *t, double *u, double *v) {
    Expansion edge[3], offset, rate;
    exact_edges(geometry, origin, direction, slot, edge);
    exact_distance(geometry, origin, direction, slot, &offset, &rate);
    const double divisor = expansion_value(&rate);
    *t = expansion_value(&offset) / divisor;
    *u = expansion_value(edge + 1) / divisor;
    *v = expansion_value(edge + 2) / divisor;
}

HOT double size_double(const double *a) { return fabs(a[0]) + fabs(a[1]) + fabs(a[2]); }

//@hook finish
    // The records of cast.cl stand where each triple product is known to 2^-33 of itself: then t, u, v are off by less than 2^-31.
    // A permanent is at most sqrt(2)|p||q||r|, so an error is below 2^-48 of the product of the sums of absolute values; `near` adds
    // 4u^2 of what it is the difference of.
    double origin[3], far[3];
    for (int axis = 0; axis < 3; axis++) {
        origin[axis] = ray->origin[axis];
        far[axis] = fabs(a[axis]) + fabs(s * d[axis]);
    }
    const double near_error = 0x1p-48 * size_double(near) + 0x1p-103 * size_double(far), size_1 = size_double(e1), size_2 = size_double(e2);
    const double d_error = size_double(d) * near_error, least = fabs(rate) * 0x1p-33;
    const int sure = 0x1p-48 * size_double(d) * size_1 * size_2 + UNDERFLOW <= least && d_error * size_2 + UNDERFLOW <= fabs(u) * least &&
                     d_error * size_1 + UNDERFLOW <= fabs(v) * least && near_error * size_1 * size_2 + UNDERFLOW <= fabs(t) * least;
    if (!sure) {
        Geometry geometry;
        geometry.vertices = vertices;
        exact_record(&geometry, origin, d, slot, &t, &u, &v);
    }
//@end
