// Provides: scene_trace: rays through every object of the scene, one tree after the other.
// Needs: kdtree.cl, geometry.cl.  Reads: nothing.

// Rays through what no tree holds, after the trees.
HOT void scene_rest(const Geometry *geometry, const Rays *rays, mask_n active, const int shared, const int any_hit, Hits *hits) {
    //@ scene_trace
}

HOT void scene_trace(const Geometry *geometry, const Rays *rays, const int shared, const int any_hit, Hits *hits) {
    mask_n active = rays->active;
    for (int b = 0; b < geometry->object_count; b++) {
        kdtree_trace(geometry, geometry->objects + b, rays, active, shared, any_hit, hits);
        //@ count_object
        if (any_hit) {
            active &= is_less(hits->slot, NO_LANES);
            if (!any_lane(active)) return;
        }
    }
    scene_rest(geometry, rays, active, shared, any_hit, hits);
}
