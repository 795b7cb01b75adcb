// Provides: shadows through objects that are seen through a transform: their hits in order, and where these are on a picture.
// Needs: after.cl, placed.cl, opacity_shadow.cl.  Reads: nothing.
//
// An object's tree gives distances in its own space, by `after_scale` longer than those of the world, in which hits of different placements are
// compared; the quotient is the same each time, so none counts twice. Of equal ones the lower placement comes first.

//@hook rays_members
    real_n after_scale;
    mask_n after_place;  // the placement of the ray's last hit, or -1
    int place_here;      // the placement that the ray is in the space of, or -1
//@end
//@hook rays_begin
    rays->after_scale = (real_n)1;
    rays->after_place = (mask_n)-1;
    rays->place_here = -1;
//@end
//@hook placed_prepared
        inner.after = rays->after;
        inner.after_t = rays->after_t;
        inner.after_scale = length;
        inner.after_place = rays->after_place;
        inner.place_here = number;
//@end
//@hook after_order
        lane_int there[LANES];
        store_lanes(rays->after_place, there);
        for (int k = 0; k < LANES; k++)
            if (last[k] >= 0 && there[k] != rays->place_here) later[k] = rays->place_here > there[k] ? -1 : 0;
        along = t / rays->after_scale;
//@end
//@hook opacity_after
        rays.after_place = choose(blocked, hits.place, rays.after_place);
//@end
//@hook opacity_where
        Hit met;
        real_n inner[3];
        for (int a = 0; a < 3; a++) met.point[a] = load_lanes(where + a * LANES);
        store_lanes(choose(blocked & is_less(hits.slot, (mask_n)geometry->slot_count), hits.place, (mask_n)-1), met.place);
        placed_local(geometry, &rays, &met, inner);
        for (int a = 0; a < 3; a++) store_lanes(inner[a], where + a * LANES);
//@end
