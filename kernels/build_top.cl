// Provides: build_roots, build_bins, build_sides, build_scatter: one level of the large nodes, each cut into chunks of references.
// Needs: build_clip.cl, build_split.cl.  Reads: MOST_BINS.
//
// References lie in two stores, as numbers and as six rows of bounds (lo x y z, hi x y z): the level's own, and the pool of nodes
// small enough for build_subtree.cl. A place is an offset in the next level's store, or, negative, ~offset in the pool.
enum { CHUNK_START, CHUNK_COUNT, CHUNK_NODE, CHUNK_WORDS };
enum { SPLIT_AXIS, SPLIT_FLATS_UP, SPLIT_WORDS };  // axis 3: all references go to the lower side
enum { CELL_LO, CELL_HI = 3, CELL_PLANE = 6, CELL_WORDS };
enum { GOES_BELOW = 1, GOES_ABOVE = 2, IS_CUT = 4 };

typedef struct {
    global int *ref;
    global float *bounds;
    size_t rows, at;
} Store;

static inline Store build_store(int place, global int *ref, global float *bounds, int rows, global int *pool_ref, global float *pool_bounds,
                                int pool_rows) {
    Store store;
    store.ref = place >= 0 ? ref : pool_ref;
    store.bounds = place >= 0 ? bounds : pool_bounds;
    store.rows = place >= 0 ? rows : pool_rows;
    store.at = place >= 0 ? place : ~place;
    return store;
}

// Appends a reference to a store and widens the bounds of all that went there.
static inline void build_append(Store *store, int ref, const float *lo, const float *hi, float *all_lo, float *all_hi) {
    store->ref[store->at] = ref;
    for (int a = 0; a < 3; a++) {
        store->bounds[a * store->rows + store->at] = lo[a];
        store->bounds[(3 + a) * store->rows + store->at] = hi[a];
        all_lo[a] = lo[a] < all_lo[a] ? lo[a] : all_lo[a];
        all_hi[a] = hi[a] > all_hi[a] ? hi[a] : all_hi[a];
    }
    store->at++;
}

// The triangles of a chunk as references. boxes: (chunks, 6) their bounds; exact: the same in float64.
kernel void build_roots(global const double *vertices, global const int *chunks, global const int *places, global int *ref,
                        global float *bounds, const int rows, global int *pool_ref, global float *pool_bounds, const int pool_rows,
                        global float *boxes, global double *exact) {
    const size_t chunk = get_global_id(0);
    Store store = build_store(places[chunk], ref, bounds, rows, pool_ref, pool_bounds, pool_rows);
    const int first = chunks[chunk * CHUNK_WORDS + CHUNK_START], end = first + chunks[chunk * CHUNK_WORDS + CHUNK_COUNT];
    double exact_lo[3] = {INFINITY, INFINITY, INFINITY}, exact_hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    float all_lo[3] = {INFINITY, INFINITY, INFINITY}, all_hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int i = first; i < end; i++) {
        global const double *corner = vertices + (size_t)i * 9;
        float lo[3], hi[3];
        for (int a = 0; a < 3; a++) {
            const double p = corner[a], q = corner[3 + a], r = corner[6 + a];
            const double low = fmin(fmin(p, q), r), high = fmax(fmax(p, q), r);
            exact_lo[a] = fmin(exact_lo[a], low);
            exact_hi[a] = fmax(exact_hi[a], high);
            lo[a] = build_round_down(low);
            hi[a] = build_round_up(high);
        }
        build_append(&store, i, lo, hi, all_lo, all_hi);
    }
    for (int a = 0; a < 3; a++) {
        boxes[chunk * 6 + a] = all_lo[a];
        boxes[chunk * 6 + 3 + a] = all_hi[a];
        exact[chunk * 6 + a] = exact_lo[a];
        exact[chunk * 6 + 3 + a] = exact_hi[a];
    }
}

// How many references of a chunk begin and end in each bin. scales: (nodes, 3, 3) base, factor of begins, factor of ends;
// counts: (chunks, 3, 2, MOST_BINS + 2).
kernel void build_bins(global const int *chunks, global const float *bounds, const int rows, global const float *scales,
                       global int *counts) {
    const size_t chunk = get_global_id(0);
    const size_t first = chunks[chunk * CHUNK_WORDS + CHUNK_START], end = first + chunks[chunk * CHUNK_WORDS + CHUNK_COUNT];
    global const float *scale = scales + 9 * (size_t)chunks[chunk * CHUNK_WORDS + CHUNK_NODE];
    for (int axis = 0; axis < 3; axis++) {
        int begins[MOST_BINS + 2], ends[MOST_BINS + 2];
        for (int k = 0; k < MOST_BINS + 2; k++) begins[k] = ends[k] = 0;
        global const float *lo = bounds + (size_t)axis * rows, *hi = bounds + (size_t)(3 + axis) * rows;
        const float base = scale[3 * axis], to_begin = scale[3 * axis + 1], to_end = scale[3 * axis + 2];
        for (size_t i = first; i < end; i++) {
            begins[1 + (int)((lo[i] - base) * to_begin)]++;
            ends[1 + (int)((hi[i] - base) * to_end)]++;
        }
        global int *to = counts + (chunk * 3 + axis) * 2 * (MOST_BINS + 2);
        for (int k = 0; k < MOST_BINS + 2; k++) {
            to[k] = begins[k];
            to[MOST_BINS + 2 + k] = ends[k];
        }
    }
}

// The two parts of a triangle that a split cuts, within the cells of the children. Returns which are left: GOES_BELOW | GOES_ABOVE.
static int build_parts(global const double *triangle, const float *cell, int axis, float plane, float part_lo[2][3], float part_hi[2][3]) {
    int left = 0;
    for (int side = 0; side < 2; side++) {
        float lo[3], hi[3];
        for (int a = 0; a < 3; a++) {
            lo[a] = side == 1 && a == axis ? plane : cell[CELL_LO + a];
            hi[a] = side == 0 && a == axis ? plane : cell[CELL_HI + a];
        }
        left |= build_clip(triangle, lo, hi, part_lo[side], part_hi[side]) ? GOES_BELOW << side : 0;
    }
    return left;
}

// Where each reference of a chunk goes: goes (references) bits; sizes (chunks, 2) how many below and above.
// splits: (nodes, SPLIT_WORDS); cells: (nodes, CELL_WORDS).
kernel void build_sides(global const double *vertices, global const int *chunks, global const int *ref, global const float *bounds,
                        const int rows, global const int *splits, global const float *cells, global uchar *goes, global int *sizes) {
    const size_t chunk = get_global_id(0);
    const size_t first = chunks[chunk * CHUNK_WORDS + CHUNK_START], end = first + chunks[chunk * CHUNK_WORDS + CHUNK_COUNT];
    const size_t node = chunks[chunk * CHUNK_WORDS + CHUNK_NODE];
    const int axis = splits[node * SPLIT_WORDS + SPLIT_AXIS];
    const int flat = splits[node * SPLIT_WORDS + SPLIT_FLATS_UP] ? GOES_ABOVE : GOES_BELOW;
    float cell[CELL_WORDS];
    for (int i = 0; i < CELL_WORDS; i++) cell[i] = cells[node * CELL_WORDS + i];
    const float plane = cell[CELL_PLANE];
    int below = 0, above = 0;
    for (size_t i = first; i < end; i++) {
        int sides = GOES_BELOW;
        if (axis < 3) {
            sides = (bounds[axis * (size_t)rows + i] < plane ? GOES_BELOW : 0);
            sides |= (bounds[(3 + axis) * (size_t)rows + i] > plane ? GOES_ABOVE : 0);
            if (sides == 0) sides = flat;
        }
        if (sides == (GOES_BELOW | GOES_ABOVE)) {
            float part_lo[2][3], part_hi[2][3];
            sides = IS_CUT | build_parts(vertices + (size_t)ref[i] * 9, cell, axis, plane, part_lo, part_hi);
        }
        goes[i] = (uchar)sides;
        below += (sides & GOES_BELOW) != 0;
        above += (sides & GOES_ABOVE) != 0;
    }
    sizes[2 * chunk] = below;
    sizes[2 * chunk + 1] = above;
}

// Moves the references of a chunk to their children, whose places per chunk are in `places`; boxes: (chunks, 2, 6) bounds of either.
kernel void build_scatter(global const double *vertices, global const int *chunks, global const int *ref, global const float *bounds,
                          const int rows, global const int *splits, global const float *cells, global const uchar *goes,
                          global const int *places, global int *next_ref, global float *next_bounds, const int next_rows,
                          global int *pool_ref, global float *pool_bounds, const int pool_rows, global float *boxes) {
    const size_t chunk = get_global_id(0);
    const size_t first = chunks[chunk * CHUNK_WORDS + CHUNK_START], end = first + chunks[chunk * CHUNK_WORDS + CHUNK_COUNT];
    const size_t node = chunks[chunk * CHUNK_WORDS + CHUNK_NODE];
    const int axis = splits[node * SPLIT_WORDS + SPLIT_AXIS];
    float cell[CELL_WORDS], all_lo[2][3], all_hi[2][3];
    for (int i = 0; i < CELL_WORDS; i++) cell[i] = cells[node * CELL_WORDS + i];
    Store stores[2];
    for (int side = 0; side < 2; side++) {
        stores[side] = build_store(places[2 * chunk + side], next_ref, next_bounds, next_rows, pool_ref, pool_bounds, pool_rows);
        for (int a = 0; a < 3; a++) {
            all_lo[side][a] = INFINITY;
            all_hi[side][a] = -INFINITY;
        }
    }
    for (size_t i = first; i < end; i++) {
        float part_lo[2][3], part_hi[2][3];
        if (goes[i] & IS_CUT) {
            build_parts(vertices + (size_t)ref[i] * 9, cell, axis, cell[CELL_PLANE], part_lo, part_hi);
        } else {
            for (int a = 0; a < 3; a++) {
                part_lo[0][a] = part_lo[1][a] = bounds[a * (size_t)rows + i];
                part_hi[0][a] = part_hi[1][a] = bounds[(3 + a) * (size_t)rows + i];
            }
        }
        for (int side = 0; side < 2; side++) {
            if (!(goes[i] & (GOES_BELOW << side))) continue;
            build_append(&stores[side], ref[i], part_lo[side], part_hi[side], all_lo[side], all_hi[side]);
        }
    }
    for (int side = 0; side < 2; side++) {
        for (int a = 0; a < 3; a++) {
            boxes[(2 * chunk + side) * 6 + a] = all_lo[side][a];
            boxes[(2 * chunk + side) * 6 + 3 + a] = all_hi[side][a];
        }
    }
}
