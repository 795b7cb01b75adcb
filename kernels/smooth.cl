// Provides: smooth_normals: the shading normal interpolated between the corners of a triangle.
// Needs: hit.cl, geometry.cl.  Reads: nothing.

// Barycentric weights are ratios of areas seen along the normal, n.(e x (p - v0)) / n.n; weights outside [0, 1] by rounding are clamped.
static inline void smooth_normals(const Geometry *geometry, Hit *hit) {
    real p[3][LANES], smooth[3][LANES];
    for (int a = 0; a < 3; a++) {
        store_lanes(hit->point[a], p[a]);
        store_lanes(hit->normal[a], smooth[a]);
    }
    for (int k = 0; k < LANES; k++) {
        if (hit->slot[k] >= geometry->slot_count) continue;
        global const Triangle *t = geometry->triangles + hit->slot[k];
        global const real *corner = geometry->corner_normals + 9 * hit->slot[k];
        real at[3];
        for (int a = 0; a < 3; a++) at[a] = p[a][k] - t->v0[a];
        real u = 0, v = 0, area = 0;
        for (int a = 0; a < 3; a++) {
            const int b = (a + 1) % 3, c = (a + 2) % 3;
            u += t->normal[a] * (at[b] * t->e2[c] - at[c] * t->e2[b]);
            v += t->normal[a] * (t->e1[b] * at[c] - t->e1[c] * at[b]);
            area += t->normal[a] * t->normal[a];
        }
        u = clamp(u / area, R(0.0), R(1.0));
        v = clamp(v / area, R(0.0), R(1.0) - u);
        for (int a = 0; a < 3; a++) smooth[a][k] = (R(1.0) - u - v) * corner[a] + u * corner[3 + a] + v * corner[6 + a];
    }
    for (int a = 0; a < 3; a++) hit->normal[a] = load_lanes(smooth[a]);
    normalize_n(hit->normal);
}

//@hook geometry_members
    global const real *corner_normals;   // 9 a slot
//@end
//@hook begin
    geometry.corner_normals = corner_normals;
//@end
//@hook hit_surface
    smooth_normals(geometry, hit);
//@end
