// Provides: build_subtrees: whole trees below nodes of few references, each by one work-item, depth first, no launch between.
// Needs: build_clip.cl, build_split.cl, build_top.cl.  Reads: MOST_BINS, MOST_DEPTH, TRAVERSAL_COST.
//
// A work-item takes one job after another. In its own memory it keeps the references still to be sorted as a stack: the upper child stays
// where its parent was, closed up, the lower one lies after the parent, so that nothing is moved twice.
// Nodes come out in preorder, leaves and their triangles with them.
enum { JOB_START, JOB_COUNT, JOB_DEPTH, JOB_LIMIT, JOB_BINS, JOB_WORDS };  // JOB_LIMIT: no leaf is deeper; JOB_BINS: at depth 0
enum { DONE_NODE, DONE_NODES, DONE_ENTRY, DONE_ENTRIES, DONE_WORDS };  // DONE_NODES -1: its memory was too small
enum { TAKEN_JOBS, TAKEN_NODES, TAKEN_ENTRIES };
enum { NODE_KIND, NODE_VALUE, NODE_WORDS };  // depth << 2 | axis, 3 for a leaf; bits of the plane or number of triangles
#define LEAF 3

typedef struct {
    global int *ref;
    global float *row[6];
    size_t size;
} Stack;

typedef struct {
    size_t start, count;
    int depth;
    float cell[CELL_WORDS];
} Open;

// Bounds of the references along one row: the least or the greatest.
static inline float build_extreme(global const float *row, size_t count, bool greatest) {
    float found = row[0];
    size_t i = 0;
    if (count >= WIDE) {
        float8 all = vload8(0, row);
        for (i = WIDE; i + WIDE <= count; i += WIDE) {
            const float8 next = vload8(0, row + i);
            const int8 better = greatest ? next > all : next < all;
            all = as_float8((as_int8(next) & better) | (as_int8(all) & ~better));
        }
        const float parts[WIDE] = {all.s0, all.s1, all.s2, all.s3, all.s4, all.s5, all.s6, all.s7};
        found = parts[0];
        for (int k = 1; k < WIDE; k++) found = (greatest ? parts[k] > found : parts[k] < found) ? parts[k] : found;
    }
    for (; i < count; i++) found = (greatest ? row[i] > found : row[i] < found) ? row[i] : found;
    return found;
}

static inline void build_count(global const float *row, size_t count, float base, float scale, int *into) {
    size_t i = 0;
    for (; i + WIDE <= count; i += WIDE) {
        const int8 bin = convert_int8((vload8(0, row + i) - base) * scale) + 1;
        into[bin.s0]++; into[bin.s1]++; into[bin.s2]++; into[bin.s3]++;
        into[bin.s4]++; into[bin.s5]++; into[bin.s6]++; into[bin.s7]++;
    }
    for (; i < count; i++) into[1 + (int)((row[i] - base) * scale)]++;
}

static void build_best(const Stack *stack, const Open *node, int bins, Split *best) {
    best->cost = INFINITY;
    for (int axis = 0; axis < 3; axis++) {
        global const float *los = stack->row[axis] + node->start, *his = stack->row[3 + axis] + node->start;
        const float lo = build_extreme(los, node->count, false), hi = build_extreme(his, node->count, true);
        int begins[MOST_BINS + 2], ends[MOST_BINS + 2];
        for (int k = 0; k < bins + 2; k++) begins[k] = ends[k] = 0;
        float scales[2];
        build_bin_scales(lo, hi, bins, scales);
        build_count(los, node->count, lo, scales[0], begins);
        build_count(his, node->count, lo, scales[1], ends);
        build_best_of_axis(begins, ends, (int)node->count, bins, axis, lo, hi, node->cell + CELL_LO, node->cell + CELL_HI, best);
    }
}

static inline void build_put(const Stack *stack, size_t at, int ref, const float *bounds) {
    stack->ref[at] = ref;
    for (int r = 0; r < 6; r++) stack->row[r][at] = bounds[r];
}

// Sorts the references of a node to its children: those above stay at its start, those below come after its end. Gives their numbers.
static void build_divide(global const double *vertices, const Stack *stack, const Open *node, const Split *split, size_t *below,
                         size_t *above) {
    const size_t end = node->start + node->count;
    size_t low = end, high = node->start;
    for (size_t i = node->start; i < end; i++) {
        const int ref = stack->ref[i];
        float bounds[6];
        for (int r = 0; r < 6; r++) bounds[r] = stack->row[r][i];
        bool goes_below = stack->row[split->axis][i] < split->plane, goes_above = stack->row[3 + split->axis][i] > split->plane;
        if (goes_below & goes_above) {
            float part_lo[2][3], part_hi[2][3], part[2][6];
            const int left = build_parts(vertices + (size_t)ref * 9, node->cell, split->axis, split->plane, part_lo, part_hi);
            for (int a = 0; a < 3; a++) {
                for (int side = 0; side < 2; side++) {
                    part[side][a] = part_lo[side][a];
                    part[side][3 + a] = part_hi[side][a];
                }
            }
            build_put(stack, low, ref, part[0]);
            build_put(stack, high, ref, part[1]);
            low += (left & GOES_BELOW) != 0;
            high += (left & GOES_ABOVE) != 0;
            continue;
        }
        if (!(goes_below | goes_above)) {
            goes_above = split->flats_up;
            goes_below = !goes_above;
        }
        build_put(stack, low, ref, bounds);
        build_put(stack, high, ref, bounds);
        low += goes_below;
        high += goes_above;
    }
    *below = low - end;
    *above = high - node->start;
}

// One subtree. Returns whether its memory sufficed; node_count, entry_count: what it wrote.
static bool build_one(global const double *vertices, const Stack *stack, Open node, int limit, int root_bins, global int *nodes,
                      size_t most_nodes, global int *entries, size_t most_entries, size_t *node_count, size_t *entry_count) {
    Open waiting[MOST_DEPTH + 1];
    int height = 0;
    size_t made = 0, named = 0;
    while (true) {
        Split split;
        bool leaf = node.depth == limit || (node.depth > 0 && node.count <= TRAVERSAL_COST);
        if (!leaf) {
            build_best(stack, &node, clamp(root_bins >> node.depth, LEAST_BINS, MOST_BINS), &split);
            leaf = !((double)split.cost < (double)node.count);
        }
        if (made == most_nodes || (leaf ? named + node.count > most_entries : node.start + 2 * node.count + 1 > stack->size)) return false;
        nodes[made * NODE_WORDS + NODE_KIND] = node.depth << 2 | (leaf ? LEAF : split.axis);
        nodes[made * NODE_WORDS + NODE_VALUE] = leaf ? (int)node.count : as_int(split.plane);
        made++;
        if (leaf) {
            for (size_t i = 0; i < node.count; i++) entries[named + i] = stack->ref[node.start + i];
            named += node.count;
            if (height == 0) break;
            node = waiting[--height];
            continue;
        }
        size_t below, above;
        build_divide(vertices, stack, &node, &split, &below, &above);
        node.depth++;
        waiting[height] = node;
        waiting[height].count = above;
        waiting[height++].cell[CELL_LO + split.axis] = split.plane;
        node.start += node.count;
        node.count = below;
        node.cell[CELL_HI + split.axis] = split.plane;
    }
    *node_count = made;
    *entry_count = named;
    return true;
}

// Works through `count` jobs. memory: of each work-item, 7 rows of `size` for the stack, then twice `size` for its nodes and
// `size` for its entries. taken: counters, zero before; where an output is too small, they tell how large it should be.
kernel void build_subtrees(global const double *vertices, global const int *jobs, global const float *cells, const int count,
                           global const int *pool_ref, global const float *pool_bounds, const int pool_rows,
                           global int *memory, const int size, global int *taken, global int *nodes, const int most_nodes,
                           global int *entries, const int most_entries, global int *done) {
    Stack stack;
    global int *own = memory + get_global_id(0) * (size_t)size * 10;
    stack.ref = own;
    for (int r = 0; r < 6; r++) stack.row[r] = (global float *)(own + (size_t)size * (1 + r));
    stack.size = size;
    global int *own_nodes = own + (size_t)size * 7, *own_entries = own + (size_t)size * 9;
    for (int j = atomic_inc(taken + TAKEN_JOBS); j < count; j = atomic_inc(taken + TAKEN_JOBS)) {
        global const int *job = jobs + (size_t)j * JOB_WORDS;
        global int *report = done + (size_t)j * DONE_WORDS;
        Open root;
        root.start = 0;
        root.count = job[JOB_COUNT];
        root.depth = job[JOB_DEPTH];
        for (int i = 0; i < CELL_PLANE; i++) root.cell[i] = cells[(size_t)j * CELL_PLANE + i];
        size_t made = 0, named = 0;
        bool whole = root.count <= stack.size;
        if (whole) {
            for (size_t i = 0; i < root.count; i++) {
                stack.ref[i] = pool_ref[job[JOB_START] + i];
                for (int r = 0; r < 6; r++) stack.row[r][i] = pool_bounds[r * (size_t)pool_rows + job[JOB_START] + i];
            }
            whole = build_one(vertices, &stack, root, job[JOB_LIMIT], job[JOB_BINS], own_nodes, size, own_entries, size, &made, &named);
        }
        const int node = whole ? atomic_add(taken + TAKEN_NODES, (int)made) : 0;
        const int entry = whole ? atomic_add(taken + TAKEN_ENTRIES, (int)named) : 0;
        report[DONE_NODE] = node;
        report[DONE_ENTRY] = entry;
        report[DONE_NODES] = whole ? (int)made : -1;
        report[DONE_ENTRIES] = (int)named;
        if (!whole) continue;
        if (node + (long)made > most_nodes || entry + (long)named > most_entries) {
            report[DONE_NODES] = -2;  // built, but not handed out
            continue;
        }
        for (size_t i = 0; i < made * NODE_WORDS; i++) nodes[(size_t)node * NODE_WORDS + i] = own_nodes[i];
        for (size_t i = 0; i < named; i++) entries[entry + i] = own_entries[i];
    }
}
