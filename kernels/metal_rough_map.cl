// Provides: metal_map: roughness (green) and metallic (blue) of pictures at the hits.
// Needs: metal_rough.cl, texture.cl, hit.cl, structs.  Reads: nothing.

// Multiplies `metallic` and `roughness`, LANES each, by what the pictures have there. `where` holds the points, three times LANES.
static __attribute__((noinline)) void metal_map(const Geometry *geometry, global const Material *materials, global const Texture *textures,
                                                global const uchar *texels, global const real *texel_values, global const double *corner_uvs,
                                                const lane_int *found, const lane_int *slot, const lane_int *material, const real *where,
                                                real *metallic, real *roughness) {
    for (int k = 0; k < LANES; k++) {
        const int texture = materials[material[k]].metal_rough_map;
        if (!found[k] || texture < 0) continue;
        double point[3], uv[2] = {0, 0};
        for (int a = 0; a < 3; a++) point[a] = where[a * LANES + k];
        //@ texture_point
        texture_coordinates(geometry, corner_uvs, (int)slot[k], point, uv);
        real color[3];
        texture_color(textures + texture, texels, texel_values, uv[0], uv[1], color);
        roughness[k] *= color[1];
        metallic[k] *= color[2];
    }
}

//@hook metal_maps
            const Geometry seen_geometry = geometry;
            lane_int map_found[LANES], map_slot[LANES], map_material[LANES];
            real map_where[3 * LANES], mapped_metallic[LANES], mapped_roughness[LANES];
            texture_places(&geometry, &rays, &hit, map_found, map_slot, map_material, map_where);
            store_lanes(metallic, mapped_metallic);
            store_lanes(roughness, mapped_roughness);
            metal_map(&seen_geometry, materials, textures, texels, texel_values, corner_uvs, map_found, map_slot, map_material, map_where,
                      mapped_metallic, mapped_roughness);
            metallic = load_lanes(mapped_metallic);
            roughness = load_lanes(mapped_roughness);
//@end
