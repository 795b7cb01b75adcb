// Provides: gloss_lobe: what rough mirrors show of light from a sampled direction; the density of their rays.
// Needs: gloss_mirror.cl, scatter.cl, added.cl, mis.cl.  Reads: nothing.
//
// Rough glass is left to its own rays, which count all that they meet. At the last depth a rough mirror shows nothing, as a polished one does.

// f cos of the lobe, times the share that falls to light samples, drawn with the density `chance`; 0 where the light is not above the surface.
HOT real_n gloss_lobe(const Geometry *geometry, global const Material *materials, const Rays *rays, const Hit *hit, const real_n *to_light,
                      real_n chance, const int goes_on) {
    if (!goes_on) return (real_n)0;
    Facets facets;
    mask_n lit = gloss_facets(geometry, materials, rays, hit, &facets);
    const real_n cosine = dot_n(facets.z, to_light);
    lit &= is_greater(cosine, (real_n)0) & is_greater(dot_n(hit->geometric, to_light), (real_n)0);
    //@ gloss_lit
    if (!any_lane(lit)) return (real_n)0;
    real_n mirrored, met, pdf;
    gather(mirrored, materials[hit->material[k]].reflect);
    const real_n density = ggx_met(&facets, rays->direction, to_light, &met);
    real_n value = mirrored * ggx_lobe(&facets, density, choose(lit, cosine, (real_n)1), &pdf) / facets.albedo;
    return choose(lit, value * mis_share(geometry, chance, pdf), (real_n)0);
}

//@hook scatter_lobes
    const real_n glossy = choose(lit, gloss_lobe(geometry, materials, rays, hit, to_light, chance, goes_on), (real_n)0);
    wanted |= is_greater(glossy * weight, (real_n)0);
//@end
//@hook scatter_lit
    for (int a = 0; a < 3; a++) shade->added[a] += choose(lit, glossy * power[a], (real_n)0);
//@end
//@hook reflected_pushed
            if (any_lane(is_greater(weight * reflected, (real_n)0))) bounces.entry[bounces.count - 1].pdf = choose(rough, gloss_chance, (real_n)0);
//@end
