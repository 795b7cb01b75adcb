// Provides: render_group: GROUP packets of pixels, whose rays from the eye go together; LightsSeen, lights_known: what shines on their hits.
// Needs: render.cl, group_trace.cl.  Reads: GROUP (at most 16, whole rows of 4), LIGHTS_SEEN (at most 31), PACKET_WIDTH, PACKET_HEIGHT.

//@hook group
// Where a packet is in its group, in Morton order: packets in a row are near each other.
#define GROUP_X(p) (((p) & 1) | (((p) >> 1) & 2))
#define GROUP_Y(p) ((((p) >> 1) & 1) | (((p) >> 2) & 2))

// The packets of one work-item: what the eye sees of them all, then one by one what comes of it.
static __attribute__((noinline)) void
render_group(const int group_column, const int group_row, global const Frame *frame, global const int2 *nodes, global const int *indices,
             global const Triangle *triangles, global const EdgePlanes *eye_planes, global const double *vertices, global const Object *objects,
             global const Surface *surfaces, global const Material *materials, int end_row, global float *film
             //@ parameters
             //@ packet_parameters
) {
    Geometry geometry = scene_geometry(frame, nodes, indices, triangles, eye_planes, vertices, objects, surfaces);
    //@ begin
    //@ film_ahead
    Rays eye_rays[GROUP];
    Hits eye_hits[GROUP];
    for (int p = 0; p < GROUP; p++) {
        const int column = group_column + GROUP_X(p) * PACKET_WIDTH, row = group_row + GROUP_Y(p) * PACKET_HEIGHT;
        Rays rays;
        //@ camera
        eye_rays[p] = rays;
        Hits hits;
        hits.t = (real_n)INFINITY;
        hits.slot = (mask_n)-1;
        //@ hits_begin
        eye_hits[p] = hits;
    }
    group_trace(&geometry, eye_rays, 0, eye_hits);
    //@ group_seen
    for (int p = 0; p < GROUP; p++) {
        const int column = group_column + GROUP_X(p) * PACKET_WIDTH, row = group_row + GROUP_Y(p) * PACKET_HEIGHT;
        if (column >= frame->width || row >= end_row) continue;
        render_packet(column, row, frame, nodes, indices, triangles, eye_planes, vertices, objects, surfaces, materials, end_row, film
                      //@ arguments
                      //@ packet_arguments
                      , eye_rays + p, eye_hits + p
                      //@ seen_arguments
        );
    }
}

//@end
//@hook group_parameters
                   , const Rays *eye_rays, const Hits *eye_hits
                   //@ seen_parameters
//@end
//@hook eye_rays
    rays = *eye_rays;
//@end
//@hook eye_trace
        hits = *eye_hits;
//@end
//@hook launch
    render_group(column, row, frame, nodes, indices, triangles, eye_planes, vertices, objects, surfaces, materials, end_row, film
                 //@ arguments
                 //@ packet_arguments
    );
//@end
//@hook geometry_types
// Which lights shine on the hits of a packet, a bit a light.

typedef struct {
    mask_n known, clear;  // bit i: light i was asked for, and nothing is between
} LightsSeen;

// Takes the lanes out of `lit` of which it is known whether light i shines on them, and gives them; `clear`: those that it does. `seen` may be 0.
HOT mask_n lights_known(const LightsSeen *seen, int i, mask_n *lit, mask_n *clear) {
    if (!seen || i >= LIGHTS_SEEN) return NO_LANES;
    const mask_n bit = (mask_n)((lane_int)1 << i), known = *lit & ~is_equal(seen->known & bit, NO_LANES);
    *clear = known & ~is_equal(seen->clear & bit, NO_LANES);
    *lit &= ~known;
    return known;
}
//@end
