// Provides: triangle_test of the rung `exact`: the visible triangle is the one that exact arithmetic on the given numbers gives.
// Needs: lanes.cl, rays.cl, geometry.cl, triangle.cl, exact.cl.  Reads: nothing.
//
// A filter: where the float32 edge functions and distances clear their bounds, their signs are right (triangle.cl), and the lane is
// decided as in the other rungs. The lanes left are decided in float64 with bounds, and those left of them in exact expansions
// (exact.cl). Hits carry t as an interval [low, t]; of equal t the lowest primitive id stays.

// The lanes in `unsure`, one by one, by the numbers as given: those that hit nearer than what they have; their t.
static __attribute__((noinline)) mask_n triangle_unsure(const Geometry *geometry, const Rays *rays, int slot, const int shared, mask_n unsure,
                                                 const Hits *hits, real_n *distance) {
    lane_int test[LANES], best[LANES], limit[LANES];
    real t[LANES];
    store_lanes(unsure, test);
    store_lanes(hits->slot, best);
    store_lanes(rays->limit, limit);
    store_lanes(*distance, t);
    int decided_double = 0, decided_exact = 0;
    for (int k = 0; k < LANES; k++) {
        if (!test[k]) continue;
        double origin[3], direction[3], t_min, t_max;
        ray_given(geometry, rays, k, shared, origin, direction, &t_min, &t_max);
        Plane plane;
        int stage = 1;
        plane_double(geometry, origin, direction, slot, &plane);
        int hit = exact_inside(geometry, origin, direction, slot, &plane, &stage);
        hit = hit && exact_after(geometry, origin, direction, slot, &plane, t_min, &stage) > 0;
        if (limit[k] >= 0) hit = hit && exact_nearer(geometry, origin, direction, slot, &plane, limit[k], &stage) < 0;
        else hit = hit && exact_after(geometry, origin, direction, slot, &plane, t_max, &stage) < 0;
        //@ exact_accept
        if (hit && best[k] >= 0) {
            const int order = exact_nearer(geometry, origin, direction, slot, &plane, best[k], &stage);
            hit = order < 0 || (order == 0 && geometry->surfaces[slot].prim < geometry->surfaces[best[k]].prim);
        }
        test[k] = hit ? -1 : 0;
        if (hit) {
            // t to within 2^-24 + 2^-24, and 2^-24 for its rounding: less than the 4u = 2^-22 that its interval has.
            double at = plane.offset / plane.rate;
            if (fabs(plane.rate) <= 0x1p24 * plane.rate_error || fabs(plane.offset) <= 0x1p24 * plane.offset_error) {
                Expansion offset, rate;
                exact_distance(geometry, origin, direction, slot, &offset, &rate);
                at = expansion_value(&offset) / expansion_value(&rate);
            }
            t[k] = (real)(at * ray_length(rays, k));
        }
        decided_double += stage == 1;
        decided_exact += stage == 2;
    }
    if (decided_double) atomic_add(geometry->decided, decided_double);
    if (decided_exact) atomic_add(geometry->decided + 1, decided_exact);
    *distance = load_lanes(t);
    return load_lanes(test);
}

HOT void triangle_test(const Geometry *geometry, const Rays *rays, real_n reach, int slot, const int shared, const int picked, mask_n live,
                        Hits *hits) {
    const EdgeFunctions f = edge_functions(geometry, rays, reach, slot, shared);
    mask_n possible = live & (is_at_least(f.lowest, -f.bound) | is_at_most(f.highest, f.bound));
    if (!picked && !any_lane(possible)) return;
    const PlaneHit plane = plane_hit(geometry, rays, reach, slot, shared);
    real_n t = plane.t, error = plane.error;
    const mask_n outside = is_less(t + error, rays->t_min) | is_greater(t - error, hits->t);
    // The triangle that the ray already has, met again in another leaf, is nothing new.
    possible &= (plane.grazing | ~outside) & ~is_equal(rays->skip, (mask_n)slot) & ~is_equal(hits->slot, (mask_n)slot);
    mask_n hit = possible & ~plane.grazing & (is_greater(f.lowest, f.bound) | is_less(f.highest, -f.bound));
    hit &= is_greater(t - error, rays->t_min_high) & is_less(t + error, hits->low);
    //@ accept_sure
    const mask_n unsure = possible & ~hit;
    if (any_lane(unsure)) {
        // Copies go to the function: what it is given by pointer could not stay in registers here.
        const Geometry seen = *geometry;
        const Rays copy = *rays;
        const Hits before = *hits;
        real_n distance = t;
        const mask_n found = triangle_unsure(&seen, &copy, slot, shared, unsure, &before, &distance);
        t = distance;
        error = choose(found, (R(4.0) * UNIT_ROUNDOFF) * abs_n(t), error);
        hit |= found;
    }
    hits->t = choose(hit, t + error, hits->t);
    hits->low = choose(hit, t - error, hits->low);
    hits->slot = choose(hit, (mask_n)slot, hits->slot);
}

//@hook parameters
                   , volatile global int *decided
//@end
//@hook arguments
                  , decided
//@end
//@hook geometry_members
    volatile global int *decided;        // lanes decided in float64, in expansions
//@end
//@hook begin
    geometry.decided = decided;
//@end
//@hook rays_members
    real_n t_min_high;                   // t_min, less what rounding it may have lowered it by
    mask_n limit;                        // the slot of a triangle whose plane ends the ray, instead of t_max; or -1
//@end
//@hook rays_begin
    rays->limit = (mask_n)-1;
    rays->t_min_high = multiply_add(abs_n(rays->t_min), (real_n)(R(8.0) * UNIT_ROUNDOFF), rays->t_min);
//@end
//@hook hits_members
    real_n low;                          // t is at least this
//@end
//@hook hits_begin
        hits.low = hits.t * choose(is_less(hits.t, (real_n)0), R(1.0) + R(8.0) * UNIT_ROUNDOFF, R(1.0) - R(8.0) * UNIT_ROUNDOFF);
//@end
//@hook tree_met
                hits->low = min_n(hits->low, hits->t);
//@end
//@hook placed_before
    // The interval of t in the other space, wider by its roundings.
    found.t = multiply_add(abs_n(found.t), (real_n)(R(8.0) * UNIT_ROUNDOFF), found.t);
    found.low = (hits->low * length) * (R(1.0) - R(8.0) * UNIT_ROUNDOFF);
//@end
//@hook placed_after
    found.t = choose(hit, multiply_add(abs_n(found.t), (real_n)(R(8.0) * UNIT_ROUNDOFF), found.t), found.t);
    found.low = choose(hit, (found.low / length) * (R(1.0) - R(8.0) * UNIT_ROUNDOFF), hits->low);
//@end
//@hook tree_ordered
    ordered = 1;  // ties are settled triangle by triangle
//@end
//@hook block_limits
    const real after = lane_of(rays->t_min_high, k), before = lane_of(hits->low, k);
//@end
//@hook block_accept
    lane_of(hits->t, k) = t[place] + error[place];
    lane_of(hits->low, k) = t[place] - error[place];
//@end
