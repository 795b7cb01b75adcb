// Provides: direct_light: point lights without fall-off and Phong's (1975) shading, two-sided.
// Needs: hit.cl, structs.  Reads: nothing.

// Adds weight * C * (Ka + sum of visible * Lrgb * (Kd N.L + Ks (R.V)^exponent)) to `shade`. A light counts where it stands on the
// viewer's side of both the shading and the true surface.
HOT void direct_light(const Geometry *geometry, global const Light *lights, int light_count, global const Material *materials,
                         const Rays *rays, const Hit *hit, real_n weight, Shade *shade) {
    real_n diffuse, specular, exponent;
    gather_same(hit->one_material, diffuse, materials[hit->material[k]].diffuse);
    gather_same(hit->one_material, specular, materials[hit->material[k]].specular);
    gather_same(hit->one_material, exponent, materials[hit->material[k]].exponent);
    for (int i = 0; i < light_count; i++) {
        global const Light *light = lights + i;
        real_n to_light[3];
        #pragma unroll
        for (int a = 0; a < 3; a++) to_light[a] = light->position[a] - hit->point[a];
        normalize_n(to_light);
        const real_n cos_light = dot_n(hit->normal, to_light), cos_view = dot_n(hit->normal, rays->direction);
        // R.V with R = 2 (N.L) N - L and V = -direction.
        const real_n cos_reflected = dot_n(to_light, rays->direction) - R(2.0) * cos_light * cos_view;
        mask_n above = is_greater(dot_n(hit->geometric, to_light), (real_n)0);
        //@ light_above
        mask_n lit = hit->found & above & is_greater(cos_light, (real_n)0);
        const mask_n shiny = lit & is_greater(cos_reflected, (real_n)0) & is_greater(specular, (real_n)0);
        real_n amount = diffuse * cos_light;
        if (any_lane(shiny)) amount += choose(shiny, specular * pow(choose(shiny, cos_reflected, (real_n)1), exponent), (real_n)0);
        //@ light_phong
        //@ light_amount
        mask_n wanted = is_greater(amount * weight, (real_n)0);
        //@ light_lobes
        lit &= wanted;
        if (!any_lane(lit)) continue;
        //@ visible
        amount = choose(lit, amount, (real_n)0);
        //@ light_lit
        #pragma unroll
        for (int a = 0; a < 3; a++) shade->sum[a] += amount * light->color[a];
    }
}

//@hook light
        direct_light(&geometry, lights, frame->light_count, materials, &rays, &hit, weight, &shade);
//@end
