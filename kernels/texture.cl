// Provides: texture_color: the colour of a picture at its coordinates; texture_coordinates: those of a point on a primitive; texture_places: of hits.
// Needs: geometry.cl, hit.cl, structs.  Reads: nothing.
//
// Coordinates are computed in float64 from the given corners and the hit point, which is off by its own error alone: a coordinate repeated a
// thousand times keeps its digits. Colours are decoded before they are mixed.
#define TEXTURE_CLAMP 1
#define TEXTURE_TURN 2

// A coordinate brought to [0, 1], where every second copy is turned round [0, 2], so that texel numbers stay small.
HOT double texture_reduced(double u, const int wrap) {
    if (wrap == TEXTURE_CLAMP) return u < 0 ? 0 : u > 1 ? 1 : u;
    if (wrap == TEXTURE_TURN) return u - 2 * floor(u / 2);
    return u - floor(u);
}

// The texel for number i, at most one beyond where a reduced coordinate leads.
HOT int texture_wrapped(int i, const int size, const int wrap) {
    if (wrap == TEXTURE_CLAMP) return i < 0 ? 0 : i >= size ? size - 1 : i;
    if (wrap == TEXTURE_TURN) {
        i = i < 0 ? -1 - i : i >= 2 * size ? i - 2 * size : i;
        return i >= size ? 2 * size - 1 - i : i;
    }
    return i < 0 ? i + size : i >= size ? i - size : i;
}

HOT real texture_value(global const Texture *texture, global const uchar *texels, global const real *texel_values, int x, int y, int channel) {
    const long code = 4 * ((long)y * texture->width + x) + channel;
    global const uchar *from = texels + texture->first;
    return texel_values[texture->values + (texture->code_bytes == 1 ? from[code] : ((global const ushort *)from)[code])];
}

// The texels around (u, v), columns first, and how far the point lies towards the second ones; v = 0 is the lower edge, row 0 the upper one.
HOT void texture_around(global const Texture *texture, double u, double v, int *first, int *second, real *part) {
    const double at[2] = {texture_reduced(u, texture->wrap) * texture->width, texture_reduced(1 - v, texture->wrap) * texture->height};
    const int size[2] = {texture->width, texture->height};
    for (int a = 0; a < 2; a++) {
        const double place = texture->linear ? at[a] - 0.5 : at[a], low = floor(place);
        first[a] = texture_wrapped((int)low, size[a], texture->wrap);
        second[a] = texture_wrapped((int)low + 1, size[a], texture->wrap);
        part[a] = texture->linear ? (real)(place - low) : R(0.0);
    }
}

// The picture's colour at (u, v).
HOT void texture_color(global const Texture *texture, global const uchar *texels, global const real *texel_values, double u, double v, real *color) {
    int first[2], second[2];
    real part[2];
    texture_around(texture, u, v, first, second, part);
    for (int channel = 0; channel < 3; channel++) {
        const real upper = (R(1.0) - part[0]) * texture_value(texture, texels, texel_values, first[0], first[1], channel) +
                           part[0] * texture_value(texture, texels, texel_values, second[0], first[1], channel);
        const real lower = (R(1.0) - part[0]) * texture_value(texture, texels, texel_values, first[0], second[1], channel) +
                           part[0] * texture_value(texture, texels, texel_values, second[0], second[1], channel);
        color[channel] = (R(1.0) - part[1]) * upper + part[1] * lower;
    }
}

// The coordinates at a point of triangle `slot`, relative to the local origin: the corners', weighted by areas seen along the normal.
HOT void texture_on_triangle(const Geometry *geometry, global const double *corner_uvs, int slot, const double *point, double *uv) {
    global const double *v = geometry->vertices + 9 * (size_t)slot, *corner = corner_uvs + 6 * (size_t)slot;
    double e1[3], e2[3], at[3], normal[3], cross[3];
    for (int a = 0; a < 3; a++) {
        e1[a] = v[3 + a] - v[a];
        e2[a] = v[6 + a] - v[a];
        at[a] = point[a] + (geometry->local_origin[a] - v[a]);
    }
    cross_double(e1, e2, normal);
    const double area = dot_double(normal, normal);
    cross_double(at, e2, cross);
    const double second = dot_double(cross, normal) / area;
    cross_double(e1, at, cross);
    const double third = dot_double(cross, normal) / area;
    for (int i = 0; i < 2; i++) uv[i] = corner[i] + second * (corner[2 + i] - corner[i]) + third * (corner[4 + i] - corner[i]);
}

// The same at a point of any primitive.
HOT void texture_coordinates(const Geometry *geometry, global const double *corner_uvs, int slot, const double *point, double *uv) {
    if (slot < geometry->slot_count) texture_on_triangle(geometry, corner_uvs, slot, point, uv);
    //@ texture_place
}

// What lanes ask pictures by: which hits there are, their slots and materials, LANES of each; their points, three times LANES.
HOT void texture_places(const Geometry *geometry, const Rays *rays, const Hit *hit, lane_int *found, lane_int *slot, lane_int *material,
                        real *where) {
    store_lanes(hit->found, found);
    for (int k = 0; k < LANES; k++) {
        slot[k] = hit->slot[k];
        material[k] = hit->material[k];
    }
    for (int a = 0; a < 3; a++) store_lanes(hit->point[a], where + a * LANES);
    //@ texture_where
}
