// Provides: hit_surface: point, normals and material of the nearest hits.
// Needs: hit.cl, rays.cl, geometry.cl, structs.  Reads: nothing.

// The error of a hit point along its normal n, with t = T / (n.d) of triangle.cl:
//   n.d is off by (1 + 3)u |n||d|, T by u (shared origin) and the quotient by 2u: t |n.d| / |n| is off by at most 7u t;
//   other rays have T = n.(v0 - o) off by u |v0| + 5u |v0 - o| more; the shared origin itself is rounded by u |o|;
//   o + t d is rounded by u (|o| + t).
// Together below 8u (scale + t), with scale as rays.cl has it.
HOT void hit_surface(const Geometry *geometry, global const Frame *frame, global const Surface *surfaces, const Rays *rays,
                        const Hits *hits, Hit *hit) {
    hit->found = is_at_least(hits->slot, NO_LANES);
    store_lanes(choose(hit->found, hits->slot, NO_LANES), hit->slot);
    real_n t = choose(hit->found, hits->t, (real_n)0);
    //@ hit_distance
    #pragma unroll
    for (int a = 0; a < 3; a++) hit->point[a] = ray_point(rays, t, a);
    hit->error = (R(8.0) * UNIT_ROUNDOFF) * (rays->scale + t);
    lane_int record[LANES];
    #pragma unroll
    for (int k = 0; k < LANES; k++) record[k] = hit->slot[k] < frame->triangle_slots ? hit->slot[k] : 0;
    const int one_record = all_same(record);
    if (frame->only_material >= 0) store_lanes((mask_n)frame->only_material, hit->material);
    else if (one_record) store_lanes((mask_n)surfaces[record[0]].material, hit->material);
    else
        #pragma unroll
        for (int k = 0; k < LANES; k++) hit->material[k] = surfaces[record[k]].material;
    // Unrolled, so that what no effect asks for is not loaded.
    #pragma unroll
    for (int a = 0; a < 3; a++) {
        gather_same(one_record, hit->geometric[a], surfaces[record[k]].geometric[a]);
        gather_same(one_record, hit->normal[a], surfaces[record[k]].normal[a]);
    }
    //@ hit_surface
    hit->one_material = all_same(hit->material);
    face_towards(hit->geometric, rays->direction, 1);
    face_towards(hit->normal, hit->geometric, 0);
    //@ hit_faced
}
