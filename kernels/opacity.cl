// Provides: opacity_solid: the part of each hit that is seen; the rest is what lies straight behind.
// Needs: opaque.cl, hit.cl; bounce.cl, where rays go on.  Reads: nothing.

// 1 where nothing was hit: the background is whole.
HOT real_n opacity_solid(const Geometry *geometry, global const Material *materials, const Rays *rays, const Hit *hit) {
    lane_int slot[LANES], found[LANES];
    real where[3 * LANES], kept[LANES];
    store_lanes(hit->found, found);
    for (int k = 0; k < LANES; k++) slot[k] = found[k] && materials[hit->material[k]].opacity_seen ? hit->slot[k] : -1;
    for (int a = 0; a < 3; a++) store_lanes(hit->point[a], where + a * LANES);
    //@ texture_where
    const Geometry seen = *geometry;
    opaque_at(&seen, slot, where, kept);
    return choose(is_less(load_lanes(slot), NO_LANES), (real_n)1, load_lanes(kept));
}

//@hook arrived
        const real_n whole = weight, solid = opacity_solid(&geometry, materials, &rays, &hit);
        weight *= solid;
//@end
//@hook bounce_weights
            {
                // Straight on, from the far side, in the medium that the ray is in: a hole has no glass.
                const real_n straight = whole * (R(1.0) - solid);
                const mask_n goes_on = hit.found & is_greater(straight, (real_n)0);
                //@counting count_rays(counters, COUNT_PASSED, goes_on);
                if (any_lane(goes_on)) {
                    const real_n way = hits.t;
                    Bounce *passed = bounce_push(&geometry, &rays, &bounces, &hit, rays.direction, straight, goes_on, &current, BRANCH_PASSED);
                    //@ passed_pushed
                }
            }
//@end
