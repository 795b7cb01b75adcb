// Provides: which suns shine on what the eye sees of a group: group_suns; rays of one direction go together.
// Needs: group.cl, sun_visible.cl, sun.cl.  Reads: GROUP, BOXES, SUN_SHARED.
//
// Rays towards a sun, D, are told apart by where they cross a plane across it: by s = p.A and t = p.B of their starts p, with A, B, D at right
// angles. Seen along D a triangle's box in s and t bounds what rays meet it, and a ray leaves behind what ends before it starts, by z = p.D.
// So records of boxes are as those of directions (directions.cl), of places in units of half the scene's size from its middle, and picked
// triangles are tested by their planes along it (sun_visible.cl). Places of triangles are computed in float64 with the axes as they were rounded; those of rays
// are off by the rounding of p - m, of products and sums, below 8u (|p| + |m|) in each axis, and by D.A, D.B, which are below 2^-23, over the
// way from p to the triangles: 2^-20 (|p| + |m|) holds both, with u = 2^-24 or less; and the way on through them is a hundredth of a step.
#define PREPARE_PLACES 4

typedef struct {
    float middle[3], steps;
    float axes[3][3];  // A, B, D
} PlaceFrame;

static __attribute__((noinline)) void prepare_places(global const double *vertices, global const int2 *blocks, int item, global const PlaceFrame *frame,
                                                     const double *local_origin, global DirectionBoxes *records) {
    const int block = item / BOXES, k = item % BOXES;
    if (item == 0) *(global PlaceFrame *)records = *frame;
    global DirectionBoxes *box = records + 1 + block;
    const int slot = k < blocks[block].y ? blocks[block].x + k : -1;
    for (int axis = 0; axis < 3; axis++) {
        double lo = INFINITY, hi = -INFINITY;
        for (int c = 0; c < 3 && slot >= 0; c++) {
            double place = 0;
            for (int a = 0; a < 3; a++)
                place += (vertices[9 * (size_t)slot + 3 * c + a] - local_origin[a] - frame->middle[a]) * frame->axes[axis][a];
            lo = fmin(lo, place * frame->steps);
            hi = fmax(hi, place * frame->steps);
        }
        // A step wider, and clamped as what they are compared with is.
        box->lo[axis][k] = slot < 0 ? SHRT_MAX : (short)(int)floor(fmin(fmax(lo, -32600.0), 32000.0) - 1);
        box->hi[axis][k] = slot < 0 ? SHRT_MIN : (short)(int)ceil(fmax(fmin(hi, 32600.0), -32000.0) + 1);
    }
    box->near[k] = slot < 0 ? INFINITY : 0;
    box->item[k] = slot;
}

// Bounds of where rays start, in units of what `steps` are 32000 of; without end along the sun's direction.
HOT void least_places(global const PlaceFrame *frame, const Rays *rays, real *lo, real *minus_hi) {
    const real unit = (real)frame->steps / R(32000.0);
    real_n from_middle[3], size = (real_n)0;
    for (int a = 0; a < 3; a++) {
        from_middle[a] = rays->origin[a] - (real_n)frame->middle[a];
        size += abs_n(rays->origin[a]) + abs_n((real_n)frame->middle[a]);
    }
    for (int axis = 0; axis < 3; axis++) {
        real_n place = (real_n)0;
        for (int a = 0; a < 3; a++) place += from_middle[a] * (real_n)frame->axes[axis][a];
        lo[axis] = least_lane(choose(rays->active, (place - R(0x1p-20) * size) * unit, (real_n)INFINITY));
        minus_hi[axis] = least_lane(choose(rays->active, (-place - R(0x1p-20) * size) * unit, (real_n)INFINITY));
    }
    minus_hi[2] = R(-2.0);
}

HOT void places_in_steps(const Spread *of, Directions *all) {
    for (int a = 0; a < 3; a++) {
        const int some = of->lo[a] < (real)INFINITY;
        all->lo[a] = some ? (short)(direction_step(of->lo[a], (real)0, R(32000.0)) - 2) : (short)SHRT_MAX;
        all->hi[a] = some ? (short)(direction_step(-of->minus_hi[a], (real)0, R(32000.0)) + 2) : (short)SHRT_MIN;
    }
}

// As group_trace, for rays of one direction; `geometry->boxes` are places as seen along it.
static __attribute__((noinline)) void sun_trace(const Geometry *geometry, const Rays *rays, Hits *hits) {
    global const PlaceFrame *frame = (global const PlaceFrame *)geometry->boxes;
    Spread of[GROUP];
    for (int p = 0; p < GROUP; p++) least_places(frame, rays + p, of[p].lo, of[p].minus_hi);
    for (int begin = 0, count = 1; begin < GROUP; begin += count) {
        Group group;
        Spread all;
        count = group_size(of, begin, 2, &all);
        if (!group_lives(rays + begin, count)) continue;
        if (geometry->box_count == 0 || spread_size(&all, 2) > SPREAD) {
            for (int p = begin; p < begin + count; p++) scene_trace(geometry, rays + p, SUN_SHARED, 1, hits + p);
            continue;
        }
        group_begin(&group, rays + begin, hits + begin, count);
        for (int p = 0; p < count; p++) places_in_steps(of + begin + p, group.packet + p);
        places_in_steps(&all, &group.all);
        group_walk(geometry, &group, SUN_SHARED, 1);
        for (int p = 0; p < count; p++) scene_rest(geometry, group.rays + p, group.active[p], SUN_SHARED, 1, group.hits + p);
    }
}

HOT void group_suns(const Geometry *geometry, global const Sun *suns, int sun_count, const Rays *eye_rays, const Hit *hits, real extent,
                    LightsSeen *seen) {
    for (int p = 0; p < GROUP; p++) seen[p].known = seen[p].clear = NO_LANES;
    for (int i = 0; i < sun_count && i < LIGHTS_SEEN; i++) {
        const mask_n bit = (mask_n)((lane_int)1 << i);
        real_n to_light[3];
        for (int a = 0; a < 3; a++) to_light[a] = (real_n)suns[i].direction[a];
        Rays rays[GROUP];
        Hits met[GROUP];
        mask_n some = NO_LANES;
        for (int p = 0; p < GROUP; p++) {
            const Hit *hit = hits + p;
            mask_n above = is_greater(dot_n(hit->geometric, to_light), (real_n)0);
            //@ light_above
            const mask_n lit = hit->found & above & is_greater(dot_n(hit->normal, to_light), (real_n)0);
            reach_rays(geometry, eye_rays + p, hit, to_light, 0, to_light, (real_n)0, 1, extent, lit, rays + p, met + p);
            seen[p].known |= lit & bit;
            some |= lit;
        }
        if (!any_lane(some)) continue;
        const Geometry along = sun_geometry(geometry, i);
        sun_trace(&along, rays, met);
        for (int p = 0; p < GROUP; p++) seen[p].clear |= is_less(met[p].slot, NO_LANES) & bit;
    }
}

//@hook geometry_members
    global const DirectionBoxes *sun_boxes;  // box_count a sun
    const LightsSeen *suns_seen;             // of the hits that the eye sees; or 0
//@end
//@hook parameters
                   , global const DirectionBoxes *sun_boxes
//@end
//@hook arguments
                  , sun_boxes
//@end
//@hook begin
    geometry.sun_boxes = sun_boxes;
    geometry.suns_seen = 0;
//@end
//@hook sun_geometry
    along.boxes = geometry->sun_boxes + (size_t)index * geometry->box_count;
//@end
//@hook prepare_parameters
                    , global const float *place_frame, double4 local_origin
//@end
//@hook prepare
    const double relative_to[3] = {local_origin.x, local_origin.y, local_origin.z};
    if (what == PREPARE_PLACES) prepare_places(vertices, blocks, item, (global const PlaceFrame *)place_frame, relative_to, records + first);
//@end
//@hook group_seen
    LightsSeen suns_seen[GROUP];
    group_suns(&geometry, suns, frame->sun_count, eye_rays, eye_hit, frame->extent, suns_seen);
//@end
//@hook seen_parameters
                   , const LightsSeen *suns_seen
//@end
//@hook seen_arguments
                      , suns_seen + p
//@end
//@hook surface_seen
        geometry.suns_seen = from_group ? suns_seen : 0;
//@end
//@hook sun_known
        const mask_n known = lights_known(geometry->suns_seen, i, &lit, &clear);
        //@counting count_rays(geometry->counters, COUNT_SHADOW, known);
//@end
