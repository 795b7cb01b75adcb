// Provides: sphere_trace, sphere_surface.
// Needs: rays.cl, hit.cl, geometry.cl, structs.  Reads: nothing.
//
// Roots of |f + t d| = r with f = origin - centre, after Haines, Guenther and Akenine-Moeller (Ray Tracing Gems 2019, chapter 7):
// the discriminant from the point nearest the centre, r^2 - |f - (f.d) d|^2, keeps its digits at any distance; the roots as
// q = -(b + sign(b) sqrt(disc)) and c / q lose none where b^2 is near the discriminant.

// Where that is not enough, a lane is decided in float64, from the numbers before they were rounded: with L the distance of the
// origin from the centre,
//   the discriminant is off by less than 2 r 3uL + ... < 16u r L near a tangent, so its sign is unsure within that;
//   a root is off by some u L, so one of less than L / 16 has lost digits (a floor of radius 1e6 under an eye at height 1: all but two).
static __attribute__((noinline)) mask_n sphere_double(global const Sphere *sphere, const Rays *rays, mask_n unsure, real_n *t) {
    lane_int lane[LANES];
    real o[3][LANES], d[3][LANES], t_min[LANES], root[LANES];
    store_lanes(unsure, lane);
    store_lanes(rays->t_min, t_min);
    store_lanes(*t, root);
    for (int a = 0; a < 3; a++) {
        store_lanes(rays->origin[a], o[a]);
        store_lanes(rays->direction[a], d[a]);
    }
    const double radius = sphere->given[3];
    for (int k = 0; k < LANES; k++) {
        if (!lane[k]) continue;
        double f[3], nearest[3], a = 0, b = 0, rest = 0, length = 0;
        for (int i = 0; i < 3; i++) {
            f[i] = o[i][k] - sphere->given[i];
            a += (double)d[i][k] * d[i][k];
            b -= f[i] * d[i][k];
            length += f[i] * f[i];
        }
        for (int i = 0; i < 3; i++) nearest[i] = f[i] + b / a * d[i][k], rest += nearest[i] * nearest[i];
        length = sqrt(length);
        const double square = (radius * radius - rest) * a, q = b + (b < 0 ? -sqrt(square) : sqrt(square));
        const double first = (length - radius) * (length + radius) / q, second = q / a;
        const double low = fmin(first, second), high = fmax(first, second);
        lane[k] = square >= 0 ? -1 : 0;
        root[k] = (real)(low > t_min[k] ? low : high);
    }
    *t = load_lanes(root);
    return load_lanes(lane);
}

// Sphere k of the scene has the slot slot_count + k. A ray that starts on a sphere meets that one at its second root only
// (t = -2 f.d, inwards). A ray that ends on it (any_hit) leaves out the root at its end, and may meet the other: the far wall,
// where the end is seen from inside.
HOT void sphere_trace(const Geometry *geometry, const Rays *rays, const int any_hit, Hits *hits) {
    //@ sphere_begin
    for (int i = 0; i < geometry->sphere_count; i++) {
        global const Sphere *sphere = geometry->spheres + i;
        const mask_n own = is_equal(rays->skip, (mask_n)(geometry->slot_count + i));
        real_n f[3], nearest[3];
        for (int a = 0; a < 3; a++) f[a] = rays->origin[a] - sphere->center[a];
        const real_n b = -dot_n(f, rays->direction);
        for (int a = 0; a < 3; a++) nearest[a] = multiply_add(rays->direction[a], b, f[a]);
        const real_n discriminant = sphere->radius * sphere->radius - dot_n(nearest, nearest);
        // A ray that starts on the sphere meets it whatever the rounding of its discriminant says.
        mask_n meets = rays->active & (is_at_least(discriminant, (real_n)0) | (any_hit ? NO_LANES : own));
        //@ sphere_meets
        const real_n length = sqrt(dot_n(f, f)), tangent = (R(16.0) * UNIT_ROUNDOFF) * sphere->radius * length;
        mask_n unsure = rays->active & ~own & is_at_most(abs_n(discriminant), tangent);
        if (!any_lane(meets | unsure)) continue;
        const real_n root = sqrt(max_n(discriminant, (real_n)0));
        const real_n product = (length - sphere->radius) * (length + sphere->radius);
        const real_n q = b + choose(is_less(b, (real_n)0), -root, root);
        const real_n first = min_n(product / q, q), second = max_n(product / q, q);
        real_n t = choose(is_greater(first, rays->t_min), first, second);
        unsure |= meets & ~own & is_at_most(min_n(abs_n(first), abs_n(second)), R(0.0625) * length);
        if (REAL_BITS == 32 && any_lane(unsure)) meets = (meets & ~unsure) | sphere_double(sphere, rays, unsure, &t);
        if (any_hit) t = choose(own, choose(is_less(abs_n(first - hits->t), abs_n(second - hits->t)), second, first), t);
        else t = choose(own, R(2.0) * b, t);
        //@ sphere_root
        const mask_n hit = meets & is_greater(t, rays->t_min) & is_less(t, hits->t);
        hits->t = choose(hit, t, hits->t);
        hits->slot = choose(hit, (mask_n)(geometry->slot_count + i), hits->slot);
    }
}

// Overwrites what hit_surface found for the lanes that hit a sphere: the point is put back onto the sphere along its radius, in
// float64 and rounded once: off by u |P| a coordinate, as much again for the offset of a ray that goes on, and `rest` for the float64.
HOT void sphere_surface(const Geometry *geometry, Hit *hit) {
    const mask_n round = hit->found & is_at_least(load_lanes(hit->slot), (mask_n)geometry->slot_count);
    if (!any_lane(round)) return;
    global const Sphere *spheres = geometry->spheres;
    lane_int which[LANES];
    real point[3][LANES], normal[3][LANES], rest[LANES];
    for (int a = 0; a < 3; a++) store_lanes(hit->point[a], point[a]);
    for (int k = 0; k < LANES; k++) {
        which[k] = hit->slot[k] < geometry->slot_count ? 0 : hit->slot[k] - geometry->slot_count;
        global const double *given = spheres[which[k]].given;
        double out[3], square = 0;
        for (int a = 0; a < 3; a++) {
            out[a] = point[a][k] - given[a];
            square += out[a] * out[a];
        }
        const double scale = 1 / sqrt(square);
        rest[k] = (real)(0x1p-49 * (fabs(given[0]) + fabs(given[1]) + fabs(given[2]) + given[3]));
        for (int a = 0; a < 3; a++) {
            normal[a][k] = (real)(out[a] * scale);
            point[a][k] = (real)(given[a] + out[a] * (scale * given[3]));
        }
    }
    real_n size = (real_n)0;
    for (int a = 0; a < 3; a++) {
        const real_n n = load_lanes(normal[a]);
        hit->point[a] = choose(round, load_lanes(point[a]), hit->point[a]);
        hit->geometric[a] = choose(round, n, hit->geometric[a]);
        hit->normal[a] = choose(round, n, hit->normal[a]);
        size += abs_n(hit->point[a]);
    }
    hit->error = choose(round, (R(4.0) * UNIT_ROUNDOFF) * size + load_lanes(rest), hit->error);
    for (int k = 0; k < LANES; k++)
        if (hit->slot[k] >= geometry->slot_count) hit->material[k] = spheres[which[k]].material;
}

//@hook geometry_members
    global const Sphere *spheres;        // a slot each, after the triangles'
    int sphere_count;
//@end
//@hook begin
    geometry.spheres = spheres;
    geometry.sphere_count = frame->sphere_count;
//@end
//@hook tree_leaf
    if (place >= geometry->tree_solids) {
        // The one sphere, as if there were no other.
        Geometry one = *geometry;
        one.spheres += place - geometry->tree_solids;
        one.slot_count += place - geometry->tree_solids;
        one.sphere_count = 1;
        sphere_trace(&one, rays, any_hit, hits);
        return;
    }
//@end
//@hook scene_trace
    sphere_trace(geometry, rays, any_hit, hits);
//@end
//@hook hit_surface
    sphere_surface(geometry, hit);
//@end
//@hook hit_flat
    flat &= is_less(hits->slot, (mask_n)geometry->slot_count);
//@end
//@hook planar
    planar &= is_less(load_lanes(hit->slot), (mask_n)geometry->slot_count);
//@end
