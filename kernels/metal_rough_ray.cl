// Provides: the ray that the mirror-like part of metal-rough surfaces sends on, drawn by visible facets.
// Needs: metal_rough.cl, bounce.cl, path.cl, throughput.cl.  Reads: nothing.

//@hook spawn
        if (current.depth_left > 0 && any_lane(metal.here)) {
            real_n u, v, facet[3], inner[3], direction[3], metal_chance;
            path_pair(&draws, path, USE_GLOSS, &u, &v);
            ggx_draw(&metal.facets, u, v, facet);
            const real_n k = metal_schlick(ggx_mirrored(&metal.facets, facet, inner));
            ggx_world(&metal.facets, inner, direction);
            normalize_n(direction);
            const mask_n above = metal.here & is_greater(inner[2], (real_n)0) & is_greater(dot_n(direction, hit.geometric), (real_n)0);
            const real_n density = ggx_density(facet[2], facet[0] * facet[0] + facet[1] * facet[1], metal.facets.alpha);
            ggx_lobe(&metal.facets, density, max_n(inner[2], (real_n)0), &metal_chance);
            const real_n left = weight * choose(above, ggx_kept(&metal.facets, inner[2]), (real_n)0) / metal.facets.albedo;
            real_n shine[3];
            for (int a = 0; a < 3; a++) {
                const real_n straight = metal_straight(&metal, metal.color[a]);
                shine[a] = current.tint[a] * (straight + (R(1.0) - straight) * k);
            }
            const mask_n kept = is_greater(left, (real_n)0);
            //@counting count_rays(counters, COUNT_GLOSS, kept);
            if (any_lane(kept)) {
                Bounce *shone = bounce_push(&geometry, &rays, &bounces, &hit, direction, left, kept, &current, BRANCH_SHONE);
                for (int a = 0; a < 3; a++) shone->tint[a] = shine[a];
                //@ shone_pushed
            }
        }
//@end
