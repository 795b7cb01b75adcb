// Provides: normalmap_to_world: normal maps on objects that are seen through a transform.
// Needs: placed.cl.  Reads: nothing.

// A vector of the object's space in the world: by the inverse of the transform's rows r0, r1, r2, whose columns are cross products of them.
HOT void normalmap_to_world(global const Placement *from, double *v) {
    double row[3][3], cross[3], turned[3] = {0, 0, 0};
    for (int i = 0; i < 9; i++) row[i / 3][i % 3] = from->object_from_world[4 * (i / 3) + i % 3];
    for (int i = 0; i < 3; i++) {
        cross_double(row[(i + 1) % 3], row[(i + 2) % 3], cross);
        const double det = dot_double(row[i], cross);
        for (int a = 0; a < 3; a++) turned[a] += cross[a] / det * v[i];
    }
    for (int a = 0; a < 3; a++) v[a] = turned[a];
}

//@hook geometry_members
    const lane_int *places;  // of the hits
//@end
//@hook normalmap_where
    seen.places = hit->place;
//@end
//@hook normalmap_moved
            if (geometry->places[k] >= 0) {
                normalmap_to_world(geometry->placements + geometry->places[k], x);
                normalmap_to_world(geometry->placements + geometry->places[k], y);
            }
//@end
