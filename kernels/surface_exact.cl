// Provides: refine_points: where rays of the rung `exact` start from, better than `real` can compute it.
// Needs: exact.cl, hit.cl.  Reads: nothing.

#if LANES == 1
#define absolute_lanes(x) fabs(x)
#define first_if_less(a, b, x, y) ((a) < (b) ? (x) : (y))
#else
#define absolute_lanes(x) PASTE(as_double, LANES)(PASTE(as_long, LANES)(x) & 0x7fffffffffffffffL)
#define first_if_less(a, b, x, y) choose((a) < (b), x, y)
#endif
#define gather_double(same, result, expression)                     \
    if (same) {                                                     \
        const int k = 0;                                            \
        result = (double_n)(expression);                            \
    } else {                                                        \
        double lane_[LANES];                                        \
        for (int k = 0; k < LANES; k++) lane_[k] = (expression);    \
        result = load_lanes(lane_);                                 \
    }

HOT double_n dot_lanes(const double_n *a, const double_n *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
HOT void cross_lanes(const double_n *a, const double_n *b, double_n *c) {
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

// At least 1 / x, by no more than 14%, for x >= 0; a number too large to matter for 0. x = 2^e (1 + m) has the bits (127 + e, m), 0x7f000000 less these is
// 2^-e (1 - m/2), which is between 1 / x and 1.125 / x; a hundredth of the last power of two is added, for the roundings of what it multiplies.
HOT real_n reciprocal_above(real_n x) { return as_real_n((mask_n)0x7f014000 - as_mask_n(x)); }

// As triple_double of exact.cl, all lanes at once.
HOT void triple_lanes(const double_n *d, const double_n *p, const double_n *q, double_n *value, double_n *error) {
    double_n sum = 0, size = 0;
    for (int a = 0; a < 3; a++) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        const double_n one = p[b] * q[c], other = p[c] * q[b];
        sum += d[a] * (one - other);
        size += absolute_lanes(d[a]) * (absolute_lanes(one) + absolute_lanes(other));
    }
    *value = sum;
    *error = DOUBLE_BOUND * size + UNDERFLOW;
}

// The points where rays meet triangles again, in float64 from the numbers as given: rounded once, they lie off the surface by u |P|
// a coordinate, as much again for the offset, and the float64 error; which is what `error` becomes. Spheres keep theirs.
// A point nearer to an edge than 8u |P| is moved to that distance inside its triangle: rounded, it could else lie behind the face
// beyond the edge, and a ray inside of a closed mesh would leave it there.
static __attribute__((noinline)) void refine_points(const Geometry *geometry, const Rays *rays, const int shared, const Hit *hit,
                                                    mask_n active, real_n *point, real_n *error) {
    mask_n refined = active & is_less(load_lanes(hit->slot), (mask_n)geometry->slot_count);
    //@ refine_lanes
    if (!any_lane(refined)) return;
    lane_int slot[LANES];
    store_lanes(choose(refined, load_lanes(hit->slot), NO_LANES), slot);
    const int same = all_same(slot);
    double_n origin[3], direction[3], v[3], e1[3], e2[3], corner[3];
    for (int a = 0; a < 3; a++) {
        double_n v1, v2;
        gather_double(same, v[a], geometry->vertices[9 * (size_t)slot[k] + a]);
        gather_double(same, v1, geometry->vertices[9 * (size_t)slot[k] + 3 + a]);
        gather_double(same, v2, geometry->vertices[9 * (size_t)slot[k] + 6 + a]);
        e1[a] = v1 - v[a];
        e2[a] = v2 - v[a];
        origin[a] = shared == SHARED_ORIGIN ? (double_n)geometry->shared_origin[a] : geometry->local_origin[a] + to_double_n(rays->origin[a]);
        direction[a] = to_double_n(rays->direction[a]);
        corner[a] = v[a] - origin[a];
    }
    double_n rate, rate_error, offset, offset_error;
    triple_lanes(direction, e1, e2, &rate, &rate_error);
    triple_lanes(corner, e1, e2, &offset, &offset_error);
    const double_n t = offset / rate;
    double_n normal[3], at[3], cross[3], sum = 0, size = 0;
    for (int a = 0; a < 3; a++) {
        at[a] = origin[a] - v[a] + t * direction[a];
        size += absolute_lanes(v[a] - geometry->local_origin[a] + at[a]);
    }
    cross_lanes(e1, e2, normal);
    const double_n area = dot_lanes(normal, normal), length = sqrt(area);
    cross_lanes(at, e2, cross);
    const double_n u = dot_lanes(cross, normal) / area;
    cross_lanes(e1, at, cross);
    const double_n w = dot_lanes(cross, normal) / area, rest = 1.0 - u - w;
    const double_n edge_1 = dot_lanes(e1, e1), edge_2 = dot_lanes(e2, e2);
    const double_n longest = sqrt(first_if_less(edge_1, edge_2, edge_2, edge_1)) * 2.0;
    const double_n less = first_if_less(u, w, u, w), least = first_if_less(less, rest, less, rest);
    const double_n needed = 8 * (double)UNIT_ROUNDOFF * size * longest / length, wanted = first_if_less(needed, (double_n)0.1, needed, (double_n)0.1);
    const double_n inwards = first_if_less(least, wanted, (wanted - least) / (1.0 / 3 - least), (double_n)0);
    for (int a = 0; a < 3; a++) {
        const double_n exact = v[a] - geometry->local_origin[a] + at[a] + inwards * ((e1[a] + e2[a]) / 3.0 - at[a]);
        sum += absolute_lanes(exact * to_double_n(hit->geometric[a]));
        point[a] = choose(refined, to_real_n(exact), point[a]);
    }
    const double_n off = (offset_error + absolute_lanes(t) * rate_error) / length;
    *error = choose(refined, to_real_n(2 * (double)UNIT_ROUNDOFF * sum + 2.0 * off), *error);
}

//@hook hit_distance
    mask_n flat = hit->found;
    //@ hit_flat
    t = choose(flat, R(0.5) * (hits->t + hits->low), t);
//@end
//@hook opacity_distance
        t = R(0.5) * (hits.t + hits.low);
//@end
//@hook bounce_start
    const Geometry seen = *geometry;
    const Rays copy = *rays;
    real_n refined[3] = {start[0], start[1], start[2]}, refined_error = error;
    refine_points(&seen, &copy, from->from_eye, hit, active, refined, &refined_error);
    for (int a = 0; a < 3; a++) start[a] = refined[a];
    error = refined_error;
//@end
//@hook shadow_above
    // A ray that ends on a flat triangle ends at its plane, compared exactly: no offset hides what touches it. Lights that shine on it are above it.
    mask_n planar = ALL_LANES;
    //@ planar
    above = choose(planar, (real_n)0, above);
//@end
//@hook shadow_limit
    //@ planar_end
    // The ray is at its length where `end` is, to within half of `offset`, and that is at the plane to within the point's error along the normal: so
    // its way to the plane is off by that over the cosine between them. facing is off by less than 2 `offset`.
    const real_n facing = max_n(multiply_add((real_n)R(-2.0), offset, -dot_n(hit->geometric, span)), (real_n)0);
    const real_n slack = (hit->error + R(0.5) * offset) * (length * reciprocal_above(facing));
    rays.t_max = choose(planar, -length, length);
    hits.t = choose(planar, length + slack, length);
    hits.low = choose(planar, length - slack, length);
//@end
//@hook reach_start
    const Geometry seen = *geometry;
    const Rays copy = *rays;
    real_n refined[3] = {start[0], start[1], start[2]}, refined_error = error;
    refine_points(&seen, &copy, from_eye, hit, lit, refined, &refined_error);
    for (int a = 0; a < 3; a++) start[a] = refined[a];
    error = refined_error;
//@end
