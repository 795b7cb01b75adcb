// Provides: kernel cast (arrays of rays: first, any, all hits or their number).
// Needs: scene.cl, triangle.cl, structs.  Reads: nothing.
//
// A GivenRay comes as the caller gave it. Its direction is scaled in place by a power of two, without rounding, that brings its largest
// component into [1, 2), and its limits with it, so that no length over- or underflows; `scale` keeps that power for cast_finish.
// Lanes use the direction at unit length and the origin relative to the local origin, rounded to `real`: both within the errors that
// triangle.cl and box.cl allow for.
#define FIRST_HIT 0
#define ANY_HIT 1
#define COUNT_HITS 2
#define LIST_HITS 3

// False for a ray that is known to miss: a NaN, an infinity, no direction, an empty interval.
HOT int ray_scaled(global GivenRay *ray) {
    double largest = 0, size;
    int good = ray->t_min < ray->t_max;
    for (int a = 0; a < 3; a++) {
        size = fabs(ray->direction[a]);
        good &= size < INFINITY && fabs(ray->origin[a]) < INFINITY;
        largest = size > largest ? size : largest;
    }
    if (!good || largest == 0) return 0;
    // The exponent from its bits; both powers stay in range, and below 2^-1022 the largest component stays below 1.
    const long biased = (long)(as_ulong(largest) >> 52), exponent = (biased < 1 ? 1 : biased > 2045 ? 2045 : biased) - 1023;
    const double inverse = as_double((ulong)(1023 + exponent) << 52);
    ray->scale = as_double((ulong)(1023 - exponent) << 52);
    for (int a = 0; a < 3; a++) ray->direction[a] *= ray->scale;
    ray->t_min *= inverse;
    ray->t_max *= inverse;
    return 1;
}

// result: the slot of the hit or -1 a ray; for COUNT_HITS the number of hits; for LIST_HITS, given, where the ray's hits begin in `list`,
// which gets (slot, ray) for each, in the order of t and id.
// The hint keeps a compiler's own vectoriser (Intel's) off lanes that are vectors already: it would take seconds, for slower code.
kernel __attribute__((vec_type_hint(real_n)))
void cast(global const WideNode *wide, global const Block *blocks, global const Triangle *triangles, global const double *vertices,
          global const Object *objects, global const Surface *surfaces, int object_count, int slot_count, double4 local_origin,
          real extent, global GivenRay *given, global int *result, global int2 *list, int count, int mode
          //@ parameters
) {
    const int first = get_global_id(0) * LANES;
    if (first >= count) return;
    Geometry geometry;
    geometry.nodes = 0;
    geometry.indices = 0;
    geometry.wide = wide;
    geometry.blocks = blocks;
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
    real from[3][LANES], along[3][LANES], low[LANES], high[LANES];
    lane_int active[LANES], slot[LANES];
    int hit_count[LANES];
    for (int k = 0; k < LANES; k++) {
        global GivenRay *ray = given + first + k;
        const int good = first + k < count && ray_scaled(ray);
        const double length = good ? sqrt(ray->direction[0] * ray->direction[0] + ray->direction[1] * ray->direction[1] +
                                          ray->direction[2] * ray->direction[2]) : 1.0;
        for (int a = 0; a < 3; a++) {
            from[a][k] = good ? (real)(ray->origin[a] - geometry.local_origin[a]) : R(0.0);
            along[a][k] = good ? (real)(ray->direction[a] / length) : R(1.0);
        }
        low[k] = good ? (real)(ray->t_min * length) : R(0.0);
        high[k] = good ? (real)(ray->t_max * length) : R(0.0);
        low[k] -= fabs(low[k]) * (R(2.0) * UNIT_ROUNDOFF);
        high[k] += fabs(high[k]) * (R(2.0) * UNIT_ROUNDOFF);
        active[k] = good ? -1 : 0;
        hit_count[k] = 0;
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
    rays_prepare(&rays, extent);
    // To count or list, one hit is sought after the other, in the order of t and id, until no lane has a further one.
    for (int round = 0; round <= slot_count; round++) {
        hits.t = rays.t_max;
        hits.slot = (mask_n)-1;
        //@ hits_begin
        if (any_lane(rays.active)) scene_trace(&geometry, &rays, 0, mode == ANY_HIT, &hits);
        hits.slot = choose(rays.active, hits.slot, (mask_n)-1);
        store_lanes(hits.slot, slot);
        if (mode < COUNT_HITS) break;
        rays.active = is_at_least(hits.slot, NO_LANES);
        if (!any_lane(rays.active)) break;
        rays.after = hits.slot;
        rays.after_t = hits.t;
        for (int k = 0; k < LANES; k++) {
            if (slot[k] < 0) continue;
            if (mode == LIST_HITS) list[result[first + k] + hit_count[k]] = (int2)((int)slot[k], first + k);
            hit_count[k]++;
        }
    }
    if (mode == LIST_HITS) return;
    for (int k = 0; k < LANES && first + k < count; k++) result[first + k] = mode == COUNT_HITS ? hit_count[k] : (int)slot[k];
}

//@hook rays_members
    global const GivenRay *given;  // lane 0 is number `first`
    int first;
//@end
//@hook ray_given
    global const GivenRay *ray = rays->given + rays->first + lane;
    for (int a = 0; a < 3; a++) {
        origin[a] = ray->origin[a];
        direction[a] = ray->direction[a];
    }
    *t_min = ray->t_min;
    *t_max = ray->t_max;
    return;
//@end
//@hook ray_length
    global const double *d = (rays->given + rays->first + lane)->direction;
    return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
//@end
