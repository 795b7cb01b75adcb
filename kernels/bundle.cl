// Provides: bundle_coherent, bundle_trace: a run of rays that go about the same way from about the same place.
// Needs: blocks.cl.  Reads: RUN, a multiple of BLOCK.
//
// One descent serves all: what a node tests are bounds over the rays. A block is tested ray by ray, for those that meet its box as
// blocks_trace would find: by the same numbers, in the same order. Boxes lie within those of their parents and rounding is monotonic, so a ray
// that meets a block's box met all above it: each ray tests the blocks that it would have tested alone, and no bit of its hit depends on company.
#define BUNDLE_DIRECTIONS R(0.25)  // spread of directions, summed over the axes, up to which a bundle pays
#define BUNDLE_ORIGINS R(0.125)    // the same of origins, of the scene's extent

// Least and greatest, by axis: of the rays' directions, or of the inverses of these; and of their origins.
HOT void bundle_bounds(const Rays *rays, int count, const int inverses, real *low, real *high, real *near, real *far) {
    for (int a = 0; a < 3; a++) {
        low[a] = high[a] = inverses ? rays->inverse[a] : rays->direction[a];
        near[a] = far[a] = rays->origin[a];
        for (int i = 1; i < count; i++) {
            const real d = inverses ? rays[i].inverse[a] : rays[i].direction[a];
            low[a] = min_n(d, low[a]);
            high[a] = max_n(d, high[a]);
            near[a] = min_n(rays[i].origin[a], near[a]);
            far[a] = max_n(rays[i].origin[a], far[a]);
        }
    }
}

HOT int bundle_coherent(const Rays *rays, int count, real extent) {
    real low[3], high[3], near[3], far[3], spread = (real)0, apart = (real)0;
    bundle_bounds(rays, count, 0, low, high, near, far);
    for (int a = 0; a < 3; a++) {
        spread += high[a] - low[a];
        apart += far[a] - near[a];
    }
    int alike = spread <= BUNDLE_DIRECTIONS && apart <= BUNDLE_ORIGINS * extent;
    for (int i = 0; i < count; i++) alike &= rays[i].active && rays[i].octant == rays->octant;
    return alike;
}

// Bounds over the rays, by axis: of the inverse directions; of the origins, the ones that planes of entry and of exit are seen from.
// `slack` is twice the `pad` of blocks.cl, for the roundings of both computations.
typedef struct {
    real low_inverse[3], high_inverse[3], enter_origin[3], leave_origin[3], slack[3], t_min;
    int enter[3], order_shift;
} Bundle;

HOT uint bundle_children(global const WideNode *node, const Bundle *bundle, real t_max, block_n *distance, block_int *child) {
    block_n enter = (block_n)bundle->t_min, leave = (block_n)t_max;
    for (int a = 0; a < 3; a++) {
        const block_n first = load_block(node->planes[bundle->enter[a]]) - bundle->enter_origin[a];
        const block_n last = load_block(node->planes[bundle->enter[a] ^ 1]) - bundle->leave_origin[a];
        const block_n low = min_block(first * bundle->low_inverse[a], first * bundle->high_inverse[a]);
        const block_n high = max_block(last * bundle->low_inverse[a], last * bundle->high_inverse[a]);
        enter = max_block(low - bundle->slack[a], enter);
        leave = min_block(high + bundle->slack[a], leave);
    }
    return children_in_order(node, bundle->order_shift, enter, leave, distance, child);
}

// The numbers of each ray that its boxes are tested by, side by side; `t` is its nearest hit so far, or -INFINITY once it needs no more.
typedef struct {
    real inverse[3][RUN], enter_shift[3][RUN], leave_shift[3][RUN], t_min[RUN], t[RUN], reach[RUN];
} BundleRays;

HOT void bundle_begin(global const Object *object, const Rays *rays, const Hits *hits, int count, int any_hit, Bundle *bundle, BundleRays *all) {
    real reach = (real)0;
    bundle->t_min = (real)INFINITY;
    for (int i = 0; i < RUN; i++) {
        WideRay ray;
        const int from = i < count ? i : 0;
        all->reach[i] = wide_ray(object, rays + from, 0, &ray);
        for (int a = 0; a < 3; a++) {
            all->inverse[a][i] = ray.inverse[a];
            all->enter_shift[a][i] = ray.enter_shift[a];
            all->leave_shift[a][i] = ray.leave_shift[a];
        }
        all->t_min[i] = rays[from].t_min;
        all->t[i] = i < count && !(any_hit && hits[from].slot >= 0) ? hits[from].t : (real)-INFINITY;
        reach = max_n(all->reach[i], reach);
        bundle->t_min = min_n(all->t_min[i], bundle->t_min);
        bundle->order_shift = ray.order_shift;
        for (int a = 0; a < 3; a++) bundle->enter[a] = ray.enter[a];
    }
    real near[3], far[3];
    bundle_bounds(rays, count, 1, bundle->low_inverse, bundle->high_inverse, near, far);
    for (int a = 0; a < 3; a++) {
        const int negative = bundle->enter[a] & 1;
        bundle->enter_origin[a] = negative ? near[a] : far[a];
        bundle->leave_origin[a] = negative ? far[a] : near[a];
        bundle->slack[a] = (R(16.0) * UNIT_ROUNDOFF) * reach * max_n(abs_n(bundle->low_inverse[a]), abs_n(bundle->high_inverse[a]));
    }
}

// Which of the BLOCK rays from `first` on meet the block's box: node_children's test, for one child and many rays.
HOT uint bundle_live(global const Block *block, const Bundle *bundle, const BundleRays *all, int first) {
#pragma OPENCL FP_CONTRACT ON
#define rays_row(p) PASTE(vload, BLOCK)(0, (p) + first)
    block_n enter = max_block(block->box[bundle->enter[0]] * rays_row(all->inverse[0]) + rays_row(all->enter_shift[0]), rays_row(all->t_min));
    block_n leave = min_block(block->box[bundle->enter[0] ^ 1] * rays_row(all->inverse[0]) + rays_row(all->leave_shift[0]), rays_row(all->t));
    enter = max_block(block->box[bundle->enter[1]] * rays_row(all->inverse[1]) + rays_row(all->enter_shift[1]), enter);
    leave = min_block(block->box[bundle->enter[1] ^ 1] * rays_row(all->inverse[1]) + rays_row(all->leave_shift[1]), leave);
    enter = max_block(block->box[bundle->enter[2]] * rays_row(all->inverse[2]) + rays_row(all->enter_shift[2]), enter);
    leave = min_block(block->box[bundle->enter[2] ^ 1] * rays_row(all->inverse[2]) + rays_row(all->leave_shift[2]), leave);
#undef rays_row
    return block_bits(~(enter > leave));
}

// Tests the block for the rays that meet its box; the distance that no ray still looks beyond.
HOT real bundle_block(const Geometry *geometry, global const Block *block, const Rays *rays, int any_hit, const Bundle *bundle, BundleRays *all,
                      Hits *hits) {
    real t_max = (real)-INFINITY;
    for (int first = 0; first < RUN; first += BLOCK) {
        for (uint bits = bundle_live(block, bundle, all, first); bits; bits &= bits - 1) {
            const int i = first + lowest_bit(bits);
            block_hits(geometry, block, rays + i, 0, all->reach[i], hits + i);
            all->t[i] = any_hit && hits[i].slot >= 0 ? (real)-INFINITY : hits[i].t;
        }
        for (int i = first; i < first + BLOCK; i++) t_max = max_n(all->t[i], t_max);
    }
    return t_max;
}

// Rays through the wide tree of one object.
HOT void bundle_object(const Geometry *geometry, global const Object *object, const Rays *rays, int count, int any_hit, Hits *hits) {
    Bundle bundle;
    BundleRays all;
    bundle_begin(object, rays, hits, count, any_hit, &bundle, &all);
    real t_max = (real)-INFINITY;
    for (int i = 0; i < RUN; i++) t_max = max_n(all.t[i], t_max);
    block_n distances[WIDE_STACK];
    block_int children[WIDE_STACK];
    uint pending[WIDE_STACK];
    int level = 0, node = object->root;
    for (;;) {
        if (node >= 0) {
            pending[level] = bundle_children(geometry->wide + node, &bundle, t_max, distances + level, children + level);
            level += pending[level] != 0;
        } else t_max = bundle_block(geometry, geometry->blocks + (-1 - node), rays, any_hit, &bundle, &all, hits);
        if (!next_child(distances, children, pending, t_max, &level, &node)) return;
    }
}

HOT void bundle_trace(const Geometry *geometry, const Rays *rays, int count, int any_hit, Hits *hits) {
    for (int b = 0; b < geometry->object_count; b++) bundle_object(geometry, geometry->objects + b, rays, count, any_hit, hits);
}
