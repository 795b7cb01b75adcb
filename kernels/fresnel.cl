// Provides: fresnel_dielectric, fresnel_transmitted: the shares of unpolarised light that a polished dielectric reflects and lets through;
//           fresnel_split: what these make of the weights of a hit.
// Needs: lanes.cl; fresnel_split: refraction.cl.  Reads: nothing.
//
// With a = n1 cos i, b = n2 cos t, D = n2^2 - n1^2 and Snell's law n1 sin i = n2 sin t:
//     b^2 = a^2 + D                                           no root of a difference of sines
//     r_s = (a - b) / (a + b) = -D / (a + b)^2                no difference of a and b
//     r_p = r_s (cos i cos t - sin i sin t) / (cos i cos t + sin i sin t)         (Born and Wolf 1999, 1.5.2, as tangents and sines)
//     T_s = 4 a b / (a + b)^2,  T_p = 4 cos i cos t n1 n2 / (n2 cos i + n1 cos t)^2
//
// | quantity | how                                                         | error, u = unit roundoff                          |
// |----------|-------------------------------------------------------------|---------------------------------------------------|
// | D, b^2   | squares and sums as unevaluated pairs (Dekker 1971; Knuth)  | 2u of the result, at any cancellation above u^2 a^2 |
// | r_s      | 1 root, 1 quotient                                          | 8u: F_s 17u                                       |
// | r_p / r_s| one cancellation, at Brewster's angle, where F_s stays      | 8u of 1: F_p 18u F_s, so F 24u                    |
// | T        | products and sums of positive terms alone                   | 16u, even where F is 1 - 1e-8                     |
//
// cos i is in [0, 1], indices in [2^-20, 2^20]. F = 0 and T = 1 for equal indices, at every angle; F = 1 and T = 0 for total reflection.

// x + y as a pair (Knuth's two-sum); x y as a pair.
static inline real fresnel_sum(real x, real y, real *rest) {
    const real sum = x + y, part = sum - x;
    *rest = (x - (sum - part)) + (y - part);
    return sum;
}
static inline real fresnel_product(real x, real y, real *rest) {
    const real product = x * y;
    *rest = fma(x, y, -product);
    return product;
}

// b^2 = (n1 cos i)^2 + n2^2 - n1^2 and the difference D of the squared indices, each rounded about once.
static inline real fresnel_square(real cos_i, real n1, real n2, real *difference) {
    real a_rest, a2_rest, n1_rest, n2_rest, d_rest, b_rest;
    const real a = fresnel_product(n1, cos_i, &a_rest), a2 = fresnel_product(a, a, &a2_rest);
    const real n1_2 = fresnel_product(n1, n1, &n1_rest), n2_2 = fresnel_product(n2, n2, &n2_rest);
    const real d = fresnel_sum(n2_2, -n1_2, &d_rest);
    d_rest += n2_rest - n1_rest;
    *difference = d + d_rest;
    const real b2 = fresnel_sum(a2, d, &b_rest);
    return b2 + (b_rest + (a2_rest + R(2.0) * a * a_rest + d_rest));
}

static inline real fresnel_dielectric(real cos_i, real n1, real n2) {
    real d;
    const real b2 = fresnel_square(cos_i, n1, n2, &d);
    if (d == R(0.0)) return R(0.0);
    if (b2 <= R(0.0)) return R(1.0);
    const real a = n1 * cos_i, b = sqrt(b2), r_s = d / ((a + b) * (a + b));
    // cos i cos t and sin i sin t, both times n2; 1 - cos i is exact where it cancels.
    const real straight = cos_i * b, crossed = n1 * ((R(1.0) - cos_i) * (R(1.0) + cos_i));
    const real ratio = (straight - crossed) / (straight + crossed);
    return fmin(R(0.5) * r_s * r_s * (R(1.0) + ratio * ratio), R(1.0));
}

static inline real fresnel_transmitted(real cos_i, real n1, real n2) {
    real d;
    const real b2 = fresnel_square(cos_i, n1, n2, &d);
    if (d == R(0.0)) return R(1.0);
    if (b2 <= R(0.0)) return R(0.0);
    const real a = n1 * cos_i, b = sqrt(b2), across = a + b, along = n2 * n2 * cos_i + n1 * b;
    return fmin(R(2.0) * a * b * (R(1.0) / (across * across) + (n2 / along) * (n2 / along)), R(1.0));
}

//@hook refraction_parts
// The cosine of incidence on the normal that refraction_turn has used: the shading one, or the true one where that did not serve.
static inline real fresnel_cosine(const real *d, const real *shading, const real *surface, real ratio) {
    real turned[3];
    const int passes = refraction_snell(d, shading, ratio, turned);
    const int serves = passes > 0 && turned[0] * surface[0] + turned[1] * surface[1] + turned[2] * surface[2] < R(0.0);
    const real *n = serves ? shading : surface;
    return clamp(-(d[0] * n[0] + d[1] * n[1] + d[2] * n[2]), R(0.0), R(1.0));
}

// Leaves of `passed` what goes through and gives what is reflected, for lanes of such materials; others keep theirs, and get 0.
static __attribute__((noinline)) void fresnel_split(global const Material *materials, global const int *media, const Rays *rays,
                                                    const Hit *hit, const Media *before, const Media *behind, real_n *passed,
                                                    real_n *reflected) {
    real d[3][LANES], n[3][LANES], g[3][LANES], through[LANES], back[LANES];
    for (int a = 0; a < 3; a++) {
        store_lanes(rays->direction[a], d[a]);
        store_lanes(hit->normal[a], n[a]);
        store_lanes(hit->geometric[a], g[a]);
    }
    store_lanes(*passed, through);
    for (int k = 0; k < LANES; k++) {
        back[k] = R(0.0);
        if (!(through[k] > R(0.0)) || !materials[hit->material[k]].fresnel) continue;
        const real from = media_index(before, media, k), to = media_index(behind, media, k);
        const real incoming[3] = {d[0][k], d[1][k], d[2][k]}, shading[3] = {n[0][k], n[1][k], n[2][k]};
        const real surface[3] = {g[0][k], g[1][k], g[2][k]};
        const real cos_i = fresnel_cosine(incoming, shading, surface, from / to);
        back[k] = through[k] * fresnel_dielectric(cos_i, from, to);
        through[k] *= fresnel_transmitted(cos_i, from, to);
    }
    *passed = load_lanes(through);
    *reflected = load_lanes(back);
}
//@end
//@hook refraction_weights
            real_n glint;
            fresnel_split(materials, media, &rays, &hit, &current.media, &behind, &passed, &glint);
            //@counting count_rays(counters, COUNT_FRESNEL, is_greater(glint * weight, (real_n)0));
            reflected += glint;
//@end
