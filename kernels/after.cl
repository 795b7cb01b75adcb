// Provides: rays->after: hits of a ray one after the other, each once, however close they are.
// Needs: rays.cl, one triangle_*.cl.  Reads: nothing.

//@hook rays_members
    mask_n after;  // the slot of each ray's last hit: only hits after it, by t and primitive id, count; or -1
    real_n after_t;
//@end
//@hook rays_begin
    rays->after = (mask_n)-1;
    rays->after_t = (real_n)0;
//@end
//@hook tie
    // Of equal t the lowest id comes first, so that counting, which goes on from it, leaves none out.
    const mask_n tied = hit & is_equal(t, hits->t) & is_at_least(hits->slot, NO_LANES);
    if (any_lane(tied)) {
        lane_int best[LANES], lower[LANES];
        store_lanes(hits->slot, best);
        for (int k = 0; k < LANES; k++) lower[k] = best[k] >= 0 && geometry->surfaces[slot].prim < geometry->surfaces[best[k]].prim ? -1 : 0;
        closer |= tied & load_lanes(lower);
    }
//@end
//@hook accept
    if (any_lane(hit & is_at_least(rays->after, NO_LANES))) {
        lane_int last[LANES], later[LANES];
        real_n along = t;
        store_lanes(rays->after, last);
        for (int k = 0; k < LANES; k++)
            later[k] = last[k] < 0 || geometry->surfaces[slot].prim > geometry->surfaces[last[k]].prim ? -1 : 0;
        //@ after_order
        hit &= is_less(rays->after, NO_LANES) | is_greater(along, rays->after_t) | (is_equal(along, rays->after_t) & load_lanes(later));
    }
//@end
//@hook accept_sure
    hit &= is_less(rays->after, NO_LANES) | is_greater(t - error, rays->after_t);
//@end
//@hook exact_accept
        lane_int last[LANES];
        store_lanes(rays->after, last);
        if (hit && last[k] >= 0) {
            const int order = exact_nearer(geometry, origin, direction, slot, &plane, last[k], &stage);
            hit = order > 0 || (order == 0 && geometry->surfaces[slot].prim > geometry->surfaces[last[k]].prim);
        }
//@end
//@hook block_alone
    alone = alone && lane_of_mask(rays->after, k) < 0;
//@end
