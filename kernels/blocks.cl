// Provides: blocks_trace: one ray of a packet through the wide tree of an object, for the closest or for any hit; kernels
//           prepare_blocks and prepare_boxes.
// Needs: lanes.cl, rays.cl, structs, geometry.cl, one triangle_*.cl.  Reads: BLOCK (16, 8 or 4), WIDE_STACK (at least the depth of the
// deepest wide tree).
//
// A vector holds one number of all children of a node, or of all triangles of a block. What is left out of a block is what triangle_test would
// refuse; a lone triangle that it would surely accept is; all else goes through it one by one.

typedef PASTE(REAL_NAME, BLOCK) block_n;
typedef PASTE(LANE_INT_NAME, BLOCK) block_mask;
typedef PASTE(int, BLOCK) block_int;
// Rows of records are aligned to their size; a vload of PoCL does not know, and takes several loads.
#define load_block(p) (*(global const block_n *)(p))

#if BLOCK == 16 && REAL_BITS == 32 && defined(__AVX512DQ__) && defined(__clang__)
#define block_bits(m) ((uint)__builtin_ia32_cvtd2mask512(m))
#elif BLOCK == 8 && REAL_BITS == 64 && defined(__AVX512DQ__) && defined(__clang__)
#define block_bits(m) ((uint)__builtin_ia32_cvtq2mask512(m))
#elif BLOCK == 8 && REAL_BITS == 32 && defined(__AVX__) && defined(__clang__)
#define block_bits(m) ((uint)__builtin_ia32_movmskps256(as_float8(m)))
#elif BLOCK == 4 && REAL_BITS == 64 && defined(__AVX__) && defined(__clang__)
#define block_bits(m) ((uint)__builtin_ia32_movmskpd256(as_double4(m)))
#else
HOT uint block_bits(block_mask m) {
    lane_int lane[BLOCK];
    uint bits = 0;
    PASTE(vstore, BLOCK)(m, 0, lane);
    for (int k = 0; k < BLOCK; k++) bits |= (uint)(lane[k] & 1) << k;
    return bits;
}
#endif

#ifdef __clang__
#define lowest_bit(bits) __builtin_ctz(bits)
#else
#define lowest_bit(bits) (31 - (int)clz((bits) & -(bits)))
#endif

// The number of lane `k`, of a ray among others or of one alone.
#define lane_of(numbers, k) (((real *)&(numbers))[k])
#define lane_of_mask(numbers, k) (((lane_int *)&(numbers))[k])

// New bounds come first: where one is NaN (beyond the range of `real`), the old one stays.
HOT block_n min_block(block_n a, block_n b) { return (a < b) ? a : b; }
HOT block_n max_block(block_n a, block_n b) { return (a > b) ? a : b; }
HOT block_n abs_block(block_n a) { return (a < (real)0) ? -a : a; }

// The ray's numbers that are the same for all nodes of an object.
// With `pad` = 8u reach, all errors of (plane - origin) * inverse that box.cl lists are below pad |inverse|, as no plane is further than
// `reach`: so the shifts, which take the origin away and the pad away or to it, leave a multiplication and an addition a plane.
typedef struct {
    real inverse[3], enter_shift[3], leave_shift[3];
    int enter[3];     // of the six rows of planes, the one that the ray enters by; it leaves by the other of the axis
    int order_shift;  // of the ray's octant, in `order`
} WideRay;

HOT real wide_ray(global const Object *object, const Rays *rays, int k, WideRay *ray) {
    real reach = object->extent;
    for (int a = 0; a < 3; a++) reach += fabs(lane_of(rays->origin[a], k));
    const real pad = (R(8.0) * UNIT_ROUNDOFF) * reach;
    const int octant = (int)lane_of_mask(rays->octant, k);
    ray->order_shift = 4 * octant;
    for (int a = 0; a < 3; a++) {
        const real inverse = lane_of(rays->inverse[a], k), slab = pad * fabs(inverse), away = -(lane_of(rays->origin[a], k) * inverse);
        ray->inverse[a] = inverse;
        ray->enter_shift[a] = away - slab;
        ray->leave_shift[a] = away + slab;
        ray->enter[a] = 2 * a + ((octant >> a) & 1);
    }
    return reach;
}

// Children that are not left before they are entered, a bit each, with the distances; all in order from near to far.
HOT uint children_in_order(global const WideNode *node, int order_shift, block_n enter, block_n leave, block_n *distance, block_int *child) {
    const block_int order = *(global const block_int *)node->order >> order_shift, children = *(global const block_int *)node->child;
#if BLOCK == 16 && REAL_BITS == 32 && defined(__AVX512DQ__) && defined(__clang__)
    *child = __builtin_ia32_permvarsi512(children, order);
    *distance = __builtin_ia32_permvarsf512(enter, order);
    return block_bits(~(*distance > __builtin_ia32_permvarsf512(leave, order)));
#else
    real entered[BLOCK], ordered[BLOCK];
    int place[BLOCK], number[BLOCK];
    PASTE(vstore, BLOCK)(enter, 0, entered);
    PASTE(vstore, BLOCK)(order, 0, place);
    const uint bits = block_bits(~(enter > leave));
    uint found = 0;
    for (int k = 0; k < BLOCK; k++) {
        const int from = place[k] & (BLOCK - 1);
        ordered[k] = entered[from];
        number[k] = node->child[from];
        found |= ((bits >> from) & 1) << k;
    }
    *distance = PASTE(vload, BLOCK)(0, ordered);
    *child = PASTE(vload, BLOCK)(0, number);
    return found;
#endif
}

// Children of a node that the ray may meet before t_max.
HOT uint node_children(global const WideNode *node, const WideRay *ray, real t_min, real t_max, block_n *distance, block_int *child) {
#pragma OPENCL FP_CONTRACT ON
#define node_row(n) load_block(node->planes[n])
    block_n enter = max_block(node_row(ray->enter[0]) * ray->inverse[0] + ray->enter_shift[0], (block_n)t_min);
    block_n leave = min_block(node_row(ray->enter[0] ^ 1) * ray->inverse[0] + ray->leave_shift[0], (block_n)t_max);
    enter = max_block(node_row(ray->enter[1]) * ray->inverse[1] + ray->enter_shift[1], enter);
    leave = min_block(node_row(ray->enter[1] ^ 1) * ray->inverse[1] + ray->leave_shift[1], leave);
    enter = max_block(node_row(ray->enter[2]) * ray->inverse[2] + ray->enter_shift[2], enter);
    leave = min_block(node_row(ray->enter[2] ^ 1) * ray->inverse[2] + ray->leave_shift[2], leave);
#undef node_row
    return children_in_order(node, ray->order_shift, enter, leave, distance, child);
}

// The triangles of a block that triangle_test may accept, by its formulae (triangle.cl) term by term: all of them but those, and those that it
// accepts for sure, as neither the edges nor the distances are near their errors.
typedef struct {
    uint possible, sure;
    block_n t, error;
} BlockHits;

HOT void block_test(global const Block *block, const Rays *rays, int k, real reach, const Hits *hits, BlockHits *found) {
#pragma OPENCL FP_CONTRACT ON
    const real d[3] = {lane_of(rays->direction[0], k), lane_of(rays->direction[1], k), lane_of(rays->direction[2], k)};
    const block_n e10 = load_block(block->e1[0]), e11 = load_block(block->e1[1]), e12 = load_block(block->e1[2]);
    const block_n e20 = load_block(block->e2[0]), e21 = load_block(block->e2[1]), e22 = load_block(block->e2[2]);
    const block_n t0 = lane_of(rays->origin[0], k) - load_block(block->v0[0]);
    const block_n t1 = lane_of(rays->origin[1], k) - load_block(block->v0[1]);
    const block_n t2 = lane_of(rays->origin[2], k) - load_block(block->v0[2]);
    const block_n p0 = d[1] * e22 - d[2] * e21, p1 = d[2] * e20 - d[0] * e22, p2 = d[0] * e21 - d[1] * e20;
    const block_n q0 = t1 * e12 - t2 * e11, q1 = t2 * e10 - t0 * e12, q2 = t0 * e11 - t1 * e10;
    const block_n u = t0 * p0 + t1 * p1 + t2 * p2;
    const block_n v = d[0] * q0 + d[1] * q1 + d[2] * q2;
    const block_n w = (p0 * e10 + p1 * e11 + p2 * e12) - u - v;
    const block_n bound = reach * load_block(block->bound) + UNDERFLOWN, lowest = min_block(min_block(u, v), w), highest = max_block(max_block(u, v), w);
    found->possible = block_bits((lowest >= -bound) | (highest <= bound));
    if (!found->possible) return;
    const block_n n0 = load_block(block->normal[0]), n1 = load_block(block->normal[1]), n2 = load_block(block->normal[2]);
    const block_n normal_bound = load_block(block->normal_bound);
    const block_n rate = d[0] * n0 + d[1] * n1 + d[2] * n2, offset = -t0 * n0 + -t1 * n1 + -t2 * n2;
    const block_n inverse = R(1.0) / rate;
    const block_n t = offset * inverse;
    const block_n error = (abs_block(t) * normal_bound + reach * normal_bound) * abs_block(R(2.0) * inverse);
    const block_mask grazing = abs_block(rate) <= R(2.0) * normal_bound;
    const block_mask outside = (t + error < lane_of(rays->t_min, k)) | (t - error > lane_of(hits->t, k));
    found->possible &= block_bits(grazing | ~outside);
    const block_mask clear = ((lowest > bound) & (highest > R(8.0) * bound)) | ((highest < -bound) & (lowest < R(-8.0) * bound));
    //@ block_limits
    found->sure = found->possible & block_bits(clear & ~grazing & (t - error > after) & (t + error < before));
    found->t = t;
    found->error = error;
}

// One by one. Rare, so kept out of the loops' registers, and out of their text.
static __attribute__((noinline)) void block_unsure(const Geometry *geometry, global const Block *block, const Rays *rays, int k, real reach, uint bits,
                                                   Hits *hits) {
    lane_int lane[LANES];
    for (int i = 0; i < LANES; i++) lane[i] = i == k ? -1 : 0;
    for (; bits; bits &= bits - 1) triangle_test(geometry, rays, (real_n)reach, block->slot[lowest_bit(bits)], SHARED_NOTHING, 0, load_lanes(lane), hits);
}

HOT void block_hits(const Geometry *geometry, global const Block *block, const Rays *rays, int k, real reach, Hits *hits) {
    BlockHits found;
    block_test(block, rays, k, reach, hits, &found);
    //@ block_tested
    //@ block_possible
    if (!found.possible) return;
    int alone = found.sure == found.possible && !(found.sure & (found.sure - 1));
    //@ block_alone
    if (!alone) {
        block_unsure(geometry, block, rays, k, reach, found.possible, hits);
        return;
    }
    const int place = lowest_bit(found.sure);
    real t[BLOCK], error[BLOCK];
    PASTE(vstore, BLOCK)(found.t, 0, t);
    PASTE(vstore, BLOCK)(found.error, 0, error);
    lane_of_mask(hits->slot, k) = block->slot[place];
    //@ block_accept
}

// The nearest child left to see, of the deepest node that has any, if it is entered before t_max; false where there is none.
HOT int next_child(const block_n *distances, const block_int *children, uint *pending, real t_max, int *level, int *node) {
    real distance;
    do {
        if (*level == 0) return 0;
        const int above = *level - 1;
        const uint bits = pending[above], rest = bits & (bits - 1);
        const int next = lowest_bit(bits);
        *node = ((const int *)(children + above))[next];
        distance = ((const real *)(distances + above))[next];
        pending[above] = rest;
        *level -= rest == 0;
    } while (distance > t_max);
    return 1;
}

// Ray k through the wide tree of an object, which begins at `node`.
HOT void blocks_trace(const Geometry *geometry, global const Object *object, int node, const Rays *rays, int k, const int any_hit,
                      Hits *hits) {
    WideRay ray;
    const real reach = wide_ray(object, rays, k, &ray);
    // Nodes with children left to see: which, and their distances.
    block_n distances[WIDE_STACK];
    block_int children[WIDE_STACK];
    uint pending[WIDE_STACK];
    int level = 0;
    for (;;) {
        if (node >= 0) {
            const real t_min = lane_of(rays->t_min, k), t_max = lane_of(hits->t, k);
            pending[level] = node_children(geometry->wide + node, &ray, t_min, t_max, distances + level, children + level);
            level += pending[level] != 0;
        } else {
            block_hits(geometry, geometry->blocks + (-1 - node), rays, k, reach, hits);
            if (any_hit && lane_of_mask(hits->slot, k) >= 0) return;
        }
        if (!next_child(distances, children, pending, lane_of(hits->t, k), &level, &node)) return;
    }
}

// One number of each block's records from those of its triangles; NaN corners, which no test accepts, where there is none.
kernel void prepare_blocks(global const Triangle *triangles, global const int *slots, global Block *blocks, int count) {
    const int i = get_global_id(0), lane = i % BLOCK;
    if (i >= count) return;
    global Block *block = blocks + i / BLOCK;
    const int slot = slots[i];
    global const Triangle *triangle = triangles + (slot < 0 ? 0 : slot);
    for (int a = 0; a < 3; a++) {
        block->v0[a][lane] = slot < 0 ? (real)NAN : triangle->v0[a];
        block->e1[a][lane] = triangle->e1[a];
        block->e2[a][lane] = triangle->e2[a];
        block->normal[a][lane] = triangle->normal[a];
    }
    block->bound[lane] = triangle->bound;
    block->normal_bound[lane] = triangle->normal_bound;
    block->slot[lane] = slot;
}

// The box of each block, from the node that it is a child of.
kernel void prepare_boxes(global const WideNode *wide, global Block *blocks, int count) {
    const int i = get_global_id(0), lane = i % BLOCK;
    if (i >= count) return;
    global const WideNode *node = wide + i / BLOCK;
    if (node->child[lane] >= 0) return;
    for (int p = 0; p < 6; p++) blocks[-1 - node->child[lane]].box[p] = node->planes[p][lane];
}

//@hook geometry_members
    global const WideNode *wide;
    global const Block *blocks;
//@end
//@hook block_limits_default
    const real after = lane_of(rays->t_min, k), before = lane_of(hits->t, k);
//@end
//@hook block_accept_default
    lane_of(hits->t, k) = t[place];
//@end
