// Provides: placed_trace: rays through an object that is seen through a transform; placed_local: hits in their objects' own space.
// Needs: kdtree.cl, hit.cl, geometry.cl, structs.  Reads: nothing.
//
// A placement is an object once more: an instance, or one that moves. Its rays are taken to the object's space, relative to the object's own origin,
// brought to unit length again, and go through the object's tree as any others; `length` is what distances grow by on the way.
//   Points are transformed in float64 and rounded once, by u |o'| a coordinate, which triangle.cl and box.cl allow for in rays of any origin; the
//   float64 error is below 8 * 2^-53 (|o| + |P|) of the world. Directions are off by 2u, lengths by 3u: together with the 8u (scale' + t')
//   of surface.cl, a hit lies within 16u (2 extent' + 3 t') of the surface in the object's space (|o'| <= extent' + 2 t'), and within that times the
//   stretch of normals, and 16u (scale + t) for the point itself, in the world.
// All rays that meet an object meet the same numbers, so no ray passes between its triangles. Boxes of the tree above are wider by what placed
// rays may be off (arrays_placed.py).

#define PREPARE_PLACED 5  // triangles, relative to the origins of their objects

HOT void placed_leaf(const Geometry *geometry, const int b, const Rays *rays, mask_n active, const int any_hit, Hits *hits) {
    kdtree_trace(geometry, geometry->objects + b, rays, active, SHARED_NOTHING, any_hit, hits);
    //@ count_object
}

// `place` below object_count: an object at its own place. A ray that starts on a placement passes by its triangle there alone.
// One copy: inlined wherever rays are traced, it makes up a quarter of what a program takes to compile, and is no faster.
static __attribute__((noinline)) void placed_trace(const Geometry *geometry, const int place, const Rays *rays, mask_n active, const int any_hit,
                                                   Hits *hits) {
    const int number = place < geometry->object_count ? -1 : place - geometry->object_count;
    int b = place;
    Geometry seen = *geometry;
    Rays inner = *rays;
    Hits found = *hits;
    real_n length = (real_n)1;
    if (number >= 0) {
        global const Placement *from = geometry->placements + number;
        b = from->object;
        for (int a = 0; a < 3; a++) seen.local_origin[a] = geometry->object_origins[3 * b + a];
        //@ placed_enter
        //@ placed_moved
        inner.t_min = rays->t_min * length;
        inner.t_max = rays->t_max * length;
        found.t = hits->t * length;
        rays_prepare(&inner, R(0.0));
        //@ placed_prepared
    }
    inner.skip = choose(is_equal(rays->skip_place, (mask_n)number), rays->skip, (mask_n)-1);
    found.slot = (mask_n)-1;
    //@ placed_before
    placed_leaf(&seen, b, &inner, active & inner.active, any_hit, &found);
    const mask_n hit = is_at_least(found.slot, NO_LANES);
    found.t = choose(hit, found.t / length, hits->t);
    found.slot = choose(hit, found.slot, hits->slot);
    //@ placed_after
    found.place = choose(hit, (mask_n)number, hits->place);
    *hits = found;
}

// The hits' points, relative to the objects' origins; those of others as they are.
HOT void placed_local(const Geometry *geometry, const Rays *rays, const Hit *hit, real_n *inner) {
    real point[3][LANES];
    for (int a = 0; a < 3; a++) store_lanes(hit->point[a], point[a]);
    for (int k = 0; k < LANES; k++) {
        if (hit->place[k] < 0) continue;
        global const Placement *from = geometry->placements + hit->place[k];
        double at[3] = {point[0][k], point[1][k], point[2][k]};
        //@ placed_point
        //@ placed_point_moved
        for (int a = 0; a < 3; a++) point[a][k] = (real)at[a];
    }
    for (int a = 0; a < 3; a++) inner[a] = load_lanes(point[a]);
}

//@hook geometry_members
    global const Placement *placements;
    global const double *object_origins;  // 3 an object: what its coordinates are relative to
//@end
//@hook begin
    geometry.placements = placements;
    geometry.object_origins = object_origins;
//@end
//@hook rays_members
    mask_n skip_place;    // the placement that the triangle to pass by is of, or -1
//@end
//@hook hits_members
    mask_n place;         // the placement that was hit, or -1
//@end
//@hook hits_begin
        hits.place = (mask_n)-1;
//@end
//@hook primary
    rays.skip_place = (mask_n)-1;
//@end
//@hook tree_leaf
    // Rays of any origin meet all objects alike; those that share their origin know objects at their own place better.
    if (place < geometry->tree_solids && (shared != SHARED_ORIGIN || place >= geometry->object_count)) {
        placed_trace(geometry, place, rays, active, any_hit, hits);
        return;
    }
//@end
//@hook tree_ids
    lane_int here[LANES], there[LANES];
    store_lanes(found->place, here);
    store_lanes(old->place, there);
//@end
//@hook tree_order
            if (here[k] != there[k]) order = here[k] - there[k];
//@end
//@hook tree_other
            other |= is_at_least(hits->place, NO_LANES);
//@end
//@hook tree_direct
    hits->place = choose(is_at_least(hits->slot, NO_LANES), (mask_n)-1, hits->place);
//@end
//@hook tree_found
        found.place = (mask_n)-1;
//@end
//@hook tree_nearer
        found.place = choose(nearer, found.place, hits->place);
//@end
//@hook hit_members
    lane_int place[LANES];    // the placement that was hit, or -1
    lane_int medium[LANES];   // what media know it by
//@end
//@hook hit_distance
    store_lanes(choose(is_less(hits->slot, (mask_n)geometry->slot_count), hits->place, (mask_n)-1), hit->place);
    for (int k = 0; k < LANES; k++) hit->medium[k] = hit->place[k] < 0 ? -1 : geometry->placements[hit->place[k]].medium;
//@end
//@hook hit_surface
    const mask_n placed = is_at_least(load_lanes(hit->place), NO_LANES);
    //@ placed_surface
//@end
//@hook hit_faced
    //@ placed_faced
//@end
//@hook bounce_members
    mask_n place;
//@end
//@hook bounce_begin
    current.place = (mask_n)-1;
//@end
//@hook bounce_pushed
    next->place = load_lanes(hit->place);
//@end
//@hook bounce_popped
    rays->skip_place = current->place;
//@end
//@hook shadow_skip
    rays.skip_place = load_lanes(hit->place);
//@end
//@hook reach_start
    towards.skip_place = load_lanes(hit->place);
//@end
//@hook planar
    planar &= is_less(load_lanes(hit->place), NO_LANES);  // the plane of a placement is not where its vertices are
//@end
//@hook refine_lanes
    refined &= is_less(load_lanes(hit->place), NO_LANES);  // the point there is and its error hold
//@end
//@hook media_own
        if (hit->place[k] >= 0) own[k] = hit->medium[k];
//@end
//@hook media_object
        if (hit->place[k] >= 0) media_cross(after, k, hit->medium[k], materials[hit->material[k]].ior);
        else
//@end
//@hook media_wall
        continue;  // below, with the placements
//@end
//@hook media_walls
    TreeWalk walk;
    tree_begin(&walk);
    for (;;) {
        const int place = tree_next(geometry, &probe, probe.active, probe.t_max, &walk);
        if (place < 0) break;
        if (place >= geometry->tree_solids) continue;
        const int medium = place < geometry->object_count ? place : geometry->placements[place - geometry->object_count].medium;
        const mask_n lanes = probe.active & ~is_equal(load_lanes(own), (mask_n)medium);
        if (media[MEDIA_RANKS + medium] < 0 || !any_lane(lanes)) continue;
        Hits hits;
        hits.t = probe.t_max;
        hits.slot = (mask_n)-1;
        //@ hits_begin
        placed_trace(geometry, place, &probe, lanes, 0, &hits);
        lane_int slot[LANES];
        store_lanes(choose(lanes, hits.slot, (mask_n)-1), slot);
        for (int k = 0; k < LANES; k++) {
            if (slot[k] < 0) continue;
            global const Material *wall = materials + surfaces[slot[k]].material;
            if (wall->refract > R(0.0)) media_cross(inside, k, medium, wall->ior);
        }
    }
//@end
//@hook texture_where
    real_n inner[3];
    placed_local(geometry, rays, hit, inner);
    for (int a = 0; a < 3; a++) store_lanes(inner[a], where + a * LANES);
//@end
//@hook texture_point
        // Where an object's own origin is another, points are relative to that.
        if (slot[k] < geometry->slot_count)
            for (int a = 0; a < 3; a++) point[a] += geometry->object_origins[3 * geometry->surfaces[slot[k]].object + a] - geometry->local_origin[a];
//@end
//@hook prepare_parameters
                    , global const double *object_origins, global const Surface *surfaces
//@end
//@hook prepare
    if (what == PREPARE_PLACED) {
        double own[3];
        for (int a = 0; a < 3; a++) own[a] = object_origins[3 * surfaces[item].object + a];
        prepare_triangle(vertices, item, own, triangles);
    }
//@end
