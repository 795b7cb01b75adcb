// Provides: triangle_test of the rung `watertight`: no ray passes between triangles that share an edge or a vertex.
// Needs: lanes.cl, rays.cl, geometry.cl, triangle.cl.  Reads: nothing.
//
// A ray that meets a triangle, by the given numbers, has three true edge functions of one sign, so the computed ones lie within
// `bound` of one sign: accepting all of those loses no hit, whatever the rounding. The price is an edge wider by a few u of the
// distance, where both neighbours report the hit and the nearer one stays. The traversal loses no cell (kdtree.cl).

// Lanes that run nearly inside the plane, or start nearly on it: decided in float64, with the same rule. Rare, so kept out of the loop's registers.
static __attribute__((noinline)) mask_n triangle_grazing(const Geometry *geometry, const Rays *rays, int slot, const int shared, mask_n unsure,
                                                  real_n *distance) {
    lane_int test[LANES];
    real t[LANES];
    store_lanes(unsure, test);
    store_lanes(*distance, t);
    for (int k = 0; k < LANES; k++) {
        if (!test[k]) continue;
        double origin[3], along[3], t_min, t_max, p[3][3], n[3], e1[3], e2[3], lowest = INFINITY, highest = -INFINITY, bound = 0;
        ray_given(geometry, rays, k, shared, origin, along, &t_min, &t_max);
        for (int a = 0; a < 3; a++)
            for (int c = 0; c < 3; c++) p[c][a] = geometry->vertices[9 * (size_t)slot + 3 * c + a] - origin[a];
        for (int c = 0; c < 3; c++) {
            const double *b = p[(c + 1) % 3], *e = p[(c + 2) % 3];
            cross_double(b, e, n);
            const double f = dot_double(along, n);
            lowest = f < lowest ? f : lowest;
            highest = f > highest ? f : highest;
            bound = fmax(bound, 0x1p-48 * sqrt(dot_double(b, b) * dot_double(e, e) * dot_double(along, along)));
        }
        for (int a = 0; a < 3; a++) {
            e1[a] = p[1][a] - p[0][a];
            e2[a] = p[2][a] - p[0][a];
        }
        cross_double(e1, e2, n);
        const double rate = dot_double(along, n);
        // In the plane to the last bit of float64: a miss by definition.
        const int hit = (lowest >= -bound || highest <= bound) && fabs(rate) > 0x1p-50 * sqrt(dot_double(e1, e1) * dot_double(e2, e2) * dot_double(along, along));
        test[k] = hit ? -1 : 0;
        t[k] = hit ? (real)(dot_double(p[0], n) / rate * ray_length(rays, k)) : t[k];
    }
    *distance = load_lanes(t);
    return load_lanes(test);
}

HOT void triangle_test(const Geometry *geometry, const Rays *rays, real_n reach, int slot, const int shared, const int picked, mask_n live,
                        Hits *hits) {
    const EdgeFunctions f = edge_functions(geometry, rays, reach, slot, shared);
    // A comparison, as masks made of comparisons alone stay in mask registers.
    mask_n hit = is_less(live, NO_LANES) & (is_at_least(f.lowest, -f.bound) | is_at_most(f.highest, f.bound));
    if (!picked && !any_lane(hit)) return;
    hit &= ~is_equal(rays->skip, (mask_n)slot);  // before float64 is asked: a ray lies in its own triangle's plane, to within its error
    const PlaneHit plane = plane_hit(geometry, rays, reach, slot, shared);
    real_n t = plane.t;
    // Where float32 cannot tell whether the hit lies before the ray's start, float64 does.
    mask_n grazing = plane.grazing;
    if (shared != SHARED_ORIGIN) grazing |= is_at_most(abs_n(t - rays->t_min), plane.error);
    // Where all three edge functions are near their error they say little: seen edge-on, rays near the plane would hit from far beside. Such a ray has
    // two of them within `bound` of one side, so the third below their sum S plus 2 bound. Above `little` = m bound, S is above (m - 2) bound, and
    // what hits wrongly is within 1 / (m - 2) of the triangle's size of it, as slivers are; below, float64 decides. Bounds differ by what rays share.
    const real_n little = (shared == SHARED_NOTHING ? R(8.0) : shared == SHARED_ORIGIN ? R(22.0) : R(64.0)) * f.bound;
    grazing |= is_at_least(f.lowest, -little) & is_at_most(f.highest, little);
    grazing &= hit;
    if (any_lane(grazing)) {
        // Copies go to the function: what it is given by pointer could not stay in registers here.
        const Geometry seen = *geometry;
        const Rays copy = *rays;
        real_n distance = t;
        hit = (hit & ~grazing) | triangle_grazing(&seen, &copy, slot, shared, grazing, &distance);
        t = distance;
    }
    hit &= is_greater(t, rays->t_min);
    mask_n closer = is_less(t, hits->t);
    //@ tie
    hit &= closer;
    //@ accept
    hits->t = choose(hit, t, hits->t);
    hits->slot = choose(hit, (mask_n)slot, hits->slot);
}
