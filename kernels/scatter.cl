// Provides: scatter_phong: what Phong's shading hands on of light from a sampled direction.
// Needs: hit.cl, structs.  Reads: nothing.
//
// Those who sample light give, for each hit, a unit vector `to_light`, the density `chance` with which they drew it, per solid angle, and
// call this; other lobes of a surface join in at their places `scatter_lobes` and `scatter_lit`. `scatter_share` is for multiple importance sampling
// (Veach 1997): how much of the lobe falls to light samples, the rest being found by rays that the lobe itself draws.

// `goes_on`: whether drawn rays are followed from here at all (not at the last depth).
// f cos without the surface's colour, (Kd N.L + Ks (R.V)^exponent) / pi, for hits on whose side the light is; 0 elsewhere.
HOT real_n scatter_phong(const Geometry *geometry, global const Material *materials, const Rays *rays, const Hit *hit, const real_n *to_light,
                         real_n chance, const int goes_on) {
    real_n diffuse, specular, exponent;
    gather(diffuse, materials[hit->material[k]].diffuse);
    gather(specular, materials[hit->material[k]].specular);
    gather(exponent, materials[hit->material[k]].exponent);
    const real_n cos_light = dot_n(hit->normal, to_light), cos_view = dot_n(hit->normal, rays->direction);
    const real_n cos_reflected = dot_n(to_light, rays->direction) - R(2.0) * cos_light * cos_view;
    mask_n above = is_greater(dot_n(hit->geometric, to_light), (real_n)0);
    //@ light_above
    const mask_n lit = hit->found & above & is_greater(cos_light, (real_n)0);
    const mask_n shiny = lit & is_greater(cos_reflected, (real_n)0) & is_greater(specular, (real_n)0);
    real_n amount = diffuse * cos_light;
    if (any_lane(shiny)) amount += choose(shiny, specular * pow(choose(shiny, cos_reflected, (real_n)1), exponent), (real_n)0);
    //@ scatter_share
    return choose(lit, amount * R(0.318309886183790672), (real_n)0);
}
