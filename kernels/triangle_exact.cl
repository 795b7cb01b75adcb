// Provides: triangle_test of the rung `exact`: the visible triangle is the one that exact arithmetic on the given numbers gives.
// Needs: lanes.cl, rays.cl, geometry.cl, triangle.cl, exact.cl.  Reads: nothing.
//
// A filter: where the float32 edge functions and distances clear their bounds, their signs are right (triangle.cl), and the lane is
// decided as in the other rungs. The lanes left are decided in float64 with bounds, and those left of them in exact expansions
// (exact.cl). Hits carry t as an interval [low, t]; of equal t the lowest primitive id stays.

// The lanes in `unsure`, one by one, by the numbers as given: those that hit nearer than what they have get it.
static __attribute__((noinline)) void triangle_unsure(const Geometry *geometry, const Rays *rays, int slot, const int shared, mask_n unsure,
                                                      Hits *hits) {
    lane_int test[LANES], best[LANES], skip[LANES], found[LANES];
    real t[LANES];
    store_lanes(unsure, test);
    store_lanes(hits->slot, best);
    store_lanes(rays->skip, skip);
    int decided_double = 0, decided_exact = 0;
    for (int k = 0; k < LANES; k++) {
        t[k] = R(0.0);
        found[k] = 0;
        if (!test[k]) continue;
        double origin[3], direction[3], t_min, t_max;
        ray_given(geometry, rays, k, shared, origin, direction, &t_min, &t_max);
        Plane plane;
        int stage = 1;
        plane_edges_double(geometry, origin, direction, slot, &plane);
        int hit = exact_inside(geometry, origin, direction, slot, &plane, &stage);
        if (hit) {
            plane_distance_double(geometry, origin, direction, slot, &plane);
            hit = exact_after(geometry, origin, direction, slot, &plane, t_min, &stage) > 0;
            if (t_max < 0 && skip[k] >= 0) hit = hit && exact_nearer(geometry, origin, direction, slot, &plane, skip[k], &stage) < 0;
            else hit = hit && exact_after(geometry, origin, direction, slot, &plane, t_max, &stage) < 0;
        }
        //@ exact_accept
        if (hit && best[k] >= 0) {
            const int order = exact_nearer(geometry, origin, direction, slot, &plane, best[k], &stage);
            hit = order < 0 || (order == 0 && geometry->surfaces[slot].prim < geometry->surfaces[best[k]].prim);
        }
        if (hit) {
            // t to within 2^-24 + 2^-24, and 2^-24 for its rounding: less than the 4u = 2^-22 that its interval has.
            double at = plane.offset / plane.rate;
            if (fabs(plane.rate) <= 0x1p24 * plane.rate_error || fabs(plane.offset) <= 0x1p24 * plane.offset_error) {
                Expansion offset, rate;
                exact_distance(geometry, origin, direction, slot, &offset, &rate);
                at = expansion_value(&offset) / expansion_value(&rate);
            }
            t[k] = (real)(at * ray_length(rays, k));
            found[k] = -1;
        }
        decided_double += stage == 1;
        decided_exact += stage == 2;
    }
    if (decided_double) atomic_add(geometry->decided, decided_double);
    if (decided_exact) atomic_add(geometry->decided + 1, decided_exact);
    const mask_n hit = load_lanes(found);
    const real_n at = load_lanes(t), error = (R(4.0) * UNIT_ROUNDOFF) * abs_n(at);
    hits->t = choose(hit, at + error, hits->t);
    hits->low = choose(hit, at - error, hits->low);
    hits->slot = choose(hit, (mask_n)slot, hits->slot);
}

// Takes the hits that are sure, and tells whether there are lanes that are not: `unsure`, set then alone.
HOT int triangle_sure(const Geometry *geometry, const Rays *rays, real_n reach, int slot, const int shared, const int picked,
                       mask_n live, Hits *hits, mask_n *unsure) {
    const EdgeFunctions f = edge_functions(geometry, rays, reach, slot, shared);
    // How far inside: the least of three edge functions of one sign, whichever that is; below 0 outside.
    const real_n inside = max_n(f.lowest, -f.highest);
    // A comparison of `live`, as masks made of comparisons alone stay in mask registers.
    mask_n possible = ~is_equal(live, NO_LANES) & is_at_least(inside, -f.bound);
    if (!picked && !any_lane(possible)) return 0;
    const PlaneHit plane = plane_hit(geometry, rays, reach, slot, shared);
    // Of lanes that graze, both ends are NaN, which no comparison is true of.
    const real_n t = plane.t, error = choose(plane.grazing, (real_n)NAN, plane.error), near = t - error, far = t + error;
    possible &= ~(is_less(far, rays->t_min) | is_greater(near, hits->t) | is_equal(rays->skip, (mask_n)slot));
    real_n t_min = rays->t_min;
    //@ exact_start
    mask_n hit = possible & is_greater(inside, f.bound) & is_greater(near, t_min) & is_less(far, hits->low);
    //@ accept_sure
    hits->t = choose(hit, far, hits->t);
    hits->low = choose(hit, near, hits->low);
    hits->slot = choose(hit, (mask_n)slot, hits->slot);
    *unsure = possible & ~hit;
    return any_lane(*unsure);
}

HOT void triangle_test(const Geometry *geometry, const Rays *rays, real_n reach, int slot, const int shared, const int picked, mask_n live,
                        Hits *hits) {
    mask_n unsure;
    if (!triangle_sure(geometry, rays, reach, slot, shared, picked, live, hits, &unsure)) return;
    // The triangle that the ray already has, met again in another leaf, is nothing new.
    unsure &= ~is_equal(hits->slot, (mask_n)slot);
    if (any_lane(unsure)) {
        // Copies go to the function: what it is given by pointer could not stay in registers here.
        const Geometry seen = *geometry;
        const Rays copy = *rays;
        Hits found = *hits;
        triangle_unsure(&seen, &copy, slot, shared, unsure, &found);
        *hits = found;
    }
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
//@hook hits_members
    real_n low;                          // t is at least this
//@end
//@hook hits_begin
        hits.low = hits.t;
        //@ exact_end
//@end
//@hook placed_prepared
        inner.t_max = abs_n(inner.t_max);
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
    const real begin = lane_of(rays->t_min, k), before = lane_of(hits->low, k);
    const real after = begin * (begin < 0 ? R(1.0) - R(8.0) * UNIT_ROUNDOFF : R(1.0) + R(8.0) * UNIT_ROUNDOFF);
//@end
//@hook block_accept
    lane_of(hits->t, k) = t[place] + error[place];
    lane_of(hits->low, k) = t[place] - error[place];
//@end
//@hook group_decide
// What float32 leaves open of a block, a bit a triangle, packet by packet. It is decided after all of the block's tests, as it takes the numbers as
// given, which are not in the caches: they are on their way meanwhile.
typedef struct {
    int some;
    uint bits[GROUP];
} GroupOpen;

// Whether any rays need less of their way than before.
static __attribute__((noinline)) int group_decide(const Geometry *geometry, Group *group, global const DirectionBoxes *boxes, const GroupOpen *open,
                                                  const int shared, const int any_hit) {
    int changed = 0;
    for (int p = 0; p < group->count; p++) {
        if (!open->bits[p]) continue;
        Hits hits = group->hits[p];
        const Rays *rays = group->rays + p;
        const real_n reach = group_reach(geometry, rays, boxes, shared);
        for (uint left = open->bits[p]; left; left &= left - 1)
            triangle_test(geometry, rays, reach, boxes->item[first_bit(left)], shared, 0, group->active[p], &hits);
        group->hits[p] = hits;
        if (any_hit) group->active[p] &= is_less(hits.slot, NO_LANES);
        changed |= !any_hit || !any_lane(group->active[p]);
    }
    return changed;
}
//@end
//@hook group_begin
    GroupOpen open = {0};
//@end
//@hook group_tests
        for (; met; met &= met - 1) {
            const int slot = boxes->item[first_bit(met)];
            mask_n unsure;
            if (!triangle_sure(geometry, rays, reach, slot, shared, 1, active, &hits, &unsure)) continue;
            open.bits[p] |= met & -met;
            open.some = 1;
            global const double *given = geometry->vertices + 9 * (size_t)slot;
            fetch_ahead(given);
            fetch_ahead(given + 8);
        }
//@end
//@hook group_tested
    if (open.some) changed |= group_decide(geometry, group, boxes, &open, shared, any_hit);
//@end
