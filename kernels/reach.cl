// Provides: reach_clear: which hit points see as far as to `t_max` in a direction.
// Needs: scene.cl, hit.cl, structs.  Reads: nothing.

// Rays from the points, as reflected ones are: they start off the surface by the point's error and pass by the triangle that they start on;
// the first thing they meet settles it. `t_max` is infinite, or short of where they end by the error there.
HOT mask_n reach_clear(const Geometry *geometry, const Rays *rays, const Hit *hit, const real_n *to_light, real_n t_max, const int from_eye,
                       real extent, mask_n lit) {
    Rays towards;
    real_n start[3] = {hit->point[0], hit->point[1], hit->point[2]}, error = hit->error;
    mask_n own = load_lanes(hit->slot);
    //@ reach_start
    for (int a = 0; a < 3; a++) {
        towards.origin[a] = choose(lit, multiply_add(hit->geometric[a], error, start[a]), (real_n)0);
        towards.direction[a] = to_light[a];
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
    //@ reach_limit
    scene_trace(geometry, &towards, 0, 1, &hits);
    //@counting count_rays(geometry->counters, COUNT_SHADOW, towards.active);
    //@ reach_blocked
    return lit & is_less(hits.slot, NO_LANES);
}

//@hook sphere_meets
        // A ray from a hit starts on its own sphere, though any hit will do; one from a light, which ends there, starts off the light.
        const mask_n starts = own & is_equal(rays->t_min, (real_n)0);
        meets |= starts;
//@end
//@hook sphere_root
        if (any_hit) t = choose(starts, R(2.0) * b, t);
//@end
