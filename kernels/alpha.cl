// Provides: alpha_at: the alpha of a picture at its coordinates, which multiplies opacity.
// Needs: texture.cl, structs.  Reads: nothing.

HOT real alpha_texel(global const Texture *texture, global const uchar *texels, int x, int y) {
    const long code = 4 * ((long)y * texture->width + x) + 3;
    global const uchar *from = texels + texture->first;
    return texture->code_bytes == 1 ? (real)from[code] / R(255.0) : (real)((global const ushort *)from)[code] / R(65535.0);
}

// Alpha is never encoded: it is mixed as it is. Below `cutoff`, if that is not 0, it is a hole, else none.
HOT real alpha_at(global const Texture *texture, global const uchar *texels, double u, double v, real cutoff) {
    int first[2], second[2];
    real part[2];
    texture_around(texture, u, v, first, second, part);
    const real upper = (R(1.0) - part[0]) * alpha_texel(texture, texels, first[0], first[1]) +
                       part[0] * alpha_texel(texture, texels, second[0], first[1]);
    const real lower = (R(1.0) - part[0]) * alpha_texel(texture, texels, first[0], second[1]) +
                       part[0] * alpha_texel(texture, texels, second[0], second[1]);
    const real alpha = (R(1.0) - part[1]) * upper + part[1] * lower;
    return cutoff > R(0.0) ? (alpha < cutoff ? R(0.0) : R(1.0)) : alpha;
}

//@hook geometry_members
    global const Texture *textures;
    global const uchar *texels;
    global const double *corner_uvs;
//@end
//@hook begin
    geometry.textures = textures;
    geometry.texels = texels;
    geometry.corner_uvs = corner_uvs;
//@end
//@hook opaque_picture
        if (material->alpha_texture >= 0) {
            double point[3], uv[2] = {0, 0};
            for (int a = 0; a < 3; a++) point[a] = where[a * LANES + k];
            //@ texture_point
            texture_coordinates(geometry, geometry->corner_uvs, (int)slot[k], point, uv);
            kept[k] *= alpha_at(geometry->textures + material->alpha_texture, geometry->texels, uv[0], uv[1], material->alpha_cutoff);
        }
//@end
