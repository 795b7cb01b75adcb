// Provides: TreeWalk, tree_begin, tree_next: what rays may meet, by a tree over boxes; scene_trace.
// Needs: kdtree.cl, box.cl, geometry.cl.  Reads: TREE_STACK (at least the depth of that tree).
//
// Places: objects, what other effects put among them, then, from tree_solids on, what has no tree of its own. A node is a record as of an object: its
// box; `extent`, which bounds |x| + |y| + |z| of its points; and in `root` the first of two children, -1 for nothing, or -2 - place in a leaf.
// Boxes are widened as those of objects are (box.cl): a node is entered unless it is shown to be missed.
typedef struct {
    int node[TREE_STACK];
    real_n near[TREE_STACK];  // where each ray enters, infinite where it does not
    int top;
} TreeWalk;

HOT void tree_begin(TreeWalk *walk) {
    walk->node[0] = 0;
    walk->near[0] = (real_n)0;
    walk->top = 1;
}

// The next place whose box some lane in `active` meets before `t_max`, nearer ones first by and large; -1 at the end.
HOT int tree_next(const Geometry *geometry, const Rays *rays, mask_n active, real_n t_max, TreeWalk *walk) {
    const real_n limit = min_n(t_max, (real_n)REAL_MAX);
    while (walk->top > 0) {
        int node = walk->node[--walk->top];
        if (!any_lane(active & is_at_most(walk->near[walk->top], limit))) continue;
        for (;;) {
            const int child = geometry->tree[node].root;
            if (child < 0) {
                if (child == -1) return -1;
                return -2 - child;
            }
            real_n near[2], slab[3], leave;
            int met[2];
            for (int c = 0; c < 2; c++) {
                real_n enter;
                const mask_n live = active & box_clip(geometry->tree + child + c, rays, t_max, slab, &enter, &leave);
                near[c] = choose(live, enter, (real_n)INFINITY);
                met[c] = any_lane(live);
            }
            if (!met[0] && !met[1]) break;
            const int first = !met[0] || (met[1] && !any_lane(is_less(near[0], near[1])));
            if (met[0] && met[1]) {
                walk->node[walk->top] = child + 1 - first;
                walk->near[walk->top] = near[1 - first];
                walk->top++;
            }
            node = child + first;
        }
    }
    return -1;
}

// Rays through what is at one place.
HOT void tree_leaf(const Geometry *geometry, const int place, const Rays *rays, mask_n active, const int shared, const int any_hit,
                   Hits *hits) {
    //@ tree_leaf
    const int b = place;
    kdtree_trace(geometry, geometry->objects + b, rays, active, shared, any_hit, hits);
    //@ count_object
    //@ tree_direct
}

// Of two hits at the same distance the one of the lowest id stays, in whatever order places come: whether `found` comes before `old`.
static __attribute__((noinline)) mask_n tree_earlier(const Geometry *geometry, const Hits *found, const Hits *old) {
    lane_int one[LANES], other[LANES], earlier[LANES];
    store_lanes(found->slot, one);
    store_lanes(old->slot, other);
    //@ tree_ids
    for (int k = 0; k < LANES; k++) {
        lane_int order = one[k] - other[k];
        if (one[k] >= 0 && other[k] >= 0 && one[k] < geometry->slot_count && other[k] < geometry->slot_count) {
            order = geometry->surfaces[one[k]].prim - geometry->surfaces[other[k]].prim;
            //@ tree_order
        }
        earlier[k] = order < 0 ? -1 : 0;
    }
    return load_lanes(earlier);
}

HOT void scene_trace(const Geometry *geometry, const Rays *rays, const int shared, const int any_hit, Hits *hits) {
    mask_n active = rays->active;
    int ordered = any_hit;
    //@ tree_ordered
    TreeWalk walk;
    tree_begin(&walk);
    for (;;) {
        const int place = tree_next(geometry, rays, active, hits->t, &walk);
        if (place < 0) return;
        if (any_hit || (ordered && place < geometry->tree_solids)) {
            // Hits that triangles of this place cannot be compared with exactly count by their distance alone.
            const mask_n before = hits->slot;
            mask_n other = is_at_least(hits->slot, (mask_n)geometry->slot_count);
            //@ tree_other
            if (!any_hit) hits->slot = choose(other, (mask_n)-1, hits->slot);
            tree_leaf(geometry, place, rays, active, shared, any_hit, hits);
            if (!any_hit) {
                hits->slot = choose(other & is_less(hits->slot, NO_LANES), before, hits->slot);
                //@ tree_met
                continue;
            }
            active &= is_less(hits->slot, NO_LANES);
            if (!any_lane(active)) return;
            continue;
        }
        // A little farther than the hit there is, so that one at the same distance is found.
        Hits found = *hits;
        found.t = multiply_add(hits->t, (real_n)(R(4.0) * UNIT_ROUNDOFF), hits->t);
        found.slot = (mask_n)-1;
        //@ tree_found
        tree_leaf(geometry, place, rays, active, shared, any_hit, &found);
        const mask_n hit = is_at_least(found.slot, NO_LANES), tied = hit & is_equal(found.t, hits->t) & is_at_least(hits->slot, NO_LANES);
        mask_n nearer = hit & is_less(found.t, hits->t);
        if (any_lane(tied)) {
            const Geometry seen = *geometry;
            const Hits one = found, other = *hits;
            nearer |= tied & tree_earlier(&seen, &one, &other);
        }
        found.t = choose(nearer, found.t, hits->t);
        found.slot = choose(nearer, found.slot, hits->slot);
        //@ tree_nearer
        *hits = found;
        //@ tree_met
    }
}

//@hook geometry_members
    global const Object *tree;           // over the boxes of all there is
    int tree_solids;                     // the first place without a tree of its own
//@end
//@hook begin
    geometry.tree = object_tree;
    geometry.tree_solids = frame->tree_solids;
//@end
