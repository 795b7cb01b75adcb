// Provides: kernels cast (arrays of rays: first, any, all hits or their number) and cast_list (the records of all hits).
// Needs: bundle.cl, given.cl, hit_record.cl, structs.  Reads: RUN (rays a work-item).
//
// A ray is traced with its direction at unit length and its origin relative to the local origin, rounded to `real`: both within the errors
// that triangle.cl and box.cl allow for.
#define FIRST_HIT 0
#define ANY_HIT 1
#define COUNT_HITS 2
#define LIST_HITS 3

// What is traced of a ray; one that is known to miss gets an empty interval.
HOT void ray_begin(const GivenRay *ray, int good, const Geometry *geometry, real extent, Rays *rays) {
    const double *d = ray->direction;
    const double length = good ? sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) : 1.0;
    for (int a = 0; a < 3; a++) {
        rays->origin[a] = good ? (real)(ray->origin[a] - geometry->local_origin[a]) : R(0.0);
        rays->direction[a] = good ? (real)(d[a] / length) : R(1.0);
    }
    const real low = good ? (real)(ray->t_min * length) : R(0.0), high = good ? (real)(ray->t_max * length) : R(0.0);
    rays->t_min = low - abs_n(low) * (R(2.0) * UNIT_ROUNDOFF);
    rays->t_max = high + abs_n(high) * (R(2.0) * UNIT_ROUNDOFF);
    rays->skip = -1;
    rays->active = good ? -1 : 0;
    rays->given = ray;
    rays_prepare(rays, extent);
}

// A ray through every object of the mesh, one tree after the other.
HOT void scene_trace(const Geometry *geometry, const Rays *rays, const int any_hit, Hits *hits) {
    for (int b = 0; b < geometry->object_count; b++) {
        blocks_trace(geometry, geometry->objects + b, geometry->objects[b].root, rays, 0, any_hit, hits);
        if (any_hit && hits->slot >= 0) return;
    }
}

// The first hit of a ray that is traced alone, or any; to count or list, how many there are: one is sought after the other, in the order of t
// and id, until there is no further one.
HOT int ray_trace(const Geometry *geometry, Rays *ray, int number, int mode, global const int *begin, global int2 *list, Hits *first) {
    int found = 0;
    while (found <= geometry->slot_count) {
        Hits hits = *first;
        scene_trace(geometry, ray, mode == ANY_HIT, &hits);
        if (mode < COUNT_HITS) *first = hits;
        if (mode < COUNT_HITS || hits.slot < 0) break;
        if (mode == LIST_HITS) list[begin[number] + found] = (int2)(hits.slot, number);
        found++;
        ray->after = hits.slot;
        ray->after_t = hits.t;
    }
    return found;
}

// Rays [0, count) of the given arrays, in the order `order` where there is one. By number: for FIRST_HIT the records of hits; else, in `result`,
// for ANY_HIT the slot of a hit or -1, for COUNT_HITS the number of hits; for LIST_HITS it has where the ray's hits begin in `list`,
// which gets (slot, ray) for each, in the order of t and id.
// The hint keeps a compiler's own vectoriser (Intel's) off lanes that are vectors already: it would take seconds, for slower code.
kernel __attribute__((vec_type_hint(real_n)))
void cast(global const WideNode *wide, global const Block *blocks, global const Triangle *triangles, global const double *vertices,
          global const Object *objects, global const Surface *surfaces, global const HitSource *sources, int object_count, int slot_count,
          double4 local_origin, real extent, GIVEN_PARAMETERS, global const int *order, global HitRecord *records, global int *result,
          global int2 *list, int count, int mode
          //@ parameters
) {
    const int first = RUN * get_global_id(0), end = min(count, first + RUN);
    if (first >= count) return;
    const GivenRays given = GIVEN_ARGUMENTS;
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
    // Loop by loop, as memory that one ray waits for is then asked for while others are at work.
    GivenRay run[RUN];
    Rays rays[RUN];
    Hits found[RUN];
    int tally[RUN];
    for (int i = first; i < end; i++) {
        const int good = ray_given_scaled(&given, order ? order[i] : i, run + i - first);
        ray_begin(run + i - first, good, &geometry, extent, rays + i - first);
    }
    for (int i = first; i < end; i++) {
        if (order && i + RUN < count) ray_given_ahead(&given, order[i + RUN]);
        if (mode == FIRST_HIT) fetch_bytes_ahead(records + (order ? order[i] : i), sizeof(HitRecord), 1);
        Hits hits;
        hits.t = rays[i - first].t_max;
        hits.slot = -1;
        //@ hits_begin
        found[i - first] = hits;
        tally[i - first] = 0;
    }
    const int bundle = mode < COUNT_HITS && bundle_coherent(rays, end - first, extent);
    if (bundle) bundle_trace(&geometry, rays, end - first, mode == ANY_HIT, found);
    for (int i = first; !bundle && i < end; i++) {
        if (!rays[i - first].active) continue;
        tally[i - first] = ray_trace(&geometry, rays + i - first, order ? order[i] : i, mode, result, list, found + i - first);
    }
    for (int i = 0; mode == FIRST_HIT && i < end - first; i++) {
        if (found[i].slot < 0) continue;
        fetch_bytes_ahead(vertices + 9 * (size_t)found[i].slot, 9 * sizeof(double), 0);
        fetch_bytes_ahead(sources + found[i].slot, sizeof(HitSource), 0);
    }
    for (int i = first; i < end; i++) {
        const int number = order ? order[i] : i;
        if (mode == FIRST_HIT) hit_record(vertices, sources, run + i - first, found[i - first].slot, records + number);
        else if (mode == ANY_HIT) result[number] = (int)found[i - first].slot;
        else if (mode == COUNT_HITS) result[number] = tally[i - first];
    }
}

// The records of the `count` hits in `list`.
kernel void cast_list(global const double *vertices, global const HitSource *sources, GIVEN_PARAMETERS, global const int2 *list,
                      global HitRecord *records, int count) {
    const int i = get_global_id(0);
    if (i >= count) return;
    const GivenRays given = GIVEN_ARGUMENTS;
    GivenRay ray;
    ray_given_scaled(&given, list[i].y, &ray);
    hit_record(vertices, sources, &ray, list[i].x, records + i);
}

//@hook rays_members
    const GivenRay *given;
//@end
//@hook ray_given
    for (int a = 0; a < 3; a++) {
        origin[a] = rays->given->origin[a];
        direction[a] = rays->given->direction[a];
    }
    *t_min = rays->given->t_min;
    *t_max = rays->given->t_max;
    return;
//@end
//@hook ray_length
    const double *d = rays->given->direction;
    return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
//@end
//@hook exact_start
    // `ray_begin` has widened the interval.
    t_min = multiply_add(abs_n(t_min), (real_n)(R(8.0) * UNIT_ROUNDOFF), t_min);
//@end
//@hook exact_end
        hits.low *= hits.t < 0 ? R(1.0) + R(8.0) * UNIT_ROUNDOFF : R(1.0) - R(8.0) * UNIT_ROUNDOFF;
//@end
