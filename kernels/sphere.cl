// Provides: sphere_trace, sphere_surface.
// Needs: rays.cl, hit.cl, geometry.cl, structs.  Reads: nothing.
//
// Roots of |f + t d| = r with f = origin - centre, after Haines, Guenther and Akenine-Moeller (Ray Tracing Gems 2019, chapter 7):
// the discriminant from the point nearest the centre, r^2 - |f - (f.d) d|^2, keeps its digits at any distance; the roots as
// q = -(b + sign(b) sqrt(disc)) and c / q lose none where b^2 is near the discriminant.

// Sphere k of the scene has the slot slot_count + k. A ray that starts on a sphere meets that one at its second root only
// (t = -2 f.d, inwards). A ray that ends on it (any_hit) leaves out the root at its end, and may meet the other: the far wall,
// where the end is seen from inside.
HOT void sphere_trace(const Geometry *geometry, const Rays *rays, const int any_hit, Hits *hits) {
    for (int i = 0; i < geometry->sphere_count; i++) {
        global const Sphere *sphere = geometry->spheres + i;
        const mask_n own = is_equal(rays->skip, (mask_n)(geometry->slot_count + i));
        real_n f[3], nearest[3];
        for (int a = 0; a < 3; a++) f[a] = rays->origin[a] - sphere->center[a];
        const real_n b = -dot_n(f, rays->direction);
        for (int a = 0; a < 3; a++) nearest[a] = multiply_add(rays->direction[a], b, f[a]);
        const real_n discriminant = sphere->radius * sphere->radius - dot_n(nearest, nearest);
        // A ray that starts on the sphere meets it whatever the rounding of its discriminant says.
        const mask_n meets = rays->active & (is_at_least(discriminant, (real_n)0) | (any_hit ? NO_LANES : own));
        if (!any_lane(meets)) continue;
        const real_n root = sqrt(max_n(discriminant, (real_n)0)), length = sqrt(dot_n(f, f));
        const real_n product = (length - sphere->radius) * (length + sphere->radius);
        const real_n q = b + choose(is_less(b, (real_n)0), -root, root);
        const real_n first = min_n(product / q, q), second = max_n(product / q, q);
        real_n t = choose(is_greater(first, rays->t_min), first, second);
        if (any_hit) t = choose(own, choose(is_less(abs_n(first - hits->t), abs_n(second - hits->t)), second, first), t);
        else t = choose(own, R(2.0) * b, t);
        const mask_n hit = meets & is_greater(t, rays->t_min) & is_less(t, hits->t);
        hits->t = choose(hit, t, hits->t);
        hits->slot = choose(hit, (mask_n)(geometry->slot_count + i), hits->slot);
    }
}

// Overwrites what hit_surface found for the lanes that hit a sphere: the point is put back onto the sphere along
// its radius, where its error is that of the rounded centre and radius.
HOT void sphere_surface(const Geometry *geometry, Hit *hit) {
    mask_n round = hit->found & is_at_least(load_lanes(hit->slot), (mask_n)geometry->slot_count);
    if (!any_lane(round)) return;
    global const Sphere *spheres = geometry->spheres;
    lane_int which[LANES];
    for (int k = 0; k < LANES; k++) which[k] = hit->slot[k] < geometry->slot_count ? 0 : hit->slot[k] - geometry->slot_count;
    real_n center[3], normal[3], radius;
    gather(radius, spheres[which[k]].radius);
    for (int a = 0; a < 3; a++) {
        gather(center[a], spheres[which[k]].center[a]);
        normal[a] = hit->point[a] - center[a];
    }
    normalize_n(normal);
    for (int a = 0; a < 3; a++) {
        hit->point[a] = choose(round, multiply_add(normal[a], radius, center[a]), hit->point[a]);
        hit->geometric[a] = choose(round, normal[a], hit->geometric[a]);
        hit->normal[a] = choose(round, normal[a], hit->normal[a]);
    }
    const real_n far = abs_n(center[0]) + abs_n(center[1]) + abs_n(center[2]) + radius;
    hit->error = choose(round, (R(16.0) * UNIT_ROUNDOFF) * far, hit->error);
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
//@hook scene_trace
    sphere_trace(geometry, rays, any_hit, hits);
//@end
//@hook hit_surface
    sphere_surface(geometry, hit);
//@end
