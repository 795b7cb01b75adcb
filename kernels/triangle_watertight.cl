// Provides: triangle_test of the rung `watertight`: no ray passes between triangles that share an edge or a vertex.
// Needs: lanes.cl, rays.cl, geometry.cl, triangle.cl.  Reads: nothing.
//
// A ray that meets a triangle, by the given numbers, has three true edge functions of one sign, so the computed ones lie within
// `bound` of one sign: accepting all of those loses no hit, whatever the rounding. The price is an edge wider by a few u of the
// distance, where both neighbours report the hit and the nearer one stays. The traversal loses no cell (kdtree.cl).

// Lanes that run nearly inside the plane: decided in float64, with the same rule. Rare, so kept out of the loop's registers.
__attribute__((noinline)) mask_n triangle_grazing(const Geometry *geometry, const Rays *rays, int slot, const int shared_origin, mask_n unsure,
                                                  real_n *distance) {
    lane_int test[LANES];
    real t[LANES], d[3][LANES];
    store_lanes(unsure, test);
    store_lanes(*distance, t);
    for (int a = 0; a < 3; a++) store_lanes(rays->direction[a], d[a]);
    for (int k = 0; k < LANES; k++) {
        if (!test[k]) continue;
        double p[3][3], n[3], sum[3], along[3] = {d[0][k], d[1][k], d[2][k]}, lowest = INFINITY, highest = -INFINITY, bound = 0;
        corners_seen(geometry, rays, slot, k, shared_origin, p);
        for (int c = 0; c < 3; c++) {
            const double *b = p[(c + 1) % 3], *e = p[(c + 2) % 3];
            cross_double(b, e, n);
            const double f = dot_double(along, n);
            lowest = f < lowest ? f : lowest;
            highest = f > highest ? f : highest;
            bound = fmax(bound, 0x1p-48 * sqrt(dot_double(b, b) * dot_double(e, e)));
        }
        for (int a = 0; a < 3; a++) sum[a] = p[1][a] - p[0][a], n[a] = p[2][a] - p[0][a];
        double normal[3];
        cross_double(sum, n, normal);
        const double rate = dot_double(along, normal);
        // In the plane to the last bit of float64: a miss by definition.
        const int hit = (lowest >= -bound || highest <= bound) && fabs(rate) > 0x1p-50 * sqrt(dot_double(normal, normal));
        test[k] = hit ? -1 : 0;
        t[k] = hit ? (real)(dot_double(p[0], normal) / rate) : t[k];
    }
    *distance = load_lanes(t);
    return load_lanes(test);
}

inline void triangle_test(const Geometry *geometry, const Rays *rays, real_n reach, int slot, const int shared_origin, mask_n live, Hits *hits) {
    const EdgeFunctions f = edge_functions(geometry, rays, reach, slot, shared_origin);
    mask_n hit = live & (is_at_least(f.lowest, -f.bound) | is_at_most(f.highest, f.bound));
    if (!any_lane(hit)) return;
    mask_n grazing;
    real_n t = hit_distance(geometry, rays, slot, shared_origin, &grazing);
    grazing &= hit;
    if (any_lane(grazing)) hit = (hit & ~grazing) | triangle_grazing(geometry, rays, slot, shared_origin, grazing, &t);
    hit &= is_greater(t, rays->t_min) & is_less(t, hits->t) & ~is_equal(rays->skip, (mask_n)slot);
    hits->t = choose(hit, t, hits->t);
    hits->slot = choose(hit, (mask_n)slot, hits->slot);
}
