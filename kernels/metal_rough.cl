// Provides: MetalRough: metal-rough surfaces as in glTF 2.0, appendix B, and the sums of their light; metal_*.
// Needs: ggx.cl, hit.cl, structs; bounce.cl, path.cl, throughput.cl, where rays go on.  Reads: nothing.
//
// With C the base colour, m metallic, F0 = 0.04 (1 - m) + C m and k = (1 - V.h)^5, F = F0 + (1 - F0) k is Schlick's (1994); of light from i
//     (1 - F) (1 - m) C S N.i / pi + F lobe = (1 - F0) ((1 - m) C matte + lobe k) + F0 lobe,   matte = (1 - k) S N.i / pi
// is handed on: three sums over the lights, of matte, lobe k and lobe, hold what all colours need. `diffuse_shares` is the table of S.
#define METAL_DIELECTRIC R(0.04)  // F0 of what is no metal
#define METAL_SHARES 65           // columns of the table of S, for the root of the cosine from 0 to 1

typedef struct MetalRough {
    Facets facets;
    mask_n here;                          // which hits are such
    real_n metallic, share;
    real_n color[3];                      // C, once it is known
    real_n matte[3], grazing[3], lobe[3]; // the sums, of red, green and blue
} MetalRough;

HOT void metal_begin(const Geometry *geometry, global const Material *materials, global const real *diffuse_shares, const Rays *rays,
                     const Hit *hit, real_n metallic, real_n roughness, MetalRough *metal) {
    real_n kind, normal[3];
    gather(kind, materials[hit->material[k]].metal_rough);
    metal->here = hit->found & is_greater(kind, (real_n)0);
    metal->metallic = metallic;
    ggx_normal(rays, hit, normal);
    ggx_begin(geometry->facet_albedos, normal, rays->direction, roughness, &metal->facets);
    metal->share = ggx_table(diffuse_shares, GGX_ROUGHNESSES, METAL_SHARES, sqrt(metal->facets.alpha), sqrt(metal->facets.out[2]));
    for (int a = 0; a < 3; a++) metal->color[a] = metal->matte[a] = metal->grazing[a] = metal->lobe[a] = (real_n)0;
}

// (1 - V.h)^5.
HOT real_n metal_schlick(real_n cosine) {
    const real_n rest = R(1.0) - cosine, square = rest * rest;
    return square * square * rest;
}

// matte, lobe and k for light from `to_light`; `above`: where it counts for the first; `pdf`: the density of drawing it for the second.
HOT void metal_lobes(const MetalRough *metal, const Rays *rays, const Hit *hit, const real_n *to_light, mask_n above, real_n *matte,
                     real_n *lobe, real_n *k, real_n *pdf) {
    real_n met;
    const real_n density = ggx_met(&metal->facets, rays->direction, to_light, &met), cosine = dot_n(metal->facets.z, to_light);
    const mask_n shines = metal->here & is_greater(cosine, (real_n)0) & is_greater(dot_n(hit->geometric, to_light), (real_n)0);
    *k = metal_schlick(met);
    const real_n lit = ggx_lobe(&metal->facets, density, choose(shines, cosine, (real_n)1), pdf) / metal->facets.albedo;
    *lobe = choose(shines, lit, (real_n)0);
    *matte = choose(metal->here & above, R(0.318309886183790672) * metal->share * dot_n(hit->normal, to_light) * (R(1.0) - *k), (real_n)0);
}

HOT void metal_add(MetalRough *metal, int a, real_n power, real_n matte, real_n lobe, real_n k) {
    metal->matte[a] += power * matte;
    metal->grazing[a] += power * lobe * k;
    metal->lobe[a] += power * lobe;
}

HOT real_n metal_straight(const MetalRough *metal, real_n color) {
    return METAL_DIELECTRIC * (R(1.0) - metal->metallic) + color * metal->metallic;
}

//@hook shade_members
    struct MetalRough *metal;
//@end
//@hook shade_begin
        MetalRough metal;
        {
            real_n metallic, roughness;
            gather(metallic, materials[hit.material[k]].metallic);
            gather(roughness, materials[hit.material[k]].roughness);
            //@ metal_maps
            metal_begin(&geometry, materials, diffuse_shares, &rays, &hit, metallic, roughness, &metal);
        }
        shade.metal = &metal;
//@end
//@hook light_phong
        // Of such hits, `amount` is what effects leave of the light, until it is known.
        amount = choose(shade->metal->here, (real_n)1, amount);
//@end
//@hook sun_amount
        amount = choose(shade->metal->here, (real_n)1, amount);
//@end
//@hook light_lobes
        real_n matte, lobe, grazing, unused;
        metal_lobes(shade->metal, rays, hit, to_light, lit, &matte, &lobe, &grazing, &unused);
        real_n metal_power = choose(shade->metal->here, amount * R(3.14159265358979324), (real_n)0);
        amount = choose(shade->metal->here, (real_n)0, amount);
        wanted = (wanted & ~shade->metal->here) | is_greater(metal_power * (matte + lobe) * weight, (real_n)0);
        lit |= shade->metal->here;
//@end
//@hook light_lit
        for (int a = 0; a < 3; a++) metal_add(shade->metal, a, choose(lit, metal_power * light->color[a], (real_n)0), matte, lobe, grazing);
//@end
//@hook channel
            {
                const real_n straight = metal_straight(&metal, albedo);
                const real_n rest = (R(1.0) - metal.metallic) * albedo * metal.matte[a] + metal.grazing[a];
                metal.color[a] = albedo;
                seen += choose(metal.here, (R(1.0) - straight) * rest + straight * metal.lobe[a], (real_n)0);
            }
//@end
