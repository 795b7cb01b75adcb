// Provides: normalmap_tilt: shading normals turned by pictures.
// Needs: texture.cl, hit.cl, structs.  Reads: nothing.
//
// The frame: z the shading normal N on the viewer's side; x along the growing u, perpendicular to N; y perpendicular to both, on the side of the
// growing v. With the corners' edges e1, e2 and their differences a, b on the picture, det = a_u b_v - a_v b_u, u grows along
// (b_v e1 - a_v e2) / det and v along (a_u e2 - b_u e1) / det. In float64 from the numbers as given, so that the tilted normal is off by what N,
// the texels and the place on the picture are. A sphere's x runs along its circle of latitude, its y up along its meridian.
#define NORMALMAP_LEAST_TURN 0x1p-40  // sine of the angle between the edges on the picture up to which they are on a line

// How a point of the triangle moves as u grows, and as v does; 0 where the corners' places lie on a line: no frame, no tilt.
HOT int normalmap_moves(const Geometry *geometry, global const double *corner_uvs, int slot, double *along_u, double *along_v) {
    global const double *v = geometry->vertices + 9 * (size_t)slot, *corner = corner_uvs + 6 * (size_t)slot;
    const double a[2] = {corner[2] - corner[0], corner[3] - corner[1]}, b[2] = {corner[4] - corner[0], corner[5] - corner[1]};
    const double det = a[0] * b[1] - a[1] * b[0];
    if (!(fabs(det) > NORMALMAP_LEAST_TURN * sqrt((a[0] * a[0] + a[1] * a[1]) * (b[0] * b[0] + b[1] * b[1])))) return 0;
    for (int i = 0; i < 3; i++) {
        const double e1 = v[3 + i] - v[i], e2 = v[6 + i] - v[i];
        along_u[i] = (b[1] * e1 - a[1] * e2) / det;
        along_v[i] = (a[0] * e2 - b[0] * e1) / det;
    }
    return 1;
}

// Makes unit vectors x and y of these, for N; 0 where u grows along N alone.
HOT int normalmap_upright(const double *n, double *x, double *y) {
    const double off = dot_double(x, n), whole = dot_double(x, x), along_v[3] = {y[0], y[1], y[2]};
    for (int i = 0; i < 3; i++) x[i] -= off * n[i];
    const double square = dot_double(x, x);
    if (!(square > NORMALMAP_LEAST_TURN * whole)) return 0;
    for (int i = 0; i < 3; i++) x[i] /= sqrt(square);
    cross_double(n, x, y);
    if (dot_double(y, along_v) < 0)
        for (int i = 0; i < 3; i++) y[i] = -y[i];
    return 1;
}

static __attribute__((noinline)) void normalmap_lanes(const Geometry *geometry, global const Material *materials, global const Texture *textures,
                                                      global const uchar *texels, global const real *texel_values,
                                                      global const double *corner_uvs, const lane_int *found, const lane_int *slot,
                                                      const lane_int *material, const real *where, real *normal) {
    for (int k = 0; k < LANES; k++) {
        const int map = materials[material[k]].normal_map;
        if (!found[k] || map < 0) continue;
        double point[3], n[3], x[3], y[3], uv[2] = {0, 0};
        int framed = 0;
        for (int a = 0; a < 3; a++) {
            point[a] = where[a * LANES + k];
            n[a] = normal[a * LANES + k];
        }
        if (slot[k] < geometry->slot_count && normalmap_moves(geometry, corner_uvs, (int)slot[k], x, y)) {
            //@ normalmap_moved
            framed = normalmap_upright(n, x, y);
        }
        //@ normalmap_frame
        if (!framed) continue;
        //@ texture_point
        texture_coordinates(geometry, corner_uvs, (int)slot[k], point, uv);
        real color[3];
        texture_color(textures + map, texels, texel_values, uv[0], uv[1], color);
        const double strength = materials[material[k]].normal_strength;
        const double to_x = strength * (2.0 * color[0] - 1.0), to_y = strength * (2.0 * color[1] - 1.0), to_n = 2.0 * color[2] - 1.0;
        const double length = sqrt(to_x * to_x + to_y * to_y + to_n * to_n);
        if (!(length > 0)) continue;
        for (int a = 0; a < 3; a++) normal[a * LANES + k] = (real)((to_x * x[a] + to_y * y[a] + to_n * n[a]) / length);
    }
}

HOT void normalmap_tilt(const Geometry *geometry, global const Material *materials, global const Texture *textures, global const uchar *texels,
                        global const real *texel_values, global const double *corner_uvs, const Rays *rays, Hit *hit) {
    Geometry seen = *geometry;
    lane_int found[LANES], slot[LANES], material[LANES];
    real where[3 * LANES], normal[3 * LANES];
    texture_places(geometry, rays, hit, found, slot, material, where);
    for (int a = 0; a < 3; a++) store_lanes(hit->normal[a], normal + a * LANES);
    //@ normalmap_where
    normalmap_lanes(&seen, materials, textures, texels, texel_values, corner_uvs, found, slot, material, where, normal);
    for (int a = 0; a < 3; a++) hit->normal[a] = load_lanes(normal + a * LANES);
    face_towards(hit->normal, hit->geometric, 0);
}

//@hook arrived
        normalmap_tilt(&geometry, materials, textures, texels, texel_values, corner_uvs, &rays, &hit);
//@end
