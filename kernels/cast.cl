// Provides: kernels cast (arrays of rays: first, any, or next hit) and cast_finish (t, u, v of the hits).
// Needs: scene.cl, triangle.cl.  Reads: nothing.
//
// A ray is 8 doubles: origin, direction, t_min, t_max, as the caller gave them. Lanes use its direction scaled to unit length and
// its origin relative to the local origin, rounded to `real`: both within the errors that triangle.cl and box.cl allow for.

// The hint keeps a compiler's own vectoriser (Intel's) off lanes that are vectors already: it would take seconds, for slower code.
kernel __attribute__((vec_type_hint(real_n)))
void cast(global const int2 *nodes, global const int *indices, global const Triangle *triangles, global const double *vertices,
          global const Object *objects, global const Surface *surfaces, int object_count, int slot_count, double4 local_origin,
          real extent, global const double *given, int count, int any_hit, global int *last, global real *last_t
          //@ parameters
) {
    const int first = get_global_id(0) * LANES;
    if (first >= count) return;
    Geometry geometry;
    geometry.nodes = nodes;
    geometry.indices = indices;
    geometry.triangles = triangles;
    geometry.planes = 0;
    geometry.vertices = vertices;
    geometry.surfaces = surfaces;
    geometry.objects = objects;
    geometry.object_count = object_count;
    geometry.slot_count = slot_count;
    geometry.local_origin[0] = local_origin.x;
    geometry.local_origin[1] = local_origin.y;
    geometry.local_origin[2] = local_origin.z;
    //@ begin
    Rays rays;
    Hits hits;
    real from[3][LANES], along[3][LANES], low[LANES], high[LANES], after_t[LANES];
    lane_int active[LANES], after[LANES];
    for (int k = 0; k < LANES; k++) {
        const int i = min(first + k, count - 1);
        global const double *ray = given + 8 * (size_t)i;
        double largest = 0, length = 0;
        int finite = 1;
        for (int a = 0; a < 3; a++) {
            finite &= fabs(ray[a]) < INFINITY && fabs(ray[3 + a]) < INFINITY;
            largest = fmax(largest, fabs(ray[3 + a]));
        }
        // Scaled by a power of two first, so that no direction over- or underflows.
        const int exponent = finite && largest > 0 ? ilogb(largest) : 0;
        for (int a = 0; a < 3; a++) length += ldexp(ray[3 + a], -exponent) * ldexp(ray[3 + a], -exponent);
        length = ldexp(sqrt(length), exponent);
        // A miss that is known: no direction, an empty or unordered interval. A next hit is sought only after a last one.
        finite &= largest > 0 && ray[6] < ray[7] && first + k < count && last[i] > -2;
        active[k] = finite ? -1 : 0;
        for (int a = 0; a < 3; a++) {
            from[a][k] = finite ? (real)(ray[a] - geometry.local_origin[a]) : R(0.0);
            along[a][k] = finite ? (real)(ldexp(ray[3 + a], -exponent) / ldexp(length, -exponent)) : R(1.0);
        }
        low[k] = finite ? (real)(ray[6] * length) : R(0.0);
        high[k] = finite ? (real)(ray[7] * length) : R(0.0);
        low[k] -= fabs(low[k]) * (R(2.0) * UNIT_ROUNDOFF);
        high[k] += fabs(high[k]) * (R(2.0) * UNIT_ROUNDOFF);
        after[k] = last[i];
        after_t[k] = last_t[i];
    }
    for (int a = 0; a < 3; a++) {
        rays.origin[a] = load_lanes(from[a]);
        rays.direction[a] = load_lanes(along[a]);
    }
    rays.t_min = load_lanes(low);
    rays.t_max = load_lanes(high);
    rays.skip = (mask_n)-1;
    rays.active = load_lanes(active);
    rays.given = given;
    rays.first = first;
    rays.after = load_lanes(after);
    rays.after_t = load_lanes(after_t);
    rays_prepare(&rays, extent);
    hits.t = rays.t_max;
    hits.slot = (mask_n)-1;
    //@ hits_begin
    scene_trace(&geometry, &rays, 0, any_hit, &hits);
    lane_int slot[LANES];
    real t[LANES];
    store_lanes(choose(rays.active, hits.slot, (mask_n)-1), slot);
    store_lanes(hits.t, t);
    for (int k = 0; k < LANES && first + k < count; k++) {
        last[first + k] = slot[k] < 0 ? -2 : (int)slot[k];
        last_t[first + k] = t[k];
    }
}

// t, u, v of each hit by the numbers as given, in float64: (t, u, v, unused) a ray.
kernel void cast_finish(global const double *vertices, global const double *given, int count, global const int *last, global double *result) {
    const int i = get_global_id(0);
    if (i >= count) return;
    global double *out = result + 4 * (size_t)i;
    out[0] = INFINITY;
    out[1] = out[2] = out[3] = 0;
    if (last[i] < 0) return;
    global const double *ray = given + 8 * (size_t)i, *v = vertices + 9 * (size_t)last[i];
    double corner[3][3], e1[3], e2[3], normal[3], edge[3], n[3];
    const double direction[3] = {ray[3], ray[4], ray[5]};
    for (int a = 0; a < 3; a++) {
        for (int c = 0; c < 3; c++) corner[c][a] = v[3 * c + a] - ray[a];
        e1[a] = v[3 + a] - v[a];
        e2[a] = v[6 + a] - v[a];
    }
    cross_double(e1, e2, normal);
    const double rate = dot_double(direction, normal);
    for (int c = 0; c < 3; c++) {
        cross_double(corner[(c + 1) % 3], corner[(c + 2) % 3], n);
        edge[c] = dot_double(direction, n);
    }
    out[0] = dot_double(corner[0], normal) / rate;
    out[1] = edge[1] / rate;
    out[2] = edge[2] / rate;
    //@ finish
}

//@hook rays_members
    global const double *given;   // 8 a ray, of which lane 0 is number `first`
    int first;
    mask_n after;                 // the slot of each ray's last hit: only hits after it, by t and primitive id, count; or -1
    real_n after_t;
//@end
//@hook ray_given
    global const double *ray = rays->given + 8 * (size_t)(rays->first + lane);
    for (int a = 0; a < 3; a++) {
        origin[a] = ray[a];
        direction[a] = ray[3 + a];
    }
    *t_min = ray[6];
    *t_max = ray[7];
    return;
//@end
//@hook ray_length
    global const double *d = rays->given + 8 * (size_t)(rays->first + lane) + 3;
    const int exponent = ilogb(fmax(fabs(d[0]), fmax(fabs(d[1]), fabs(d[2]))));
    const double x = ldexp(d[0], -exponent), y = ldexp(d[1], -exponent), z = ldexp(d[2], -exponent);
    return ldexp(sqrt(x * x + y * y + z * z), exponent);
//@end
//@hook accept
    if (any_lane(hit & is_at_least(rays->after, NO_LANES))) {
        lane_int last[LANES], later[LANES];
        store_lanes(rays->after, last);
        for (int k = 0; k < LANES; k++)
            later[k] = last[k] < 0 || geometry->surfaces[slot].prim > geometry->surfaces[last[k]].prim ? -1 : 0;
        hit &= is_less(rays->after, NO_LANES) | is_greater(t, rays->after_t) | (is_equal(t, rays->after_t) & load_lanes(later));
    }
//@end
//@hook accept_sure
    hit &= is_less(rays->after, NO_LANES) | is_greater(t - error, rays->after_t);
//@end
//@hook exact_accept
        lane_int last[LANES];
        store_lanes(rays->after, last);
        if (hit && last[k] >= 0) {
            const int order = exact_nearer(geometry, origin, direction, slot, &plane, last[k], &stage);
            hit = order > 0 || (order == 0 && geometry->surfaces[slot].prim > geometry->surfaces[last[k]].prim);
        }
//@end
