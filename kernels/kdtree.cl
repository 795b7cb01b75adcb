// Provides: kdtree_trace: rays through the kd-tree of one object, for the closest or for any hit.
// Needs: lanes.cl, rays.cl, structs, box.cl, geometry.cl, one triangle_*.cl.  Reads: STACK_SIZE (at least the depth of the deepest tree).
//
// Every computed distance to a plane is widened by its error bound on both sides (see box.cl), and comparisons are written
// so that a NaN visits both children: a cell is entered if it cannot be shown to be missed (Ize 2013; Havran 2000).

//@ kdtree_before
HOT void kdtree_trace(const Geometry *geometry, global const Object *object, const Rays *rays, mask_n active, const int shared,
                         const int any_hit, Hits *hits) {
    real_n slab[3], t_enter, t_leave;
    active &= box_clip(object, rays, hits->t, slab, &t_enter, &t_leave);
    if (!any_lane(active)) return;
    //@ kdtree_rays
    const real_n reach = rays_reach(rays, object);
    PlaneLines lines;
    if (shared == SHARED_ORIGIN) plane_lines(rays, slab, &lines);
    // The two words of a node are loaded apart: the split goes to all lanes, the rest decides the way.
    global const int *words = (global const int *)geometry->nodes;
    int stack_node[STACK_SIZE];
    real_n stack_near[STACK_SIZE], stack_far[STACK_SIZE];
    for (int octant = 0; octant < 8; octant++) {
        mask_n lanes = active & is_equal(rays->octant, (mask_n)octant);
        if (!any_lane(lanes)) continue;
        // A lane that is not here has an empty interval; all else follows from t_near <= t_far.
        real_n t_near = choose(lanes, t_enter, (real_n)INFINITY), t_far = choose(lanes, t_leave, (real_n)-INFINITY);
        int top = 0, node = object->root;
        for (;;) {
            const size_t at = 2 * (size_t)node;
            const int shape = words[at + 1], axis = shape & 3;
            if (axis != 3) {
                // An inner node: the distance to its plane, as an interval.
                const real split = (real)((global const float *)words)[at];
                real_n t_low, t_high;
                if (shared == SHARED_ORIGIN) {
                    t_low = multiply_add((real_n)split, lines.low_rate[axis], lines.low_start[axis]);
                    t_high = multiply_add((real_n)split, lines.high_rate[axis], lines.high_start[axis]);
                } else {
                    const real_n t = (split - rays->origin[axis]) * rays->inverse[axis];
                    const real_n width = multiply_add(abs_n(t), (real_n)RELATIVE_WIDENING, slab[axis]);
                    t_low = t - width;
                    t_high = t + width;
                }
                const int near_side = (octant >> axis) & 1, child = shape >> 4;
                const mask_n live = is_at_most(t_near, t_far);
                const mask_n go_near = live & ~is_less(t_high, t_near), go_far = live & ~is_greater(t_low, t_far);
                if (!any_lane(go_far)) node = child + near_side;
                else if (!any_lane(go_near)) node = child + 1 - near_side;
                else if (shape & (8 >> near_side)) {
                    // Nothing lies on the far side: no need to come back.
                    node = child + near_side;
                    t_far = choose(go_near, min_n(t_high, t_far), (real_n)-INFINITY);
                } else if (shape & (4 << near_side)) {
                    // Nothing lies on the near side.
                    node = child + 1 - near_side;
                    t_near = max_n(t_low, t_near);
                    t_far = choose(go_far, t_far, (real_n)-INFINITY);
                } else {
                    stack_node[top] = child + 1 - near_side;
                    stack_near[top] = max_n(t_low, t_near);
                    stack_far[top] = choose(go_far, t_far, (real_n)-INFINITY);
                    top++;
                    node = child + near_side;
                    t_far = choose(go_near, min_n(t_high, t_far), (real_n)-INFINITY);
                }
                continue;
            }
            // A leaf: its triangles, one after the other, against all live lanes.
            const int first = words[at], end = first + (shape >> 2);
            const mask_n live = is_at_most(t_near, t_far);
            //@ count_tests
            // On large meshes what the tests wait for is memory: all records of the leaf are asked for at once.
            if (shared != SHARED_NOTHING)
                for (int i = first; i < end; i++) fetch_test(geometry, geometry->indices[i], shared);
            for (int i = first; i < end; i++) triangle_test(geometry, rays, reach, geometry->indices[i], shared, 0, live, hits);
            if (any_hit) {
                lanes &= is_less(hits->slot, NO_LANES);
                if (!any_lane(lanes)) break;
            }
            // The next pending cell that some lane still has to see.
            int found = 0;
            while (top > 0 && !found) {
                top--;
                node = stack_node[top];
                t_near = stack_near[top];
                t_far = choose(lanes, min_n(stack_far[top], hits->t), (real_n)-INFINITY);
                found = any_lane(is_at_most(t_near, t_far));
            }
            if (!found) break;
        }
    }
}
