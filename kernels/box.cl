// Provides: RELATIVE_WIDENING, rays_reach, box_clip, PlaneLines, plane_lines.
// Needs: lanes.cl, rays.cl, structs.  Reads: nothing.
//
// The error of a computed distance t = (s - o) * (1/d) to a plane s, with u the unit roundoff:
//   three roundings (difference, reciprocal, product): at most 3u(1+u)^2 |t| < 4u |t|;
//   the origin o and what lies in the cell are themselves rounded to `real`, by at most u |o| and u extent: a shift of the
//   plane by pad = 2u (|o| + extent), hence of the distance by pad |1/d|.
// The interval t +- (8u |t| + pad |1/d|) therefore holds the true distance, with a factor of two to spare for its own roundings.
#define RELATIVE_WIDENING (R(8.0) * UNIT_ROUNDOFF)

// Both ends of that interval as lines over s, for rays whose t_min is not negative: s * rate + start, rate = (1 -+ 8u) / d,
// start = -o rate -+ 2 pad |1/d|. A rate is off by 2u of itself, the same 2u in both places, hence of t; o rate, s rate where it is not
// fused, and the sum round by u (|o| + extent) |1/d| + u |t| more, which half a pad and the 8u cover. Behind the origin, where t < 0,
// the ends lie on the wrong sides of 8u t, but below 0 as t does, which is all that is asked where t_near >= 0.
typedef struct {
    real_n low_rate[3], low_start[3], high_rate[3], high_start[3];
} PlaneLines;

HOT void plane_lines(const Rays *rays, const real_n *slab, PlaneLines *lines) {
    for (int a = 0; a < 3; a++) {
        lines->low_rate[a] = rays->inverse[a] * (R(1.0) - RELATIVE_WIDENING);
        lines->high_rate[a] = rays->inverse[a] * (R(1.0) + RELATIVE_WIDENING);
        lines->low_start[a] = -rays->origin[a] * lines->low_rate[a] - R(2.0) * slab[a];
        lines->high_start[a] = -rays->origin[a] * lines->high_rate[a] + R(2.0) * slab[a];
    }
}

// A bound on the distance from each ray's origin to any point of the object's triangles plus their longest edge.
HOT real_n rays_reach(const Rays *rays, global const Object *object) {
    return abs_n(rays->origin[0]) + abs_n(rays->origin[1]) + abs_n(rays->origin[2]) + (real_n)object->extent;
}

// Lanes that may meet the object's box, with the interval of t inside it; `slab` is pad |1/d| by axis, for kdtree_trace.
HOT mask_n box_clip(global const Object *object, const Rays *rays, real_n t_max, real_n *slab, real_n *t_enter, real_n *t_leave) {
    const real_n pad = (R(2.0) * UNIT_ROUNDOFF) * rays_reach(rays, object);
    // The new bound comes first: where it is NaN (beyond the range of `real`), min_n and max_n keep the old one.
    real_n enter = rays->t_min, leave = t_max;
    for (int a = 0; a < 3; a++) {
        slab[a] = pad * abs_n(rays->inverse[a]);
        const real_n t0 = (object->lo[a] - rays->origin[a]) * rays->inverse[a];
        const real_n t1 = (object->hi[a] - rays->origin[a]) * rays->inverse[a];
        const real_n low = min_n(t0, t1), high = max_n(t0, t1);
        enter = max_n(low - multiply_add(abs_n(low), (real_n)RELATIVE_WIDENING, slab[a]), enter);
        leave = min_n(high + multiply_add(abs_n(high), (real_n)RELATIVE_WIDENING, slab[a]), leave);
    }
    *t_enter = enter;
    *t_leave = leave;
    return rays->active & ~is_greater(enter, leave);
}
