// Provides: sun_reached: which hit points see a sun.
// Needs: scene.cl, hit.cl, structs.  Reads: nothing.

// Rays from the points, as reflected ones are: they start off the surface by the point's error, pass by the triangle that they start on
// and have no end; the first thing they meet settles it.
HOT mask_n sun_reached(const Geometry *geometry, const Rays *rays, const Hit *hit, const real_n *to_light, const int from_eye, real extent,
                       mask_n lit) {
    Rays towards;
    real_n start[3] = {hit->point[0], hit->point[1], hit->point[2]}, error = hit->error;
    mask_n own = load_lanes(hit->slot);
    //@ sun_start
    for (int a = 0; a < 3; a++) {
        towards.origin[a] = choose(lit, multiply_add(hit->geometric[a], error, start[a]), (real_n)0);
        towards.direction[a] = to_light[a];
    }
    towards.t_min = (real_n)0;
    towards.t_max = (real_n)INFINITY;
    towards.active = lit;
    towards.skip = own;
    rays_prepare(&towards, extent);
    Hits hits;
    hits.t = (real_n)INFINITY;
    hits.slot = (mask_n)-1;
    //@ hits_begin
    scene_trace(geometry, &towards, 0, 1, &hits);
    //@counting count_rays(geometry->counters, COUNT_SHADOW, towards.active);
    return lit & is_less(hits.slot, NO_LANES);
}

//@hook sun_visible
        lit = sun_reached(geometry, rays, hit, to_light, from_eye, extent, lit);
//@end
//@hook sphere_meets
        // A ray without an end starts on its own sphere, though any hit will do.
        const mask_n starts = own & is_greater(rays->t_max, (real_n)REAL_MAX);
        meets |= starts;
//@end
//@hook sphere_root
        if (any_hit) t = choose(starts, R(2.0) * b, t);
//@end
