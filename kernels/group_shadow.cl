// Provides: group_lights: which point lights shine on what the eye sees of a group.
// Needs: group.cl, shadow.cl.  Reads: SHADOW_SHARED_ORIGIN (1).
//
// Rays from one light to the points that a group sees go together, as those of the eye do. What is found is kept a bit a light; lanes for which
// direct_light asks more are traced then, as those of all other points are.
HOT void group_lights(const Geometry *geometry, global const Light *lights, int light_count, const Hit *hits, LightsSeen *seen) {
    for (int p = 0; p < GROUP; p++) seen[p].known = seen[p].clear = NO_LANES;
    for (int i = 0; i < light_count && i < LIGHTS_SEEN; i++) {
        global const Light *light = lights + i;
        const mask_n bit = (mask_n)((lane_int)1 << i);
        Rays rays[GROUP];
        Hits met[GROUP];
        mask_n some = NO_LANES;
        for (int p = 0; p < GROUP; p++) {
            const Hit *hit = hits + p;
            real_n to_light[3];
            #pragma unroll
            for (int a = 0; a < 3; a++) to_light[a] = light->position[a] - hit->point[a];
            mask_n above = is_greater(dot_n(hit->geometric, to_light), (real_n)0);
            //@ light_above
            const mask_n lit = hit->found & above & is_greater(dot_n(hit->normal, to_light), (real_n)0);
            shadow_rays(geometry, light, hit, lit, rays + p, met + p);
            seen[p].known |= lit & bit;
            some |= lit;
        }
        if (!any_lane(some)) continue;
        const Geometry from_light = light_geometry(geometry, light, i);
        group_trace(&from_light, rays, 1, met);
        for (int p = 0; p < GROUP; p++) seen[p].clear |= is_less(met[p].slot, NO_LANES) & bit;
    }
}

//@hook geometry_members
    global const DirectionBoxes *light_boxes;  // box_count a light
    const LightsSeen *lights_seen;             // of the hits that the eye sees; or 0
//@end
//@hook parameters
                   , global const DirectionBoxes *light_boxes
//@end
//@hook arguments
                  , light_boxes
//@end
//@hook begin
    geometry.light_boxes = light_boxes;
    geometry.lights_seen = 0;
//@end
//@hook light_geometry
    seen.boxes = geometry->light_boxes + (size_t)index * geometry->box_count;
//@end
//@hook group_seen
    LightsSeen lights_seen[GROUP];
    group_lights(&geometry, lights, frame->light_count, eye_hit, lights_seen);
//@end
//@hook seen_parameters
                   , const LightsSeen *lights_seen
//@end
//@hook seen_arguments
                      , lights_seen + p
//@end
//@hook surface_seen
        geometry.lights_seen = from_group ? lights_seen : 0;
//@end
//@hook visible_known
        const mask_n known = lights_known(geometry->lights_seen, i, &lit, &clear);
        //@counting count_rays(geometry->counters, COUNT_SHADOW, known);
//@end
//@hook shadow_trace
    packet_trace(&seen, &rays, 1, &hits);
//@end
