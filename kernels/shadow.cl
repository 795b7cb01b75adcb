// Provides: light_geometry, shadow_rays, shadow_lit: which hit points a point light sees.
// Needs: scene.cl, hit.cl, structs.  Reads: SHADOW_SHARED_ORIGIN (1: edge planes as seen from every light are at hand).

// What rays from a light meet: everything, as seen from there.
HOT Geometry light_geometry(const Geometry *geometry, global const Light *light, int index) {
    Geometry seen = *geometry;
    seen.planes = geometry->light_planes + (size_t)index * geometry->slot_count;
    #pragma unroll
    for (int a = 0; a < 3; a++) seen.shared_origin[a] = light->given[a];
    //@ light_geometry
    return seen;
}

// Traced from the light, whose rays share it as their origin, to the point: it ends off the surface by the point's error and the
// ray's own (4u of its length and of the light's position), starts as far from the light, and passes by the primitive it ends on. Not inverted.
HOT void shadow_rays(const Geometry *geometry, global const Light *light, const Hit *hit, mask_n lit, Rays *to_hits, Hits *none) {
    Rays rays;
    real_n end[3], span[3], offset = 0;
    #pragma unroll
    for (int a = 0; a < 3; a++) {
        end[a] = hit->point[a];
        //@ shadow_end
        span[a] = end[a] - light->position[a];
        offset += abs_n(span[a]) + abs_n((real_n)light->position[a]);
    }
    offset *= R(8.0) * UNIT_ROUNDOFF;
    real_n above = hit->error + offset;
    //@ shadow_above
    #pragma unroll
    for (int a = 0; a < 3; a++) {
        rays.origin[a] = (real_n)light->position[a];
        span[a] = multiply_add(hit->geometric[a], above, end[a]) - light->position[a];
    }
    const real_n length = sqrt(dot_n(span, span));
    #pragma unroll
    for (int a = 0; a < 3; a++) rays.direction[a] = span[a] / length;
    rays.t_min = offset;
    rays.t_max = length;
    rays.active = lit;
    rays.skip = load_lanes(hit->slot);
    //@ shadow_skip
    rays_check(&rays, R(0.0));
    Hits hits;
    hits.t = length;
    hits.slot = (mask_n)-1;
    //@ hits_begin
    //@ shadow_limit
    *to_hits = rays;
    *none = hits;
}

HOT mask_n shadow_lit(const Geometry *geometry, global const Light *light, int index, const Hit *hit, mask_n lit) {
    const Geometry seen = light_geometry(geometry, light, index);
    Rays rays;
    Hits hits;
    shadow_rays(geometry, light, hit, lit, &rays, &hits);
    //@ shadow_open
    //@ shadow_trace
    //@counting count_rays(geometry->counters, COUNT_SHADOW, rays.active);
    //@ shadow_blocked
    return lit & is_less(hits.slot, NO_LANES);
}

//@hook geometry_members
    global const EdgePlanes *light_planes;  // slot_count a light
//@end
//@hook begin
    geometry.light_planes = light_planes;
//@end
//@hook visible
        mask_n clear = NO_LANES;
        //@ visible_known
        if (HAVE_SHADOWS && any_lane(lit)) lit = shadow_lit(geometry, light, i, hit, lit);
        lit |= clear;
//@end
