// Provides: kernel render: one packet of pixels a work-item, or a group of packets (group.cl), from the camera's rays to linear colour.
// Needs: camera.cl, scene.cl, hit.cl and what the effects add.  Reads: PACKET_WIDTH, PACKET_HEIGHT, ITEM_WIDTH, ITEM_HEIGHT (pixels of a work-item).

// What rays from the eye can meet; effects add their own members at `begin`.
HOT Geometry scene_geometry(global const Frame *frame, global const int2 *nodes, global const int *indices, global const Triangle *triangles,
                            global const EdgePlanes *eye_planes, global const double *vertices, global const Object *objects,
                            global const Surface *surfaces) {
    Geometry geometry;
    geometry.nodes = nodes;
    geometry.indices = indices;
    geometry.triangles = triangles;
    geometry.planes = eye_planes;
    geometry.vertices = vertices;
    geometry.surfaces = surfaces;
    geometry.objects = objects;
    geometry.object_count = frame->object_count;
    geometry.slot_count = frame->triangle_slots;
    for (int a = 0; a < 3; a++) {
        geometry.shared_origin[a] = frame->eye[a];
        geometry.local_origin[a] = frame->local_origin[a];
    }
    return geometry;
}

#if REAL_BITS == 64
#define film_row(numbers, y) convert_float4(vload4(y, numbers))
#else
#define film_row(numbers, y) vload4(y, numbers)
#endif

// A packet's colours into the picture, rows of pixels [row, end_row).
HOT void film_store(real out[3][LANES], int column, int row, int width, int end_row, global float *film) {
#if PACKET_WIDTH == 4
    // Inside it, four pixels at once: loads and stores of single numbers would take as long as the rest of the shading.
    if (column + PACKET_WIDTH <= width && row + PACKET_HEIGHT <= end_row) {
        #pragma unroll
        for (int y = 0; y < PACKET_HEIGHT; y++) {
            const float4 r = film_row(out[0], y), g = film_row(out[1], y), b = film_row(out[2], y);
            global float *pixels = film + 3 * ((size_t)(row + y) * width + column);
            vstore4((float4)(r.x, g.x, b.x, r.y), 0, pixels);
            vstore4((float4)(g.y, b.y, r.z, g.z), 1, pixels);
            vstore4((float4)(b.z, r.w, g.w, b.w), 2, pixels);
        }
        return;
    }
#endif
    for (int k = 0; k < LANES; k++) {
        const int x = column + k % PACKET_WIDTH, y = row + k / PACKET_WIDTH;
        if (x >= width || y >= end_row) continue;
        for (int a = 0; a < 3; a++) film[3 * ((size_t)y * width + x) + a] = (float)out[a][k];
    }
}

// Asks for the pixels of a work-item, on the cores that will write them: what a store waits for else is most of its time.
HOT void film_ahead(int column, int row, int width, int end_row, global const float *film) {
    for (int y = row; y < min(row + ITEM_HEIGHT, end_row); y++) {
        global const float *pixels = film + 3 * ((size_t)y * width + column);
        for (int i = 0; i < 3 * ITEM_WIDTH; i += 16) fetch_to_write(pixels + i);
    }
}

// One packet, apart from the kernel: PoCL makes three copies of a kernel's body, and one of this.
static __attribute__((noinline)) void
render_packet(const int column, const int row, global const Frame *frame, global const int2 *nodes, global const int *indices,
                   global const Triangle *triangles, global const EdgePlanes *eye_planes, global const double *vertices, global const Object *objects,
                   global const Surface *surfaces, global const Material *materials, int end_row, global float *film
                   //@ parameters
                   //@ packet_parameters
                   //@ group_parameters
) {
    Geometry geometry = scene_geometry(frame, nodes, indices, triangles, eye_planes, vertices, objects, surfaces);
    //@ begin
    Rays rays;
    //@ eye_rays
    //@ drawn
    real_n color[3] = {(real_n)0, (real_n)0, (real_n)0}, weight = (real_n)1;
    //@ primary
    for (;;) {
        Hits hits;
        hits.t = (real_n)INFINITY;
        hits.slot = (mask_n)-1;
        //@ hits_begin
        //@ trace
        Hit hit;
        //@ surface
        //@ arrived
        // The light that leaves the hit points towards the viewer, without what other rays bring.
        Shade shade;
        real_n ambient;
        gather_same(hit.one_material, ambient, materials[hit.material[k]].ambient);
        //@ shade_begin
        #pragma unroll
        for (int a = 0; a < 3; a++) shade.sum[a] = ambient;
        //@ light
        #pragma unroll
        for (int a = 0; a < 3; a++) {
            real_n albedo;
            gather_same(hit.one_material, albedo, materials[hit.material[k]].color[a]);
            //@ albedo
            real_n seen = choose(hit.found, albedo * shade.sum[a], (real_n)frame->background[a]);
            //@ channel
            color[a] += choose(rays.active, weight * seen, (real_n)0);
        }
        //@ spawn
        //@ next
    }
    real out[3][LANES];
    #pragma unroll
    for (int a = 0; a < 3; a++) store_lanes(color[a], out[a]);
    //@ film
    //@ end
}

//@ group
#define STRIP 16

// The hint keeps a compiler's own vectoriser (Intel's) off lanes that are vectors already: it would take seconds, for slower code.
kernel __attribute__((vec_type_hint(real_n)))
void render(global const Frame *frame, global const int2 *nodes, global const int *indices, global const Triangle *triangles,
            global const EdgePlanes *eye_planes, global const double *vertices, global const Object *objects,
            global const Surface *surfaces, global const Material *materials, int first_row, int end_row, global float *film
            //@ parameters
) {
    // Groups are taken column by column in strips of STRIP groups: what comes soon after is near, and finds the same triangles in the caches.
    const int across = get_num_groups(0), group = get_group_id(1) * across + get_group_id(0), strip = group / (across * STRIP);
    const int high = min(STRIP, (int)get_num_groups(1) - strip * STRIP), place = group - strip * across * STRIP;
    const int group_x = place / high, group_y = strip * STRIP + place % high;
    int column = (group_x * get_local_size(0) + get_local_id(0)) * ITEM_WIDTH;
    int row = first_row + (group_y * get_local_size(1) + get_local_id(1)) * ITEM_HEIGHT;
    //@ packet
    if (column >= frame->width || row >= end_row) return;
    //@ repeat
    //@ launch
}
