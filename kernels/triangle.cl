// Provides: edge_functions: on which side of a triangle's three edges its rays pass; fetch_test; plane_hit; ray_given.
// Needs: lanes.cl, rays.cl, geometry.cl.  Reads: nothing.
//
// Rays that share their origin o (the eye, a point light) use planes through o and each edge, N = b x c of the corners seen from o,
// computed from the given numbers in float64 and rounded once (prepare.cl): a test is three dot products.
// What counts is how large a result r of the wrong sign can be. With P_i the products and S = |P_1| + |P_2| + |P_3| <= |d||N|, in
// r = fl(q + P_3), q = fl(P_1 + P_2), fused or not, it is off by at most uS (N rounded) + uS (products) + u|q| + u|r|. Of the wrong sign, |r| is
// itself below that, so q is -P_3 but for O(u): |q| <= S/2 + O(u) S. Together below 2.5u (1 + 16u) |N| for |d| <= 1 + 5u: `bound` = 3u max|N|, to which the
// float64 error of N itself, 16 * 2^-53 max|b||c|, is added, and UNDERFLOWN for what is too small for `real`. Beyond it the sign of r is right.
// Other rays use Moeller and Trumbore (1997) on v0, e1, e2, rounded from the given numbers relative to the local origin. With
// reach >= |o - v0| + |e| and m = max(|e1|, |e2|), each of u, v, w is a triple product of such lengths: 9 roundings of terms
// below reach m |d| for T.(d x e2), a shift of 2u reach m for the rounded origin, corner and edges, three of those in w = det - u - v:
// together below 48u reach m; `bound` = 64u m. UNDERFLOWN is more than what products lose that are too small for `real`, of tiny triangles
// with rays from near them.
//
// triangle_test, of each rung, takes the nearest hits of the `live` lanes. Where a triangle was `picked` for the packet by its box, most tests
// meet it: to go on in any case costs less than a branch that is often foretold wrongly.
typedef struct {
    real_n lowest, highest;  // of the three edge functions: one sign for all three means inside
    real_n bound;            // each edge function's error is below it
} EdgeFunctions;

HOT EdgeFunctions edge_functions(const Geometry *geometry, const Rays *rays, real_n reach, int slot, const int shared) {
    real_n u, v, w;
    EdgeFunctions f;
    if (shared == SHARED_ORIGIN) {
        global const EdgePlanes *plane = geometry->planes + slot;
        u = dot_uniform(rays->direction, plane->u);
        v = dot_uniform(rays->direction, plane->v);
        w = dot_uniform(rays->direction, plane->w);
        f.bound = (real_n)plane->bound;
    }
    //@ edge_functions
    else {
#pragma OPENCL FP_CONTRACT ON
        global const Triangle *triangle = geometry->triangles + slot;
        const real_n *d = rays->direction;
        global const real *e1 = triangle->e1, *e2 = triangle->e2;
        const real_n p[3] = {d[1] * e2[2] - d[2] * e2[1], d[2] * e2[0] - d[0] * e2[2], d[0] * e2[1] - d[1] * e2[0]};
        const real_n t[3] = {rays->origin[0] - triangle->v0[0], rays->origin[1] - triangle->v0[1], rays->origin[2] - triangle->v0[2]};
        const real_n q[3] = {t[1] * e1[2] - t[2] * e1[1], t[2] * e1[0] - t[0] * e1[2], t[0] * e1[1] - t[1] * e1[0]};
        u = dot_n(t, p);
        v = dot_n(d, q);
        w = dot_uniform(p, e1) - u - v;
        f.bound = multiply_add(reach, (real_n)triangle->bound, (real_n)UNDERFLOWN);
    }
    f.lowest = min_n(min_n(u, v), w);
    f.highest = max_n(max_n(u, v), w);
    return f;
}

// Asks memory for what a test reads first.
HOT void fetch_test(const Geometry *geometry, int slot, const int shared) {
    if (shared == SHARED_ORIGIN) fetch_ahead(geometry->planes + slot);
    //@ fetch_test
    else fetch_ahead(geometry->triangles + slot);
}

// The distance to the triangle's plane, t = offset / rate with offset = n.(v0 - o), rate = n.d.
//   rate is off by (1 + 3)u |n||d| and d times the float64 error of n, offset by u of itself and the float64 error of n.(v0 - o)
//   (shared origin), or by 8u reach |n| (rounded origin and corner, difference, dot product) and reach times the
//   error of n, the quotient by 2u. Rates below 2 (8u |n|) are grazing; above, the true rate is more than half of
//   the computed one, and with |rate| <= |n||d|, t is off by less than (2 |t|) (8u |n|) / |rate|, or
//   2 (|t| + reach) (8u |n|) / |rate|; normal_bound is 8u |n| and 4 times the error of n.
//   For a shared origin with |t| = |offset / rate| and 1 <= |n| (1 + 9u) / |rate| all of it is t_bound / rate^2, with
//   t_bound = 2 (|offset| normal_bound + |n| the float64 error of n.(v0 - o)), raised by 2^-19 for its own roundings; n and offset are scaled by
//   a power of two, which changes no t, so that it stays in range; n of other rays, too.
typedef struct {
    real_n t, error;
    mask_n grazing;  // lanes that run so nearly inside the plane that t means nothing
} PlaneHit;

HOT PlaneHit plane_hit(const Geometry *geometry, const Rays *rays, real_n reach, int slot, const int shared) {
    real_n offset, rate, normal_bound, t_bound, offset_error;
    if (shared == SHARED_ORIGIN) {
        global const EdgePlanes *plane = geometry->planes + slot;
        offset = (real_n)plane->offset;
        rate = dot_uniform(rays->direction, plane->normal);
        normal_bound = (real_n)plane->normal_bound;
        t_bound = (real_n)plane->t_bound;
    } else {
        global const Triangle *triangle = geometry->triangles + slot;
        const real_n to_corner[3] = {triangle->v0[0] - rays->origin[0], triangle->v0[1] - rays->origin[1], triangle->v0[2] - rays->origin[2]};
        offset = dot_uniform(to_corner, triangle->normal);
        rate = dot_uniform(rays->direction, triangle->normal);
        normal_bound = (real_n)triangle->normal_bound;
        offset_error = reach * normal_bound;
    }
    PlaneHit hit;
    const real_n inverse = R(1.0) / rate;
    hit.t = offset * inverse;
    if (shared == SHARED_ORIGIN) hit.error = inverse * inverse * t_bound;
    else hit.error = multiply_add(abs_n(hit.t), normal_bound, offset_error) * abs_n(R(2.0) * inverse);
    hit.grazing = is_at_most(abs_n(rate), R(2.0) * normal_bound);
    return hit;
}

HOT void cross_double(const double *a, const double *b, double *c) {
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}
HOT double dot_double(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// One lane's ray by the numbers as given: origin, direction, and the open interval of t in units of the direction's length.
HOT void ray_given(const Geometry *geometry, const Rays *rays, int lane, const int shared, double *origin, double *direction,
                      double *t_min, double *t_max) {
    //@ ray_given
    real along[LANES], from[LANES];
    for (int a = 0; a < 3; a++) {
        store_lanes(rays->origin[a], from);
        store_lanes(rays->direction[a], along);
        origin[a] = shared == SHARED_ORIGIN ? geometry->shared_origin[a] : geometry->local_origin[a] + (double)from[lane];
        direction[a] = (double)along[lane];
    }
    store_lanes(rays->t_min, from);
    store_lanes(rays->t_max, along);
    *t_min = (double)from[lane];
    *t_max = (double)along[lane];
}

// The length of the direction as given, which turns its t into one along the unit direction that lanes use.
HOT double ray_length(const Rays *rays, int lane) {
    //@ ray_length
    return 1.0;
}
