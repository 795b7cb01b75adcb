// Provides: motion_start, motion_enter: rays towards an object that moves, as if it stood still: their origins go the other way.
// Needs: geometry.cl, and shutter.cl where a packet begins; rays.cl, structs.  Reads: nothing.
//
// A packet's lanes have a time each, for the whole of their paths. A displaced origin is computed in float64 and rounded twice to `real`, by u |o'| and
// u (|o'| + |motion * time|): what one ray meets of an object is as consistent as if it stood still, and a hit is off by the same lengths.

// Without another transform: relative to the object's own origin.
HOT void motion_start(global const Placement *from, const Rays *rays, Rays *inner) {
    for (int a = 0; a < 3; a++) {
        real o[LANES];
        store_lanes(rays->origin[a], o);
        for (int k = 0; k < LANES; k++) o[k] = (real)(o[k] + from->object_from_world[4 * a + 3]);
        inner->origin[a] = load_lanes(o);
    }
}

HOT void motion_enter(const Geometry *geometry, global const Placement *from, Rays *inner) {
    for (int a = 0; a < 3; a++) {
        real o[LANES];
        store_lanes(inner->origin[a], o);
        for (int k = 0; k < LANES; k++) o[k] = (real)(o[k] - from->motion[a] * geometry->time[k]);
        inner->origin[a] = load_lanes(o);
    }
}

//@hook geometry_members
    real time[LANES];                    // of the sample
//@end
//@hook begin
    const real_n sample_time = shutter_times(frame, column, row, sample, seed);
    store_lanes(sample_time, geometry.time);
//@end
//@hook placed_enter_default
        motion_start(from, rays, &inner);
//@end
//@hook placed_moved
        motion_enter(geometry, from, &inner);
//@end
//@hook placed_point_default
        for (int a = 0; a < 3; a++) at[a] += from->object_from_world[4 * a + 3];
//@end
//@hook placed_point_moved
        for (int a = 0; a < 3; a++) at[a] -= from->motion[a] * geometry->time[k];
//@end
//@hook placed_error
        for (int a = 0; a < 3; a++) inner += fabs(from->motion[a] * geometry->time[k]);
//@end
