// Provides: sun_clear: which hits nothing keeps from a sun; sun_geometry.
// Needs: reach.cl, triangle.cl, structs.  Reads: SUN_SHARED (SHARED_DIRECTION: planes along every sun's direction are at hand; or SHARED_NOTHING).
//
// All rays to a sun run along D, so where they pass an edge from b to c is told by where they start: on which side of the plane through
// the edge along D. It has the normal M = D x (c - b), and p.M + K, K = -(b + c).M / 2, is D.((b - p) x (c - p)), the edge function of the ray from p:
// three products and a constant, computed from the given numbers in float64 and rounded once. Seen from the triangle beyond the edge, b and c
// change places, and every number its sign and nothing else.
//   What counts is how large a result r of the wrong sign can be. With corners and p relative to the local origin, products P_i and
// S = |P_0| + |P_1| + |P_2| + |K| <= |M| (|p| + |corner|), in r = fl(P_0 + q), q = fl(P_1 + q'), q' = fl(P_2 + K), fused or not, it is off by at most
// uS (M and K rounded) + uS (products) + u|q'| + u|q| + u|r|. Of the wrong sign, |r| is itself below that, so q is -P_0 and q' is -P_0 - P_1 but for
// O(u) S: neither is above S/2 + O(u) S. Together below 3u (1 + 16u) S. The float64 error is below 4 * 2^-53 |c - b| in M, and with the
// sum and the products of K below 16 * 2^-53 (|p| + |corner|) |c - b| in all. With reach >= |p| + |corner|, reach times
// `bound` = 4u max|M| + 16 * 2^-53 max|c - b| holds both, and its own roundings.
// The distance is that of rays of any origin: it is asked for where a test is all but a hit.

// What rays to a sun meet: everything, as seen along its direction.
HOT Geometry sun_geometry(const Geometry *geometry, int index) {
    Geometry along = *geometry;
    if (SUN_SHARED == SHARED_DIRECTION) along.parallel = geometry->sun_planes + (size_t)index * geometry->slot_count;
    //@ sun_geometry
    return along;
}

HOT mask_n sun_clear(const Geometry *geometry, int index, const Rays *rays, const Hit *hit, const real_n *to_light, const int from_eye, real extent,
                     mask_n lit) {
    const Geometry along = sun_geometry(geometry, index);
    return reach_trace(&along, rays, hit, to_light, 0, to_light, (real_n)0, from_eye, extent, SUN_SHARED, lit);
}

#define PREPARE_PARALLEL 6

static __attribute__((noinline)) void prepare_parallel(global const double *vertices, int slot, const double *origin, const double *along,
                                                       global ParallelPlanes *plane) {
    global const double *v = vertices + 9 * (size_t)slot;
    double normal[3][4], steepest = 0, longest = 0;
    for (int c = 0; c < 3; c++) {
        const int from = 3 * ((c + 1) % 3), to = 3 * ((c + 2) % 3);
        double edge[3], sum[3];
        for (int a = 0; a < 3; a++) {
            edge[a] = v[to + a] - v[from + a];  // of the given numbers: relative to the origin they are rounded
            sum[a] = (v[from + a] - origin[a]) + (v[to + a] - origin[a]);
        }
        cross_double(along, edge, normal[c]);
        normal[c][3] = -0.5 * dot_double(sum, normal[c]);
        steepest = fmax(steepest, sqrt(dot_double(normal[c], normal[c])));
        longest = fmax(longest, sqrt(dot_double(edge, edge)));
    }
    for (int a = 0; a < 4; a++) {
        plane->u[a] = (real)normal[0][a];
        plane->v[a] = (real)normal[1][a];
        plane->w[a] = (real)normal[2][a];
    }
    plane->bound = (real)(4 * UNIT_ROUNDOFF * steepest + 16 * 0x1p-53 * longest);
}

//@hook geometry_members
    global const ParallelPlanes *sun_planes;  // slot_count a sun
    global const ParallelPlanes *parallel;    // a slot each, seen along the direction that rays share
//@end
//@hook begin
    geometry.sun_planes = sun_planes;
//@end
//@hook edge_functions
    else if (shared == SHARED_DIRECTION) {
        global const ParallelPlanes *plane = geometry->parallel + slot;
        u = place_uniform(rays->origin, plane->u);
        v = place_uniform(rays->origin, plane->v);
        w = place_uniform(rays->origin, plane->w);
        f.bound = multiply_add(reach, (real_n)plane->bound, (real_n)UNDERFLOWN);
    }
//@end
//@hook fetch_test
    else if (shared == SHARED_DIRECTION) fetch_ahead(geometry->parallel + slot);
//@end
//@hook prepare_parameters
                    , global ParallelPlanes *parallel, double4 along
//@end
//@hook prepare
    const double direction[3] = {along.x, along.y, along.z};
    if (what == PREPARE_PARALLEL) prepare_parallel(vertices, item, origin, direction, parallel + first + item);
//@end
//@hook sun_visible
        mask_n clear = NO_LANES;
        //@ sun_known
        if (any_lane(lit)) lit = sun_clear(geometry, i, rays, hit, to_light, from_eye, extent, lit);
        lit |= clear;
//@end
