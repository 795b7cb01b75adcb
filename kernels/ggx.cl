// Provides: Facets: a rough surface of GGX microfacets and the viewer's side of it; ggx_*: its density, shadowing, draws and albedo.
// Needs: hit.cl, rays.cl.  Reads: nothing.
//
// Isotropic, in a frame whose z is the normal; o points to the viewer, i to where light comes from, m is a facet's normal, h the half vector.
// With s(v) = sqrt(v_z^2 + alpha^2 (1 - v_z^2)), the length of v stretched, no formula has a difference of nearly equal numbers:
//
// | quantity              | formula                                            | source                   | relative error, u = unit roundoff |
// |-----------------------|----------------------------------------------------|--------------------------|-----------------------------------|
// | D(h)                  | alpha^2 / (pi (h_z^2 alpha^2 + |n x h|^2)^2)       | Trowbridge, Reitz 1975;  | 30u (1 + e / (u max(alpha, sin))),|
// |                       |                                                    | Walter and others 2007   | e the error of h's angle          |
// | G1(o)                 | 2 o_z / (o_z + s(o))                               | Smith 1967; Heitz 2014   | 8u                                |
// | G2 / G1(o)            | i_z (o_z + s(o)) / (o_z s(i) + i_z s(o))           | Heitz 2014, height-      | 16u                               |
// | D G2 / (4 o_z)        | D i_z / (2 (o_z s(i) + i_z s(o)))                  | correlated               | that of D, 16u                    |
// | pdf of i              | D / (2 (o_z + s(o)))                               | Heitz 2018, equation 17  | that of D, 10u                    |
// | m by visible normals  | a point of a spherical cap, unstretched            | Dupuy and Benyoub 2023   | 20u of its slope, and of alpha    |
// | albedo of the lobe    | bilinear in a table made in float64                | quadrature on the host   | 4e-4 absolutely                   |
//
// alpha is at least GGX_LEAST_ALPHA: below that the angle of a half vector in float32 is mere rounding, and a pixel sees a mirror.
#define GGX_LEAST_ALPHA R(1e-4)
#define GGX_ROUGHNESSES 65  // rows of the table, for sqrt(alpha) from 0 to 1
#define GGX_COSINES 129     // its columns, for ggx_place from 0 to 1

typedef struct {
    real_n alpha;
    real_n x[3], y[3], z[3];  // the frame, z the normal
    real_n out[3];            // unit, towards the viewer, in the frame; out[2] > 0
    real_n stretched;         // s(out)
    real_n albedo;            // what the lobe alone hands on of light from all sides, without Fresnel's factor
} Facets;

HOT real_n ggx_stretched(real_n cosine, real_n alpha) {
    const real_n across = max_n((R(1.0) - cosine) * (R(1.0) + cosine), (real_n)0);
    return sqrt(cosine * cosine + alpha * alpha * across);
}

// Where the table has a cosine: 0 to 1, fine where cosines are like alpha, as there the lobe loses most.
HOT real_n ggx_place(real_n cosine, real_n alpha) { return min_n(cosine * (R(1.0) + alpha) / (cosine + alpha), (real_n)1); }

// Bilinear between the nodes of `table`, `columns` wide; u and v from 0 to 1 along rows and columns.
HOT real_n ggx_table(global const real *table, const int rows, const int columns, real_n u, real_n v) {
    real row[LANES], column[LANES], value[LANES];
    store_lanes(u * (real)(rows - 1), row);
    store_lanes(v * (real)(columns - 1), column);
    for (int k = 0; k < LANES; k++) {
        const int i = clamp((int)row[k], 0, rows - 2), j = clamp((int)column[k], 0, columns - 2);
        const real a = row[k] - i, b = column[k] - j;
        global const real *at = table + i * columns + j;
        value[k] = (R(1.0) - a) * ((R(1.0) - b) * at[0] + b * at[1]) + a * ((R(1.0) - b) * at[columns] + b * at[columns + 1]);
    }
    return load_lanes(value);
}

// The normal that facets lie about: the shading one, or the true one where the viewer, or its mirror image, is not above the surface by that.
HOT void ggx_normal(const Rays *rays, const Hit *hit, real_n *normal) {
    const real_n cosine = -dot_n(rays->direction, hit->normal);
    const real_n mirrored = dot_n(rays->direction, hit->geometric) + R(2.0) * cosine * dot_n(hit->normal, hit->geometric);
    const mask_n serves = is_greater(cosine, (real_n)0) & is_greater(mirrored, (real_n)0);
    for (int a = 0; a < 3; a++) normal[a] = choose(serves, hit->normal[a], hit->geometric[a]);
}

// The facets about the unit normal `normal`, met by rays along `direction`, which comes from above: normal . direction < 0.
HOT void ggx_begin(global const real *albedos, const real_n *normal, const real_n *direction, real_n roughness, Facets *facets) {
    const real_n alpha = max_n(roughness * roughness, (real_n)GGX_LEAST_ALPHA);
    // A frame about the normal (Duff and others 2017).
    const real_n sign = choose(is_less(normal[2], (real_n)0), (real_n)-1, (real_n)1), q = R(-1.0) / (sign + normal[2]);
    const real_n both = normal[0] * normal[1] * q;
    const real_n x[3] = {R(1.0) + sign * normal[0] * normal[0] * q, sign * both, -sign * normal[0]};
    const real_n y[3] = {both, sign + normal[1] * normal[1] * q, -normal[1]};
    for (int a = 0; a < 3; a++) {
        facets->x[a] = x[a];
        facets->y[a] = y[a];
        facets->z[a] = normal[a];
    }
    facets->alpha = alpha;
    facets->out[0] = -dot_n(direction, x);
    facets->out[1] = -dot_n(direction, y);
    facets->out[2] = min_n(max_n(-dot_n(direction, normal), (real_n)TINY_COMPONENT), (real_n)1);
    facets->stretched = ggx_stretched(facets->out[2], alpha);
    facets->albedo = ggx_table(albedos, GGX_ROUGHNESSES, GGX_COSINES, sqrt(alpha), ggx_place(facets->out[2], alpha));
}

// D, for the half vector's part along the normal and the square of its part across.
HOT real_n ggx_density(real_n along, real_n across_2, real_n alpha) {
    const real_n root = along * along * alpha + across_2 / alpha;
    return R(0.318309886183790672) / (root * root);
}

// D G2 / (4 o_z): what the lobe makes of light from a direction at `cosine` > 0 from the normal, with the cosine; in `pdf`, the density of
// drawing that direction. Divided by each other they give ggx_kept.
HOT real_n ggx_lobe(const Facets *facets, real_n density, real_n cosine, real_n *pdf) {
    *pdf = R(0.5) * density / (facets->out[2] + facets->stretched);
    return R(0.5) * density * cosine / (facets->out[2] * ggx_stretched(cosine, facets->alpha) + cosine * facets->stretched);
}

// G2 / G1(o).
HOT real_n ggx_kept(const Facets *facets, real_n cosine) {
    return cosine * (facets->out[2] + facets->stretched) / (facets->out[2] * ggx_stretched(cosine, facets->alpha) + cosine * facets->stretched);
}

// A facet's normal, in the frame, with the density of those that the viewer sees: u, v in [0, 1).
HOT void ggx_draw(const Facets *facets, real_n u, real_n v, real_n *facet) {
    const real_n scale = R(1.0) / facets->stretched, alpha = facets->alpha;
    const real_n o[3] = {alpha * facets->out[0] * scale, alpha * facets->out[1] * scale, facets->out[2] * scale};
    // The cap's point has z between -o_z and 1; its height above -o_z, and 1 + z without a difference of nearly equal numbers.
    const real_n height = (R(1.0) - v) * (R(1.0) + o[2]), rest = (o[0] * o[0] + o[1] * o[1]) / (R(1.0) + o[2]);
    const real_n above = height + rest, sine = sqrt(max_n(above * (R(2.0) - above), (real_n)0));
    facet[0] = alpha * (sine * cospi(R(2.0) * u) + o[0]);
    facet[1] = alpha * (sine * sinpi(R(2.0) * u) + o[1]);
    facet[2] = height;
    normalize_n(facet);
}

// `inner`, of the frame, as a direction of the scene.
HOT void ggx_world(const Facets *facets, const real_n *inner, real_n *direction) {
    for (int a = 0; a < 3; a++) direction[a] = inner[0] * facets->x[a] + inner[1] * facets->y[a] + inner[2] * facets->z[a];
}

// The mirror image of the viewer in a facet: in the frame as well. Gives the cosine between the viewer and the facet.
HOT real_n ggx_mirrored(const Facets *facets, const real_n *facet, real_n *inner) {
    const real_n cosine = max_n(dot_n(facets->out, facet), (real_n)0);
    for (int a = 0; a < 3; a++) inner[a] = R(2.0) * cosine * facet[a] - facets->out[a];
    return min_n(cosine, (real_n)1);
}

// For light from the unit direction `to_light`: D of the half vector, and in `cosine` that between the viewer and it. `direction` is the ray's.
HOT real_n ggx_met(const Facets *facets, const real_n *direction, const real_n *to_light, real_n *cosine) {
    real_n half_way[3], cross[3];
    for (int a = 0; a < 3; a++) half_way[a] = to_light[a] - direction[a];
    const real_n length_2 = max_n(dot_n(half_way, half_way), (real_n)TINY_COMPONENT);
    for (int a = 0; a < 3; a++) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        cross[a] = facets->z[b] * half_way[c] - facets->z[c] * half_way[b];
    }
    *cosine = min_n(R(0.5) * sqrt(length_2), (real_n)1);
    const real_n along = dot_n(half_way, facets->z) / sqrt(length_2);
    return ggx_density(along, dot_n(cross, cross) / length_2, facets->alpha);
}

//@hook geometry_members
    global const real *facet_albedos;
//@end
//@hook begin
    geometry.facet_albedos = facet_albedos;
//@end
