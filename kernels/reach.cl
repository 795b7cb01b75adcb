// Provides: reach_rays; reach_clear: which hit points see all the way in a direction; reach_point: which see a point.
// Needs: scene.cl, hit.cl, structs.  Reads: nothing.

// Rays from the points, as reflected ones are: they start off the surface by the point's error and pass by the triangle that they start on;
// the first thing they meet settles it. With `ends`, they end at `end`, short of it by `short_by`, the error there along the way; else nowhere.
// Gives the lanes that are traced: those of `lit` that are not at the end already.
HOT mask_n reach_rays(const Geometry *geometry, const Rays *rays, const Hit *hit, const real_n *to_light, const int ends, const real_n *end,
                      real_n short_by, const int from_eye, real extent, mask_n lit, Rays *from_hits, Hits *none) {
    Rays towards;
    real_n start[3] = {hit->point[0], hit->point[1], hit->point[2]}, error = hit->error;
    mask_n own = load_lanes(hit->slot);
    //@ reach_start
    #pragma unroll
    for (int a = 0; a < 3; a++) {
        towards.origin[a] = choose(lit, multiply_add(hit->geometric[a], error, start[a]), (real_n)0);
        towards.direction[a] = to_light[a];
    }
    real_n t_max = (real_n)INFINITY;
    if (ends) {
        // From where the ray does start: its end is `end`, not a point beside it.
        #pragma unroll
        for (int a = 0; a < 3; a++) towards.direction[a] = choose(lit, end[a] - towards.origin[a], (real_n)1);
        const real_n length = sqrt(dot_n(towards.direction, towards.direction));
        #pragma unroll
        for (int a = 0; a < 3; a++) towards.direction[a] /= length;
        t_max = length * (R(1.0) - R(16.0) * UNIT_ROUNDOFF) - short_by;
        lit &= is_greater(t_max, (real_n)0);
    }
    towards.t_min = (real_n)0;
    towards.t_max = t_max;
    towards.active = lit;
    towards.skip = own;
    rays_prepare(&towards, extent);
    Hits hits;
    hits.t = t_max;
    hits.slot = (mask_n)-1;
    //@ hits_begin
    *from_hits = towards;
    *none = hits;
    return lit;
}

HOT mask_n reach_trace(const Geometry *geometry, const Rays *rays, const Hit *hit, const real_n *to_light, const int ends, const real_n *end,
                       real_n short_by, const int from_eye, real extent, const int shared, mask_n lit) {
    Rays towards;
    Hits hits;
    lit = reach_rays(geometry, rays, hit, to_light, ends, end, short_by, from_eye, extent, lit, &towards, &hits);
    //@ reach_limit
    scene_trace(geometry, &towards, shared, 1, &hits);
    //@counting count_rays(geometry->counters, COUNT_SHADOW, towards.active);
    //@ reach_blocked
    return lit & is_less(hits.slot, NO_LANES);
}

HOT mask_n reach_clear(const Geometry *geometry, const Rays *rays, const Hit *hit, const real_n *to_light, const int from_eye, real extent,
                       mask_n lit) {
    return reach_trace(geometry, rays, hit, to_light, 0, to_light, (real_n)0, from_eye, extent, SHARED_NOTHING, lit);
}

HOT mask_n reach_point(const Geometry *geometry, const Rays *rays, const Hit *hit, const real_n *to_light, const real_n *end, real_n short_by,
                       const int from_eye, real extent, mask_n lit) {
    return reach_trace(geometry, rays, hit, to_light, 1, end, short_by, from_eye, extent, SHARED_NOTHING, lit);
}

//@hook sphere_meets
        // A ray from a hit starts on its own sphere, though any hit will do; one from a light, which ends there, starts off the light.
        const mask_n starts = own & is_equal(rays->t_min, (real_n)0);
        meets |= starts & rays->active;
//@end
//@hook sphere_root
        if (any_hit) t = choose(starts, R(2.0) * b, t);
//@end
