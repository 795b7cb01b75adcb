// Provides: glow_map: what pictures leave of what their surfaces send out. Only rays that meet them find that light: samples of lights do not know it.
// Needs: arealight.cl, texture.cl, hit.cl, structs.  Reads: nothing.

// `glow`, red, green and blue of LANES each, times the picture; in `mapped`, which lanes have one. `where` holds the points, three times LANES.
static __attribute__((noinline)) void glow_map(const Geometry *geometry, global const Material *materials, global const Texture *textures,
                                               global const uchar *texels, global const real *texel_values, global const double *corner_uvs,
                                               const lane_int *found, const lane_int *slot, const lane_int *material, const real *where,
                                               real *glow, lane_int *mapped) {
    for (int k = 0; k < LANES; k++) {
        const int texture = found[k] ? materials[material[k]].emission_map : -1;
        mapped[k] = texture < 0 ? 0 : -1;
        if (texture < 0) continue;
        double point[3], uv[2] = {0, 0};
        for (int a = 0; a < 3; a++) point[a] = where[a * LANES + k];
        //@ texture_point
        texture_coordinates(geometry, corner_uvs, (int)slot[k], point, uv);
        real color[3];
        texture_color(textures + texture, texels, texel_values, uv[0], uv[1], color);
        for (int a = 0; a < 3; a++) glow[a * LANES + k] *= color[a];
    }
}

//@hook arealight_glow
            lane_int glow_mapped[LANES];
            {
                const Geometry seen_geometry = geometry;
                lane_int map_found[LANES], map_slot[LANES], map_material[LANES];
                real map_where[3 * LANES], mapped_glow[3 * LANES];
                texture_places(&geometry, &rays, &hit, map_found, map_slot, map_material, map_where);
                for (int a = 0; a < 3; a++) store_lanes(glow[a], mapped_glow + a * LANES);
                glow_map(&seen_geometry, materials, textures, texels, texel_values, corner_uvs, map_found, map_slot, map_material, map_where,
                         mapped_glow, glow_mapped);
                for (int a = 0; a < 3; a++) glow[a] = load_lanes(mapped_glow + a * LANES);
            }
//@end
//@hook arealight_found
                share = choose(load_lanes(glow_mapped), (real_n)1, share);
//@end
