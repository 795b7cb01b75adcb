// Provides: group_trace: GROUP packets that share their origin through all triangles of the scene together, for the closest or for any hit.
// Needs: directions.cl, scene.cl, one triangle_*.cl.  Reads: GROUP (packets), GROUP_STACK (15 for each level of records, and one).
//
// The rays of a group are bounded by one interval of directions; as all start at one point, that is all there is to know of them. Records of 16
// boxes, of blocks of triangles or of other records, are compared with it at once, from near to far: those are the kd-tree's triangles in
// the order of the leaves, each once (clrt/kdtree/runs.py). Of the blocks that are met, the triangles are picked first for the group, then for each packet.
//
// What a ray meets lies in all boxes above it, so nothing is missed. Of hits at equal t the one of the first triangle stays here and in kdtree.cl
// (`tie`), so both find the same, but for what only the error bounds of a test let in: there it matters which triangles are tested at all.
#define SPREAD R(0.06)  // of directions, in a group that goes together: wider ones meet too many boxes by their corners

// The packets of a group, and what is left of them.
typedef struct {
    const Rays *rays;
    Hits *hits;
    int count;
    Directions all, packet[GROUP];
    mask_n active[GROUP];
    float far;  // no lane of the group needs more of its t
} Group;

// Rounded up, as lanes may be wider than float; below 0 where no lane needs anything.
HOT void group_far(Group *group) {
    real_n nearest = (real_n)INFINITY;  // of -t: one search across lanes serves all packets
    for (int p = 0; p < group->count; p++) nearest = min_n(nearest, choose(group->active[p], -group->hits[p].t, (real_n)INFINITY));
    const real far = -least_lane(nearest);
    group->far = far < 0 ? -1.0f : (float)(far + R(0x1p-22) * far);
}

HOT real_n group_reach(const Geometry *geometry, const Rays *rays, global const DirectionBoxes *boxes, const int shared) {
    return shared == SHARED_ORIGIN ? (real_n)0 : rays_reach(rays, geometry->objects + geometry->surfaces[boxes->item[0]].object);
}

//@ group_decide
// The triangles of a block that are left of the group's bounds in `picked`, packet by packet; none is nearer than `near`.
HOT void group_test(const Geometry *geometry, Group *group, global const DirectionBoxes *boxes, uint picked, float near, const int shared,
                    const int any_hit) {
    const real reached = (real)near - R(0x1p-22) * (real)near;
    int changed = 0;
    //@ group_begin
    // All packets are compared before any is tested, without a branch between them.
    uint each[GROUP], some = 0;
    #pragma unroll
    for (int p = 0; p < GROUP; p++) {
        each[p] = picked & boxes_met(boxes, group->packet + p);
        some |= (each[p] ? 1u : 0u) << p;
    }
    for (some &= (1u << group->count) - 1; some; some &= some - 1) {
        const int p = first_bit(some);
        uint met = each[p];
        Hits hits = group->hits[p];
        const mask_n active = group->active[p];
        if (!any_lane(active & is_at_least(hits.t, (real_n)reached))) continue;
        const Rays *rays = group->rays + p;
        //@ count_met
        const real_n reach = group_reach(geometry, rays, boxes, shared);
        //@ group_tests
        group->hits[p] = hits;
        if (any_hit) group->active[p] = active & is_less(hits.slot, NO_LANES);
        // How far rays go does not change with what they meet where any hit will do.
        changed |= !any_hit || !any_lane(group->active[p]);
    }
    //@ group_tested
    if (changed) group_far(group);
}

HOT void group_walk(const Geometry *geometry, Group *group, const int shared, const int any_hit) {
    int stack[GROUP_STACK];
    float near[GROUP_STACK];
    int top = 1, block = 0;
    uint picked = 0;
    float block_near = 0, next_near = 0;
    stack[0] = geometry->box_count - 1;
    near[0] = 0;
    while (top > 0 || block > 0) {
        // The next block or record, while the triangles of the block before are on their way from memory.
        int next = 0;
        while (top > 0 && !next) {
            top--;
            next_near = near[top];
            if (next_near <= group->far) next = stack[top];
        }
        uint met = 0;
        if (next) {
            global const DirectionBoxes *boxes = geometry->boxes + next;
            met = boxes_met(boxes, &group->all) & boxes_near(boxes, group->far);
            if (next <= geometry->block_count) {
                for (uint rest = met; rest; rest &= rest - 1) fetch_test(geometry, boxes->item[first_bit(rest)], shared);
            } else {
                // Onto the stack, the nearest last.
                for (const int bottom = top; met; met &= met - 1) {
                    const int k = first_bit(met);
                    const float distance = boxes->near[k];
                    global const char *bytes = (global const char *)(geometry->boxes + boxes->item[k]);
                    for (int i = 0; i < (int)sizeof(DirectionBoxes); i += 64) fetch_ahead(bytes + i);
                    int place = top++;
                    for (; place > bottom && near[place - 1] < distance; place--) {
                        stack[place] = stack[place - 1];
                        near[place] = near[place - 1];
                    }
                    stack[place] = boxes->item[k];
                    near[place] = distance;
                }
                continue;
            }
        }
        if (block > 0) group_test(geometry, group, geometry->boxes + block, picked, block_near, shared, any_hit);
        block = met ? next : 0;
        block_near = next_near;
        picked = met;
    }
}

// How far apart they are along the first axes: all three of directions, those across a sun's.
HOT real spread_size(const Spread *of, const int axes) {
    real size = 0;
    for (int a = 0; a < axes; a++)
        if (-of->minus_hi[a] - of->lo[a] > size) size = -of->minus_hi[a] - of->lo[a];
    return size;
}

// The most packets from `begin` on, by halves of halves, that are near each other: not farther apart than they are wide. Gives their count and bounds.
HOT int group_size(const Spread *of, int begin, const int axes, Spread *all) {
    for (int count = GROUP;; count /= 2) {
        if (begin % count) continue;
        real sum = 0;
        *all = of[begin];
        for (int p = begin; p < begin + count; p++) {
            sum += spread_size(of + p, axes);
            for (int a = 0; a < 3; a++) {
                all->lo[a] = of[p].lo[a] < all->lo[a] ? of[p].lo[a] : all->lo[a];
                all->minus_hi[a] = of[p].minus_hi[a] < all->minus_hi[a] ? of[p].minus_hi[a] : all->minus_hi[a];
            }
        }
        if (count == 1 || spread_size(all, axes) <= (sum < SPREAD ? sum : SPREAD)) return count;
    }
}

HOT int group_lives(const Rays *rays, int count) {
    mask_n some = NO_LANES;
    for (int p = 0; p < count; p++) some |= rays[p].active;
    return any_lane(some);
}

// What is left of packets that go together.
HOT void group_begin(Group *group, const Rays *rays, Hits *hits, int count) {
    group->rays = rays;
    group->hits = hits;
    group->count = count;
    for (int p = 0; p < count; p++) group->active[p] = rays[p].active;
    group_far(group);
}

// A packet that goes alone: one copy for all callers.
static __attribute__((noinline)) void packet_trace(const Geometry *geometry, const Rays *rays, const int any_hit, Hits *hits) {
    Rays alone = *rays;
    rays_invert(&alone);
    scene_trace(geometry, &alone, SHARED_ORIGIN, any_hit, hits);
}

// Rays as scene_trace takes them, but for what rays_invert fills, with one origin for all that are active. Apart from the callers: they are few, and this is large.
static __attribute__((noinline)) void group_trace(const Geometry *geometry, const Rays *rays, const int any_hit, Hits *hits) {
    Spread of[GROUP];
    for (int p = 0; p < GROUP; p++) least_directions(rays + p, of + p);
    for (int begin = 0, count = 1; begin < GROUP; begin += count) {
        Group group;
        Spread all;
        count = group_size(of, begin, 3, &all);
        if (!group_lives(rays + begin, count)) continue;
        if (geometry->box_count == 0 || spread_size(&all, 3) > SPREAD) {
            for (int p = begin; p < begin + count; p++) packet_trace(geometry, rays + p, any_hit, hits + p);
            continue;
        }
        group_begin(&group, rays + begin, hits + begin, count);
        for (int p = 0; p < count; p++) directions_in_steps(geometry->boxes, of + begin + p, group.packet + p);
        directions_in_steps(geometry->boxes, &all, &group.all);
        group_walk(geometry, &group, SHARED_ORIGIN, any_hit);
        for (int p = 0; p < count; p++) scene_rest(geometry, group.rays + p, group.active[p], SHARED_ORIGIN, any_hit, group.hits + p);
    }
}
//@hook group_tests_default
        for (; met; met &= met - 1) triangle_test(geometry, rays, reach, boxes->item[first_bit(met)], shared, 1, active, &hits);
//@end
