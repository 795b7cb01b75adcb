// Provides: mirror_weight: how much of the mirrored ray each hit shows.
// Needs: hit.cl, structs.  Reads: nothing.
HOT real_n mirror_weight(global const Material *materials, const Hit *hit) {
    real_n weight;
    gather_same(hit->one_material, weight, materials[hit->material[k]].reflect);
    //@ mirror_weight
    return choose(hit->found, weight, (real_n)0);
}

//@hook bounce_weights
            const real_n mirrored = mirror_weight(materials, &hit);
            //@counting count_rays(counters, COUNT_MIRROR, is_greater(mirrored * weight, (real_n)0));
            reflected += mirrored;
//@end
