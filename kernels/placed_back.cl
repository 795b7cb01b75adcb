// Provides: placed_back: the normals of hits on placements in the world, and how far off the points may lie.
// Needs: placed.cl, hit.cl.  Reads: nothing.

// `t` and `scale` are those of the rays in the world; the bound is that of placed.cl.
HOT void placed_back(const Geometry *geometry, real_n t, real_n scale, Hit *hit) {
    real geometric[3][LANES], normal[3][LANES], error[LANES], way[LANES], size[LANES];
    for (int a = 0; a < 3; a++) {
        store_lanes(hit->geometric[a], geometric[a]);
        store_lanes(hit->normal[a], normal[a]);
    }
    store_lanes(hit->error, error);
    store_lanes(t, way);
    store_lanes(scale, size);
    for (int k = 0; k < LANES; k++) {
        if (hit->place[k] < 0) continue;
        global const Placement *from = geometry->placements + hit->place[k];
        double stretch = 1, longest = 1;  // of the normal, and of any vector, on the way to the world and to the object
        //@ placed_normal
        double inner = 2 * geometry->objects[from->object].extent + 3 * longest * way[k];
        //@ placed_error
        error[k] = (real)(16 * UNIT_ROUNDOFF * (inner / stretch + size[k] + way[k]));
    }
    for (int a = 0; a < 3; a++) {
        hit->geometric[a] = load_lanes(geometric[a]);
        hit->normal[a] = load_lanes(normal[a]);
    }
    hit->error = load_lanes(error);
}

//@hook hit_surface
    if (any_lane(placed)) placed_back(geometry, t, rays->scale, hit);
//@end
