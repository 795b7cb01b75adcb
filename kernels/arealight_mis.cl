// Provides: the share of an area light that a drawn ray has found.
// Needs: arealight.cl, mis.cl.  Reads: nothing.

// The density with which a light sample would have drawn the direction of `rays`, which meets a light at `hit`: see arealight.cl. `before` as in mis.cl.
HOT real_n arealight_chance(const Geometry *geometry, global const Frame *frame, const Rays *rays, const Hit *hit, const real_n *glow, real_n before) {
    real_n way[3];
    for (int a = 0; a < 3; a++) way[a] = hit->point[a] - rays->origin[a];
    const real_n distance = before + sqrt(dot_n(way, way)), cosine = abs_n(dot_n(hit->geometric, rays->direction));
    const real_n part = (R(0.2126) * glow[0] + R(0.7152) * glow[1] + R(0.0722) * glow[2]) / frame->emitter_power;
    real_n chance = choose(is_greater(cosine, (real_n)AREALIGHT_LEAST_COS), part * distance * distance / cosine, (real_n)0);
    //@ arealight_chance
    return chance;
}

//@hook arealight_share
                // A drawn ray met the light by chance: the samples of lights bring the rest.
                share = choose(is_greater(current.pdf, (real_n)0),
                               mis_drawn_share(&geometry, current.pdf, arealight_chance(&geometry, frame, &rays, &hit, glow, current.before)), (real_n)1);
                real_n known;  // to the samples of lights
                gather(known, (real)materials[hit.material[k]].emission_drawn);
                share = choose(is_greater(known, (real_n)0), share, (real_n)1);
//@end
