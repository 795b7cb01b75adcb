// Provides: placed_vectors: smooth triangles that are seen through a transform, which is of one scale for all axes.
// Needs: placed.cl, smooth.cl.  Reads: nothing.
//
// Normals are interpolated, and shadow rays lifted, in the object's space, where the corners are.
HOT void placed_vectors(const Geometry *geometry, const Hit *hit, real_n *v, const int to_world) {
    real vector[3][LANES];
    for (int a = 0; a < 3; a++) store_lanes(v[a], vector[a]);
    for (int k = 0; k < LANES; k++) {
        if (hit->place[k] < 0) continue;
        global const Placement *from = geometry->placements + hit->place[k];
        if (to_world) {
            //@ placed_to_world
        } else {
            //@ placed_to_object
        }
    }
    for (int a = 0; a < 3; a++) v[a] = load_lanes(vector[a]);
}

//@hook placed_surface
    const real_n world_point[3] = {hit->point[0], hit->point[1], hit->point[2]};
    real_n local_point[3];
    placed_local(geometry, rays, hit, local_point);
    for (int a = 0; a < 3; a++) hit->point[a] = local_point[a];
//@end
//@hook hit_surface
    for (int a = 0; a < 3; a++) hit->point[a] = choose(placed, world_point[a], hit->point[a]);
//@end
//@hook placed_faced
    const real_n world_geometric[3] = {hit->geometric[0], hit->geometric[1], hit->geometric[2]};
    const real_n world_normal[3] = {hit->normal[0], hit->normal[1], hit->normal[2]};
    for (int a = 0; a < 3; a++) hit->point[a] = choose(placed, local_point[a], hit->point[a]);
    placed_vectors(geometry, hit, hit->geometric, 0);
    placed_vectors(geometry, hit, hit->normal, 0);
//@end
//@hook hit_faced
    for (int a = 0; a < 3; a++) {
        hit->point[a] = choose(placed, world_point[a], hit->point[a]);
        hit->geometric[a] = world_geometric[a];
        hit->normal[a] = world_normal[a];
    }
    placed_vectors(geometry, hit, hit->lift, 1);
//@end
