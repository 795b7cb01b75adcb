// Provides: opacity_through: how much light gets through the surfaces that stand in its way.
// Needs: opaque.cl, after.cl, scene.cl.  Reads: nothing.
//
// The rays that anything blocks are traced again, from one triangle to the next in the order of their t, so that each counts once, and what
// each lets through is multiplied. Two triangles that share an edge are both met by a ray through it. Each pass leaves a triangle behind; a ray
// with more than OPACITY_MOST in its way brings nothing.
#define OPACITY_MOST 1024

// `open` is what the rays' hits are before anything is met.
static __attribute__((noinline)) void opacity_through(const Geometry *geometry, const Rays *given, const int shared, const Hits *open,
                                                      mask_n blocked, real_n *through) {
    Rays rays = *given;
    real_n left = (real_n)1;
    //@ opacity_round
    //@ opacity_flat
    blocked &= is_greater(left, (real_n)0);
    for (int pass = 0; pass <= OPACITY_MOST && any_lane(blocked); pass++) {
        Hits hits = *open;
        rays.active = blocked;
        scene_trace(geometry, &rays, shared, 0, &hits);
        blocked &= is_at_least(hits.slot, NO_LANES);
        lane_int slot[LANES];
        real where[3 * LANES], kept[LANES];
        store_lanes(choose(blocked, hits.slot, (mask_n)-1), slot);
        real_n t = hits.t;
        //@ opacity_distance
        for (int a = 0; a < 3; a++) store_lanes(choose(blocked, ray_point(&rays, t, a), (real_n)0), where + a * LANES);
        //@ opacity_where
        opaque_at(geometry, slot, where, kept);
        left *= pass < OPACITY_MOST ? R(1.0) - load_lanes(kept) : choose(blocked, (real_n)0, (real_n)1);
        blocked &= is_greater(left, (real_n)0);
        //@ opacity_after
        rays.after = choose(blocked, hits.slot, rays.after);
        rays.after_t = choose(blocked, hits.t, rays.after_t);
    }
    *through = left;
}

//@hook geometry_members
    real_n *let_through;  // the part of its light that the last light's shadow rays bring to the hits
//@end
//@hook begin
    real_n let_through = (real_n)1;
    geometry.let_through = &let_through;
//@end
//@hook shadow_open
    const Hits open = hits;
//@end
//@hook shadow_blocked
    *geometry->let_through = (real_n)1;
    const mask_n blocked = lit & is_at_least(hits.slot, NO_LANES);
    if (any_lane(blocked)) {
        const Rays copy = rays;
        opacity_through(&seen, &copy, SHADOW_SHARED_ORIGIN, &open, blocked, geometry->let_through);
        hits.slot = choose(blocked & is_greater(*geometry->let_through, (real_n)0), (mask_n)-1, hits.slot);
    }
//@end
//@hook light_lit
        amount *= *geometry->let_through;
//@end
//@hook reach_limit
    const Hits open = hits;
//@end
//@hook reach_blocked
    *geometry->let_through = (real_n)1;
    const mask_n blocked = lit & is_at_least(hits.slot, NO_LANES);
    if (any_lane(blocked)) {
        const Geometry all = *geometry;
        const Rays copy = towards;
        opacity_through(&all, &copy, shared, &open, blocked, geometry->let_through);
        hits.slot = choose(blocked & is_greater(*geometry->let_through, (real_n)0), (mask_n)-1, hits.slot);
    }
//@end
//@hook scatter_lit
    for (int a = 0; a < 3; a++) power[a] *= *geometry->let_through;
//@end
