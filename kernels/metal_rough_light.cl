// Provides: what metal-rough surfaces show of light from a sampled direction; the density of their rays.
// Needs: metal_rough.cl, scatter.cl; mis.cl, where rays go on.  Reads: nothing.

// Where light counts for the matte part: as for Phong's.
HOT mask_n metal_above(const Hit *hit, const real_n *to_light) {
    mask_n above = is_greater(dot_n(hit->geometric, to_light), (real_n)0);
    //@ light_above
    return above & is_greater(dot_n(hit->normal, to_light), (real_n)0);
}

//@hook scatter_lobes
    real_n matte, lobe, grazing, lobe_chance;
    metal_lobes(shade->metal, rays, hit, to_light, lit & metal_above(hit, to_light), &matte, &lobe, &grazing, &lobe_chance);
    //@ metal_share
    wanted |= shade->metal->here & is_greater((matte + lobe) * weight, (real_n)0);
//@end
//@hook scatter_lit
    for (int a = 0; a < 3; a++) metal_add(shade->metal, a, choose(lit, power[a], (real_n)0), matte, lobe, grazing);
//@end
