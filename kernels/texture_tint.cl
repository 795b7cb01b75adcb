// Provides: texture_tints: the colours of pictures at the hits.
// Needs: texture.cl, hit.cl, structs.  Reads: nothing.

// What the pictures multiply the materials' colours by; 1 where there is none. `where` holds the points, three times LANES.
static __attribute__((noinline)) void texture_lanes(const Geometry *geometry, global const Material *materials, global const Texture *textures,
                                                    global const uchar *texels, global const real *texel_values,
                                                    global const double *corner_uvs, const lane_int *found, const lane_int *slot,
                                                    const lane_int *material, const real *where, real *tint) {
    for (int k = 0; k < LANES; k++) {
        const int texture = materials[material[k]].texture;
        for (int a = 0; a < 3; a++) tint[a * LANES + k] = R(1.0);
        if (!found[k] || texture < 0) continue;
        double point[3], uv[2] = {0, 0};
        for (int a = 0; a < 3; a++) point[a] = where[a * LANES + k];
        //@ texture_point
        texture_coordinates(geometry, corner_uvs, (int)slot[k], point, uv);
        real color[3];
        texture_color(textures + texture, texels, texel_values, uv[0], uv[1], color);
        for (int a = 0; a < 3; a++) tint[a * LANES + k] = color[a];
    }
}

HOT void texture_tints(const Geometry *geometry, global const Material *materials, global const Texture *textures, global const uchar *texels,
                       global const real *texel_values, global const double *corner_uvs, const Rays *rays, const Hit *hit, real_n *tint) {
    // Copies go to the function: what it is given by pointer could not stay in registers here.
    const Geometry seen = *geometry;
    lane_int found[LANES], slot[LANES], material[LANES];
    real where[3 * LANES], color[3 * LANES];
    texture_places(geometry, rays, hit, found, slot, material, where);
    texture_lanes(&seen, materials, textures, texels, texel_values, corner_uvs, found, slot, material, where, color);
    for (int a = 0; a < 3; a++) tint[a] = load_lanes(color + a * LANES);
}

//@hook light
        real_n tint[3];
        texture_tints(&geometry, materials, textures, texels, texel_values, corner_uvs, &rays, &hit, tint);
//@end
//@hook albedo
            albedo *= tint[a];
//@end
