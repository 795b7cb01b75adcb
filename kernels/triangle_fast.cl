// Provides: triangle_test of the rung `fast`: signs of rounded edge functions, no promise at edges.
// Needs: lanes.cl, rays.cl, geometry.cl, triangle.cl.  Reads: nothing.
HOT void triangle_test(const Geometry *geometry, const Rays *rays, real_n reach, int slot, const int shared, const int picked, mask_n live,
                        Hits *hits) {
    const EdgeFunctions f = edge_functions(geometry, rays, reach, slot, shared);
    // A comparison, as masks made of comparisons alone stay in mask registers.
    mask_n hit = is_less(live, NO_LANES) & (is_at_least(f.lowest, (real_n)0) | is_at_most(f.highest, (real_n)0));
    if (!picked && !any_lane(hit)) return;
    const PlaneHit plane = plane_hit(geometry, rays, reach, slot, shared);
    const real_n t = plane.t;
    hit &= ~plane.grazing & is_greater(t, rays->t_min) & ~is_equal(rays->skip, (mask_n)slot);
    mask_n closer = is_less(t, hits->t);
    //@ tie
    hit &= closer;
    //@ accept
    hits->t = choose(hit, t, hits->t);
    hits->slot = choose(hit, (mask_n)slot, hits->slot);
}
