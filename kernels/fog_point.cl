// Provides: fog_point: light of point lights and spots that fog scatters; what fog leaves of it on its way.
// Needs: fog.cl, light_point.cl, structs.  Reads: HAVE_FOG.

HOT void fog_point(const Geometry *geometry, global const Frame *frame, global const Light *lights, const Rays *rays, const Hit *hit, real_n weight,
                   real_n *misty) {
    for (int i = 0; i < frame->light_count; i++) {
        global const Light *light = lights + i;
        real_n to_light[3];
        for (int a = 0; a < 3; a++) to_light[a] = light->position[a] - hit->point[a];
        normalize_n(to_light);
        // A light without a size stands for pi times its colour (docs/conventions.md).
        real_n amount = R(3.14159265358979324) * fog_phase(frame->fog_asymmetry, dot_n(to_light, rays->direction));
        //@ light_amount
        mask_n lit = hit->found & is_greater(amount * weight, (real_n)0);
        if (!any_lane(lit)) continue;
        // Off the place towards the light, by what the place is off.
        Hit towards = *hit;
        for (int a = 0; a < 3; a++) towards.geometric[a] = to_light[a];
        {
            const Hit *hit = &towards;
            //@ visible
        }
        //@ fog_lit
        amount = choose(lit, amount, (real_n)0);
        for (int a = 0; a < 3; a++) misty[a] += amount * light->color[a];
    }
}

//@hook light_amount
        if (HAVE_FOG) {
            real_n through[3];
            for (int a = 0; a < 3; a++) through[a] = light->position[a] - hit->point[a];
            amount *= exp(-geometry->fog_density * sqrt(dot_n(through, through)));
        }
//@end
//@hook fog_lights
                fog_point(&geometry, frame, lights, &rays, &mote, weight, misty);
//@end
