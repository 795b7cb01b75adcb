// Provides: gloss_facets: the facets of rough mirrors and glass; the reflected ray, drawn from them.
// Needs: ggx.cl, path.cl, bounce.cl, structs.  Reads: nothing.

// Which hits are rough, and their facets.
HOT mask_n gloss_facets(const Geometry *geometry, global const Material *materials, const Rays *rays, const Hit *hit, Facets *facets) {
    real_n roughness, normal[3];
    gather(roughness, materials[hit->material[k]].gloss);
    ggx_normal(rays, hit, normal);
    ggx_begin(geometry->facet_albedos, normal, rays->direction, roughness, facets);
    return hit->found & is_greater(roughness, (real_n)0);
}

//@hook bounce_weights
            Facets facets;
            const mask_n rough = gloss_facets(&geometry, materials, &rays, &hit, &facets);
//@end
//@hook reflected_drawn
            real_n gloss_chance = (real_n)0;
            if (any_lane(rough)) {
                real_n u, v, facet[3], inner[3], drawn_direction[3], drawn_weight = (real_n)0;
                path_pair(&draws, path, USE_GLOSS, &u, &v);
                ggx_draw(&facets, u, v, facet);
                const real_n facet_cosine = ggx_mirrored(&facets, facet, inner);
                ggx_world(&facets, inner, drawn_direction);
                normalize_n(drawn_direction);
                const mask_n above = rough & is_greater(inner[2], (real_n)0) & is_greater(dot_n(drawn_direction, hit.geometric), (real_n)0);
                const real_n kept = choose(above, ggx_kept(&facets, inner[2]), (real_n)0);
                const real_n density = ggx_density(facet[2], facet[0] * facet[0] + facet[1] * facet[1], facets.alpha);
                ggx_lobe(&facets, density, max_n(inner[2], (real_n)0), &gloss_chance);
                //@ gloss_reflected
                reflected = choose(rough, drawn_weight, reflected);
                for (int a = 0; a < 3; a++) direction[a] = choose(above, drawn_direction[a], direction[a]);
                //@counting count_rays(counters, COUNT_GLOSS, rough & is_greater(drawn_weight * weight, (real_n)0));
            }
//@end
