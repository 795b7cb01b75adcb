// Provides: sun_light: Phong's (1975) shading, two-sided, by suns: so far away that all their rays run the same way.
// Needs: hit.cl, geometry.cl, structs.  Reads: nothing.

// As for a point light (docs/conventions.md), with one direction to the light for the whole scene. `from_eye`: whether `rays` start at the eye.
HOT void sun_light(const Geometry *geometry, global const Sun *suns, int sun_count, global const Material *materials, const Rays *rays,
                   const Hit *hit, const int from_eye, real extent, real_n weight, Shade *shade) {
    real_n diffuse, specular, exponent;
    gather_same(hit->one_material, diffuse, materials[hit->material[k]].diffuse);
    gather_same(hit->one_material, specular, materials[hit->material[k]].specular);
    gather_same(hit->one_material, exponent, materials[hit->material[k]].exponent);
    for (int i = 0; i < sun_count; i++) {
        global const Sun *light = suns + i;
        real_n to_light[3];
        for (int a = 0; a < 3; a++) to_light[a] = (real_n)light->direction[a];
        const real_n cos_light = dot_n(hit->normal, to_light), cos_view = dot_n(hit->normal, rays->direction);
        const real_n cos_reflected = dot_n(to_light, rays->direction) - R(2.0) * cos_light * cos_view;
        mask_n above = is_greater(dot_n(hit->geometric, to_light), (real_n)0);
        //@ light_above
        mask_n lit = hit->found & above & is_greater(cos_light, (real_n)0);
        const mask_n shiny = lit & is_greater(cos_reflected, (real_n)0) & is_greater(specular, (real_n)0);
        real_n amount = diffuse * cos_light;
        if (any_lane(shiny)) amount += choose(shiny, specular * pow(choose(shiny, cos_reflected, (real_n)1), exponent), (real_n)0);
        //@ sun_amount
        mask_n wanted = is_greater(amount * weight, (real_n)0);
        //@ light_lobes
        lit &= wanted;
        if (!any_lane(lit)) continue;
        //@ sun_visible
        amount = choose(lit, amount, (real_n)0);
        //@ light_lit
        for (int a = 0; a < 3; a++) shade->sum[a] += amount * light->color[a];
    }
}

//@hook light
        {
            int from_eye = 1;
            //@ light_origin
            sun_light(&geometry, suns, frame->sun_count, materials, &rays, &hit, from_eye, frame->extent, weight, &shade);
        }
//@end
