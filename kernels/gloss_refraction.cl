// Provides: rough glass: the refracted ray about a drawn facet, what facets reflect, and the albedo that makes good what they lose.
// Needs: gloss.cl, refraction.cl.  Reads: nothing.
//
// `glass_albedos` holds the number of ratios of indices and that of materials; the ratios, n1 / n2; for each material the number of its first row;
// then the rows, one a ratio: the albedo of rough glass at GLASS_COSINES places of ggx_place.
#define GLASS_COSINES 129

// The row for a material and a ratio of indices: the nearest there is.
static inline global const real *gloss_row(global const real *glass_albedos, int material, real ratio) {
    const int ratios = (int)glass_albedos[0], rows = (int)glass_albedos[1];
    real nearest = REAL_MAX;
    int row = 0;
    for (int i = 0; i < ratios; i++) {
        const real off = max(glass_albedos[2 + i] / ratio, ratio / glass_albedos[2 + i]);
        if (off >= nearest) continue;
        nearest = off;
        row = i;
    }
    return glass_albedos + 2 + ratios + rows + ((int)glass_albedos[2 + ratios + material] + row) * GLASS_COSINES;
}

static inline real gloss_glass_albedo(global const real *glass_albedos, int material, real ratio, real cosine, real alpha) {
    global const real *row = gloss_row(glass_albedos, material, ratio);
    const real place = min(cosine * (R(1.0) + alpha) / (cosine + alpha), R(1.0)) * (GLASS_COSINES - 1);
    const int i = min((int)place, GLASS_COSINES - 2);
    return row[i] + (place - i) * (row[i + 1] - row[i]);
}

// The part of light that a facet reflects, met at the cosine `met`: all where reflection is total, else what effects say.
static inline real gloss_facet_share(global const Material *material, real met, real from, real to) {
    const real ratio = from / to;
    real share = (R(1.0) - ratio) * (R(1.0) + ratio) + (ratio * met) * (ratio * met) < R(0.0) ? R(1.0) : R(0.0);
    //@ gloss_share
    return share;
}

// Refracted rays of rough lanes: about the facet `facet`, of the frame; `turned` comes with the direction to keep elsewhere.
static __attribute__((noinline)) void gloss_refract(global const Material *materials, global const int *media, global const real *glass_albedos,
                                                    const Rays *rays, const Hit *hit, const Facets *facets, mask_n rough, const real_n *facet,
                                                    const Media *before, const Media *behind, real_n *turned, real_n *passed) {
    real d[3][LANES], m[3][LANES], n[3][LANES], g[3][LANES], alpha[LANES], cosine[LANES], out[LANES];
    lane_int is_rough[LANES];
    real_n normal[3];
    ggx_world(facets, facet, normal);
    for (int a = 0; a < 3; a++) {
        store_lanes(rays->direction[a], d[a]);
        store_lanes(normal[a], m[a]);
        store_lanes(facets->z[a], n[a]);
        store_lanes(hit->geometric[a], g[a]);
    }
    store_lanes(facets->alpha, alpha);
    store_lanes(facets->out[2], cosine);
    store_lanes(rough, is_rough);
    for (int k = 0; k < LANES; k++) {
        global const Material *material = materials + hit->material[k];
        out[k] = R(0.0);
        if (!is_rough[k] || !(material->refract > R(0.0))) continue;
        const real from = media_index(before, media, k), to = media_index(behind, media, k);
        out[k] = material->refract;
        if (from == to) continue;
        const real incoming[3] = {d[0][k], d[1][k], d[2][k]}, about[3] = {m[0][k], m[1][k], m[2][k]};
        real into[3] = {0, 0, 0};
        if (refraction_snell(incoming, about, from / to, into) <= 0) {
            out[k] = R(0.0);
            continue;
        }
        const real met = min(-(incoming[0] * about[0] + incoming[1] * about[1] + incoming[2] * about[2]), R(1.0));
        const real below = -(into[0] * n[0][k] + into[1] * n[1][k] + into[2] * n[2][k]);
        const real behind_surface = -(into[0] * g[0][k] + into[1] * g[1][k] + into[2] * g[2][k]);
        const real across = max((R(1.0) - below) * (R(1.0) + below), R(0.0)), width = sqrt(below * below + alpha[k] * alpha[k] * across);
        const real kept = below > R(0.0) && behind_surface > R(0.0) ? R(2.0) * below / (below + width) : R(0.0);
        out[k] *= (R(1.0) - gloss_facet_share(material, met, from, to)) * kept /
                  gloss_glass_albedo(glass_albedos, (int)hit->material[k], from / to, cosine[k], alpha[k]);
        for (int a = 0; a < 3; a++) d[a][k] = into[a];
    }
    for (int a = 0; a < 3; a++) turned[a] = load_lanes(d[a]);
    normalize_n(turned);
    *passed = load_lanes(out);
}

// The weights of reflected rays of rough glass, about facets met at the cosine `met`; `kept` is their G2 / G1.
static __attribute__((noinline)) void gloss_reflect(global const Material *materials, global const int *media, global const real *glass_albedos,
                                                    const Hit *hit, const Facets *facets, mask_n rough, real_n met, real_n kept,
                                                    const Media *before, const Media *behind, real_n *weight) {
    real cosine[LANES], alpha[LANES], facet[LANES], left[LANES];
    lane_int is_rough[LANES];
    store_lanes(facets->out[2], cosine);
    store_lanes(facets->alpha, alpha);
    store_lanes(met, facet);
    store_lanes(kept, left);
    store_lanes(rough, is_rough);
    for (int k = 0; k < LANES; k++) {
        global const Material *material = materials + hit->material[k];
        const real from = media_index(before, media, k), to = media_index(behind, media, k);
        const real refract = is_rough[k] && from != to ? material->refract : R(0.0);
        const real share = refract > R(0.0) ? gloss_facet_share(material, facet[k], from, to) : R(0.0);
        left[k] = share > R(0.0) ? refract * share * left[k] /
                                       gloss_glass_albedo(glass_albedos, (int)hit->material[k], from / to, cosine[k], alpha[k])
                                 : R(0.0);
    }
    *weight = load_lanes(left);
}

HOT mask_n gloss_glass(global const Material *materials, const Hit *hit) {
    real_n through;
    gather(through, materials[hit->material[k]].refract);
    return is_greater(through, (real_n)0);
}

//@hook refraction_turned
            real_n glass_turned[3], glass_passed = (real_n)0;
            for (int a = 0; a < 3; a++) glass_turned[a] = through[a];
            if (any_lane(rough & is_greater(passed + internal, (real_n)0))) {
                real_n u, v, facet[3];
                path_pair(&draws, path, USE_GLOSS_THROUGH, &u, &v);
                ggx_draw(&facets, u, v, facet);
                gloss_refract(materials, media, glass_albedos, &rays, &hit, &facets, rough, facet, &current.media, &behind, glass_turned,
                              &glass_passed);
            }
            passed = choose(rough, (real_n)0, passed);
            internal = choose(rough, (real_n)0, internal);
//@end
//@hook refraction_sent
            passed = choose(rough, glass_passed, passed);
            for (int a = 0; a < 3; a++) through[a] = choose(rough, glass_turned[a], through[a]);
            //@counting count_rays(counters, COUNT_GLOSS, rough & is_greater(passed * weight, (real_n)0));
//@end
//@hook gloss_reflected
                const mask_n glass = rough & gloss_glass(materials, &hit);
                if (any_lane(glass)) {
                    real_n from_glass;
                    gloss_reflect(materials, media, glass_albedos, &hit, &facets, glass, facet_cosine, kept, &current.media, &behind, &from_glass);
                    drawn_weight += from_glass;
                    gloss_chance = choose(glass, (real_n)0, gloss_chance);
                }
//@end
//@hook gloss_lit
    lit &= ~gloss_glass(materials, hit);
//@end
