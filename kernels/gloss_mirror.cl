// Provides: rough mirrors: their lobe divided by its albedo loses nothing (Turquin 2019).
// Needs: gloss.cl, mirror.cl.  Reads: nothing.

//@hook mirror_weight
    // What is rough sends on no mirrored ray, but a drawn one.
    real_n roughness;
    gather(roughness, materials[hit->material[k]].gloss);
    weight = choose(is_greater(roughness, (real_n)0), (real_n)0, weight);
//@end
//@hook gloss_reflected
                real_n mirrored_part;
                gather(mirrored_part, materials[hit.material[k]].reflect);
                drawn_weight += mirrored_part * kept / facets.albedo;
//@end
