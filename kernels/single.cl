// Provides: single_trace: a packet's rays one by one through the wide tree of an object; single_pays: whether that is sooner.
// Needs: blocks.cl, kdtree.cl.  Reads: nothing.
//
// Rays that a surface sends on go apart: a packet of them visits whatever any of them visits, with few lanes at work in each place, and later
// bounces leave few lanes at all. All rays that share no origin go this way; those of a lens, where most packets stay together, if they do not.
#define SINGLE_DIRECTIONS R(0.25)  // difference of directions, summed over the axes, up to which a packet is sooner

// Half of the lanes or more, in one octant, about the same way: a packet.
HOT int single_pays(const Rays *rays, mask_n active) {
    lane_int live[LANES];
    store_lanes(active, live);
    int first = 0, count = 0;
    for (int k = LANES - 1; k >= 0; k--) {
        first = live[k] ? k : first;
        count -= (int)live[k];
    }
    if (2 * count < LANES) return 1;
    real_n apart = (real_n)0;
    for (int a = 0; a < 3; a++) apart += abs_n(rays->direction[a] - (real_n)lane_of(rays->direction[a], first));
    const mask_n octant = (mask_n)lane_of_mask(rays->octant, first);
    return any_lane(active & (is_greater(apart, (real_n)SINGLE_DIRECTIONS) | ~is_equal(rays->octant, octant)));
}

// One copy: as fast, and each other would have to be compiled.
static __attribute__((noinline)) void single_trace(const Geometry *geometry, global const Object *object, const Rays *rays, mask_n active,
                                                   const int any_hit, Hits *hits) {
    lane_int live[LANES];
    store_lanes(active, live);
    const int root = geometry->wide_roots[object - geometry->objects];
    for (int k = 0; k < LANES; k++)
        if (live[k]) blocks_trace(geometry, object, root, rays, k, any_hit, hits);
}

//@hook geometry_members
    global const int *wide_roots;  // of each object the node that its wide tree begins at
    int one_by_one, looked_at;     // whether rays that share no origin go one by one; whether only packets that single_pays says so of
//@end
//@hook begin
    geometry.wide = wide_nodes;
    geometry.blocks = wide_blocks;
    geometry.wide_roots = wide_roots;
    geometry.one_by_one = HAVE_SINGLE_RAYS;
    geometry.looked_at = 0;
    //@ single_begin
//@end
//@hook kdtree_before
HOT int single_pays(const Rays *rays, mask_n active);
static __attribute__((noinline)) void single_trace(const Geometry *geometry, global const Object *object, const Rays *rays, mask_n active,
                                                   const int any_hit, Hits *hits);
//@end
//@hook kdtree_rays
    if (shared != SHARED_ORIGIN && geometry->one_by_one && (!geometry->looked_at || single_pays(rays, active))) {
        // Copies go to the function: what it is given by pointer could not stay in registers here.
        const Geometry seen = *geometry;
        const Rays copy = *rays;
        Hits found = *hits;
        single_trace(&seen, object, &copy, active, any_hit, &found);
        *hits = found;
        return;
    }
//@end
//@hook block_possible
    // The triangle that a ray starts on.
    for (uint bits = found.possible; bits; bits &= bits - 1)
        if (block->slot[lowest_bit(bits)] == lane_of_mask(rays->skip, k)) found.possible &= ~(bits & -bits);
//@end
//@hook block_tested
    //@counting for (int i = 0; i < BLOCK; i++) hits->tests += block->slot[i] >= 0;
//@end
