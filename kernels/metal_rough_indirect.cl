// Provides: rays that the matte part of metal-rough surfaces sends on, for light from surface to surface.
// Needs: metal_rough.cl, indirect.cl.  Reads: nothing.
//
// Drawn by the cosine about N, so a ray's weight is pi / cos times the matte part. Roulette as in indirect.cl.

//@hook spawn
        if (HAVE_INDIRECT && current.depth_left > 0 && any_lane(metal.here)) {
            real_n u, v, direction[3], matte, lobe, k, unused;
            path_pair(&draws, path, USE_SCATTER, &u, &v);
            indirect_about(hit.normal, sqrt(u), R(2.0) * v, direction);
            normalize_n(direction);
            const real_n cosine = dot_n(hit.normal, direction), chance = cosine * R(0.318309886183790672);
            mask_n kept = metal.here & is_greater(cosine, (real_n)0) & is_greater(dot_n(hit.geometric, direction), (real_n)0);
            metal_lobes(&metal, &rays, &hit, direction, kept, &matte, &lobe, &k, &unused);
            real_n left[3], most = (real_n)0;
            for (int a = 0; a < 3; a++) {
                const real_n surface = (R(1.0) - metal_straight(&metal, metal.color[a])) * (R(1.0) - metal.metallic) * metal.color[a];
                left[a] = choose(kept, current.tint[a] * surface * matte / chance, (real_n)0);
                most = max_n(most, left[a] * weight);
            }
            kept &= is_greater(most, (real_n)0);
            if (frame->depth - current.depth_left >= INDIRECT_SURE_RAYS) {
                real_n roulette;
                path_pair(&draws, path, USE_LIGHT_PICK, &unused, &roulette);
                const real_n stays = min_n(max_n(most, (real_n)INDIRECT_LEAST_CHANCE), (real_n)1);
                kept &= is_less(roulette, stays);
                for (int a = 0; a < 3; a++) left[a] /= stays;
            }
            if (any_lane(kept)) {
                Bounce *drawn = bounce_push(&geometry, &rays, &bounces, &hit, direction, weight, kept, &current, BRANCH_MATTE);
                for (int a = 0; a < 3; a++) drawn->tint[a] = left[a];
                //@counting count_rays(counters, COUNT_INDIRECT, kept);
                //@ drawn_pushed
                //@ scattered_pushed
            }
        }
//@end
//@hook metal_share
    // Directions that scattered rays draw, too.
    if (HAVE_INDIRECT && goes_on) {
        const real_n cosine = dot_n(hit->normal, to_light), drawn = cosine * R(0.318309886183790672);
        const mask_n could = is_greater(cosine, (real_n)0) & is_greater(dot_n(hit->geometric, to_light), (real_n)0);
        real_n density = choose(could, drawn, (real_n)0);
        //@ scattered_density
        matte *= mis_share(geometry, chance, density);
    }
//@end
