// Provides: hit_surface: point, normals and material of the nearest hits.
// Needs: hit.cl, rays.cl, geometry.cl, structs.  Reads: nothing.

// The error of a hit point along its normal n: t = T / (n.d) has relative error below 8u |n||d| / |n.d|, that is 8u t along n;
// the point adds u (|o| + t) a coordinate, the rounded origin and corner u (|o| + extent) each. 16u of their sum covers it.
inline void hit_surface(const Geometry *geometry, global const Frame *frame, global const Surface *surfaces, const Rays *rays,
                        const Hits *hits, Hit *hit) {
    hit->found = is_at_least(hits->slot, NO_LANES);
    store_lanes(choose(hit->found, hits->slot, NO_LANES), hit->slot);
    const real_n t = choose(hit->found, hits->t, (real_n)0);
    for (int a = 0; a < 3; a++) hit->point[a] = ray_point(rays, t, a);
    hit->error = (R(16.0) * UNIT_ROUNDOFF) * (abs_n(rays->origin[0]) + abs_n(rays->origin[1]) + abs_n(rays->origin[2]) + t + frame->extent);
    lane_int record[LANES];
    for (int k = 0; k < LANES; k++) record[k] = hit->slot[k] < frame->triangle_slots ? hit->slot[k] : 0;
    for (int k = 0; k < LANES; k++) hit->material[k] = surfaces[record[k]].material;
    for (int a = 0; a < 3; a++) {
        gather(hit->geometric[a], surfaces[record[k]].geometric[a]);
        gather(hit->normal[a], surfaces[record[k]].normal[a]);
    }
    //@ hit_surface
    face_towards(hit->geometric, rays->direction, 1);
    face_towards(hit->normal, hit->geometric, 0);
}
