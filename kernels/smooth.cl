// Provides: smooth_normals: the shading normal interpolated between the corners of a triangle; smooth_lift: where rays from a light end.
// Needs: hit.cl, geometry.cl.  Reads: nothing.

// Barycentric weights are ratios of areas seen along the normal, n.(e x (p - v0)) / n.(e1 x e2); weights outside [0, 1] by rounding are clamped.
// A triangle is curved unless all corners have the face's own normal, to the bit.
HOT void smooth_normals(const Geometry *geometry, Hit *hit) {
    real p[3][LANES], smooth[3][LANES], weight[2][LANES];
    lane_int curved[LANES];
    for (int a = 0; a < 3; a++) {
        store_lanes(hit->point[a], p[a]);
        store_lanes(hit->normal[a], smooth[a]);
    }
    for (int k = 0; k < LANES; k++) {
        curved[k] = weight[0][k] = weight[1][k] = 0;
        if (hit->slot[k] >= geometry->slot_count) continue;
        global const Triangle *t = geometry->triangles + hit->slot[k];
        global const real *corner = geometry->corner_normals + 9 * hit->slot[k];
        for (int i = 0; i < 9; i++)
            if (corner[i] != smooth[i % 3][k]) curved[k] = -1;
        real at[3];
        for (int a = 0; a < 3; a++) at[a] = p[a][k] - t->v0[a];
        real u = 0, v = 0;
        for (int a = 0; a < 3; a++) {
            const int b = (a + 1) % 3, c = (a + 2) % 3;
            u += t->normal[a] * (at[b] * t->e2[c] - at[c] * t->e2[b]);
            v += t->normal[a] * (t->e1[b] * at[c] - t->e1[c] * at[b]);
        }
        weight[0][k] = u = clamp(u / t->area, R(0.0), R(1.0));
        weight[1][k] = v = clamp(v / t->area, R(0.0), R(1.0) - u);
        for (int a = 0; a < 3; a++) smooth[a][k] = (R(1.0) - u - v) * corner[a] + u * corner[3 + a] + v * corner[6 + a];
    }
    hit->weight[1] = load_lanes(weight[0]);
    hit->weight[2] = load_lanes(weight[1]);
    hit->weight[0] = R(1.0) - hit->weight[1] - hit->weight[2];
    hit->curved = hit->found & load_lanes(curved);
    // Flat faces keep the normal as it is given: to interpolate would round it.
    real_n mixed[3] = {load_lanes(smooth[0]), load_lanes(smooth[1]), load_lanes(smooth[2])};
    normalize_n(mixed);
    for (int a = 0; a < 3; a++) hit->normal[a] = choose(hit->curved, mixed[a], hit->normal[a]);
}

// Hanika (Ray Tracing Gems II, 2021, chapter 4): the hit point is projected onto each corner's tangent plane where it lies below it,
// and the three are mixed by the weights. The corners' normals n are turned as the shading normal was. Never below the face.
// A sum of three products of three factors, off by at most 6u of their lengths.
HOT void smooth_lift(const Geometry *geometry, Hit *hit) {
    for (int a = 0; a < 3; a++) hit->lift[a] = (real_n)0;
    if (!any_lane(hit->curved)) return;
    lane_int slot[LANES];
    for (int k = 0; k < LANES; k++) slot[k] = hit->slot[k] < geometry->slot_count ? hit->slot[k] : 0;
    real_n at[3], n[3][3], depth[3], mixed[3] = {(real_n)0, (real_n)0, (real_n)0};
    for (int a = 0; a < 3; a++) {
        gather(at[a], geometry->triangles[slot[k]].v0[a]);
        at[a] = hit->point[a] - at[a];
    }
    for (int i = 0; i < 3; i++) {
        real_n from[3];
        for (int a = 0; a < 3; a++) {
            real_n edge = (real_n)0;
            if (i == 1) gather(edge, geometry->triangles[slot[k]].e1[a]);
            if (i == 2) gather(edge, geometry->triangles[slot[k]].e2[a]);
            from[a] = at[a] - edge;
            gather(n[i][a], geometry->corner_normals[9 * slot[k] + 3 * i + a]);
            mixed[a] += hit->weight[i] * n[i][a];
        }
        depth[i] = -dot_n(from, n[i]);
    }
    const mask_n turned = is_less(dot_n(mixed, hit->normal), (real_n)0);
    for (int i = 0; i < 3; i++) {
        const real_n below = choose(turned, min_n(depth[i], (real_n)0), max_n(depth[i], (real_n)0));
        for (int a = 0; a < 3; a++) hit->lift[a] += hit->weight[i] * below * n[i][a];
    }
    const real_n sunk = min_n(dot_n(hit->lift, hit->geometric), (real_n)0);
    for (int a = 0; a < 3; a++) hit->lift[a] = choose(hit->curved, hit->lift[a] - sunk * hit->geometric[a], (real_n)0);
}

//@hook prepare_triangle
    triangles[slot].area = (real)(scale * dot_double(normal, normal));
//@end
//@hook geometry_members
    global const real *corner_normals;   // 9 a slot
//@end
//@hook begin
    geometry.corner_normals = corner_normals;
//@end
//@hook hit_members
    mask_n curved;        // on a triangle whose corners' normals are not all the face's own
    real_n weight[3];     // of the corners
    real_n lift[3];       // from `point` to the curved surface that the triangle stands for
//@end
//@hook hit_surface
    smooth_normals(geometry, hit);
//@end
//@hook hit_faced
    smooth_lift(geometry, hit);
//@end
//@hook light_above
        // The curved surface faces the light where its normal does. Where the face does not, the face itself may stand between.
        above |= hit->curved;
//@end
//@hook shadow_end
        end[a] += hit->lift[a];
        offset += abs_n(hit->lift[a]);
//@end
//@hook shadow_skip
    rays.skip |= hit->curved & is_at_least(dot_n(hit->geometric, rays.direction), (real_n)0);
//@end
//@hook reach_start
    for (int a = 0; a < 3; a++) {
        start[a] += hit->lift[a];
        error += (R(8.0) * UNIT_ROUNDOFF) * abs_n(hit->lift[a]);
    }
    own |= hit->curved & is_at_most(dot_n(hit->geometric, to_light), (real_n)0);
//@end
//@hook planar
    // Not so a ray to a lifted point, nor one that comes from behind the plane: there the triangle itself may stand between.
    planar &= is_less(dot_n(hit->geometric, span), (real_n)0);
    for (int a = 0; a < 3; a++) planar &= is_equal(end[a], hit->point[a]);
//@end
//@hook planar_end
    planar &= is_at_least(rays.skip, NO_LANES);
//@end
