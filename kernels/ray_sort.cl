// Provides: kernels sort_count, sort_offsets, sort_scatter: an order of many rays in which those that go the same way lie together.
// Needs: given.cl.  Reads: SORT_BITS.
//
// A stable counting sort by the octant of the direction and the Morton code of the origin, SORT_BITS an axis, in a grid over the mesh. It is
// for caches and branch predictors alone: no result depends on it. Each work-item has a run of rays of its own.
#define SORT_BINS (8 << (3 * SORT_BITS))

HOT int sort_cell(double x) {
    // Written so that a NaN lies in cell 0.
    const int last = (1 << SORT_BITS) - 1;
    return x > 0 ? (x < last ? (int)x : last) : 0;
}

HOT int sort_key(const GivenRays *rays, size_t i, const double4 lo, const double4 cells) {
    double o[3], d[3];
    given_vector(rays->origins, rays->kinds, 0, i, o);
    given_vector(rays->directions, rays->kinds, 1, i, d);
    const int x = sort_cell((o[0] * rays->unit - lo.x) * cells.x), y = sort_cell((o[1] * rays->unit - lo.y) * cells.y);
    const int z = sort_cell((o[2] * rays->unit - lo.z) * cells.z);
    int key = (d[0] < 0) | (d[1] < 0) << 1 | (d[2] < 0) << 2;
    for (int bit = SORT_BITS - 1; bit >= 0; bit--) key = key << 3 | ((x >> bit) & 1) | ((y >> bit) & 1) << 1 | ((z >> bit) & 1) << 2;
    return key;
}

// keys: of each ray; counts: (runs, SORT_BINS), how many rays of each run have each key.
kernel void sort_count(GIVEN_PARAMETERS, double4 lo, double4 cells, int count, int run, global ushort *keys, global int *counts) {
    const GivenRays rays = GIVEN_ARGUMENTS;
    global int *own = counts + SORT_BINS * get_global_id(0);
    const int first = run * get_global_id(0), end = min(count, first + run);
    for (int k = 0; k < SORT_BINS; k++) own[k] = 0;
    for (int i = first; i < end; i++) {
        const int key = sort_key(&rays, i, lo, cells);
        keys[i] = (ushort)key;
        own[key]++;
    }
}

// Counts become places: of the first ray of each run with each key.
kernel void sort_offsets(int runs, global int *counts) {
    int place = 0;
    for (int key = 0; key < SORT_BINS; key++)
        for (int r = 0; r < runs; r++) {
            const int found = counts[SORT_BINS * r + key];
            counts[SORT_BINS * r + key] = place;
            place += found;
        }
}

// order: which ray comes at each place.
kernel void sort_scatter(int count, int run, global const ushort *keys, global int *places, global int *order) {
    global int *own = places + SORT_BINS * get_global_id(0);
    const int first = run * get_global_id(0), end = min(count, first + run);
    for (int i = first; i < end; i++) order[own[keys[i]]++] = i;
}
