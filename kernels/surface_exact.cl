// Provides: refine_points: where rays of the rung `exact` start from, better than `real` can compute it.
// Needs: exact.cl, hit.cl.  Reads: nothing.

// The points where rays meet triangles again, in float64 from the numbers as given: rounded once, they lie off the surface by u |P|
// a coordinate, as much again for the offset, and the float64 error; which is what `error` becomes. Spheres keep theirs.
// A point nearer to an edge than 8u |P| is moved to that distance inside its triangle: rounded, it could else lie behind the face
// beyond the edge, and a ray inside of a closed mesh would leave it there.
static __attribute__((noinline)) void refine_points(const Geometry *geometry, const Rays *rays, const int shared_origin, const Hit *hit,
                                                    mask_n active, real_n *point, real_n *error) {
    lane_int lane[LANES];
    real p[3][LANES], n[3][LANES], e[LANES], from[3][LANES], along[3][LANES];
    store_lanes(active, lane);
    store_lanes(*error, e);
    for (int a = 0; a < 3; a++) {
        store_lanes(point[a], p[a]);
        store_lanes(hit->geometric[a], n[a]);
        store_lanes(rays->origin[a], from[a]);
        store_lanes(rays->direction[a], along[a]);
    }
    for (int k = 0; k < LANES; k++) {
        if (!lane[k] || hit->slot[k] >= geometry->slot_count) continue;
        //@ refine_lane
        double origin[3], direction[3], e1[3], e2[3], normal[3], at[3], cross[3], sum = 0, size = 0;
        for (int a = 0; a < 3; a++) {
            origin[a] = shared_origin ? geometry->shared_origin[a] : geometry->local_origin[a] + (double)from[a][k];
            direction[a] = (double)along[a][k];
        }
        global const double *v = geometry->vertices + 9 * (size_t)hit->slot[k];
        Plane plane;
        plane_distance_double(geometry, origin, direction, (int)hit->slot[k], &plane);
        const double t = plane.offset / plane.rate;
        for (int a = 0; a < 3; a++) {
            e1[a] = v[3 + a] - v[a];
            e2[a] = v[6 + a] - v[a];
            at[a] = origin[a] - v[a] + t * direction[a];
            size += fabs(v[a] - geometry->local_origin[a] + at[a]);
        }
        cross_double(e1, e2, normal);
        const double area = dot_double(normal, normal);
        cross_double(at, e2, cross);
        const double u = dot_double(cross, normal) / area;
        cross_double(e1, at, cross);
        const double w = dot_double(cross, normal) / area;
        const double longest = sqrt(fmax(dot_double(e1, e1), dot_double(e2, e2))) * 2;
        const double least = fmin(fmin(u, w), 1 - u - w), wanted = fmin(0.1, 8 * UNIT_ROUNDOFF * size * longest / sqrt(area));
        const double inwards = least < wanted ? (wanted - least) / (1.0 / 3 - least) : 0;
        for (int a = 0; a < 3; a++) {
            const double exact = v[a] - geometry->local_origin[a] + at[a] + inwards * ((e1[a] + e2[a]) / 3 - at[a]);
            p[a][k] = (real)exact;
            sum += fabs(exact * n[a][k]);
        }
        const double rest = (plane.offset_error + fabs(t) * plane.rate_error) / sqrt(area);
        e[k] = (real)(2 * UNIT_ROUNDOFF * sum + 2 * rest);
    }
    for (int a = 0; a < 3; a++) point[a] = load_lanes(p[a]);
    *error = load_lanes(e);
}

//@hook hit_distance
    t = choose(hit->found & is_less(hits->slot, (mask_n)geometry->slot_count), R(0.5) * (hits->t + hits->low), t);
//@end
//@hook opacity_distance
        t = R(0.5) * (hits.t + hits.low);
//@end
//@hook bounce_start
    const Geometry seen = *geometry;
    const Rays copy = *rays;
    real_n refined[3] = {start[0], start[1], start[2]}, refined_error = error;
    refine_points(&seen, &copy, from->from_eye, hit, active, refined, &refined_error);
    for (int a = 0; a < 3; a++) start[a] = refined[a];
    error = refined_error;
//@end
//@hook shadow_above
    // A ray that ends on a flat triangle ends at its plane, compared exactly: no offset hides what touches it. Not so one that comes
    // from behind the plane: there the triangle itself may stand between, and the end must be on the viewer's side.
    mask_n planar = is_less(load_lanes(hit->slot), (mask_n)geometry->slot_count) & is_less(dot_n(hit->geometric, span), (real_n)0);
    for (int a = 0; a < 3; a++) planar &= is_equal(end[a], hit->point[a]);
    //@ planar
    above = choose(planar, (real_n)0, above);
//@end
//@hook shadow_limit
    // The plane lies at the ray's length to within the point's error and the ray's own, which is half of `offset`.
    planar &= is_at_least(rays.skip, NO_LANES);
    const real_n slack = R(1.01) * (hit->error + R(0.5) * offset) / abs_n(dot_n(hit->geometric, rays.direction));
    rays.limit = choose(planar, rays.skip, (mask_n)-1);
    hits.t = choose(planar, length + slack, hits.t);
    hits.low = choose(planar, length - slack, hits.low);
//@end
//@hook reach_start
    const Geometry seen = *geometry;
    const Rays copy = *rays;
    real_n refined[3] = {start[0], start[1], start[2]}, refined_error = error;
    refine_points(&seen, &copy, from_eye, hit, lit, refined, &refined_error);
    for (int a = 0; a < 3; a++) start[a] = refined[a];
    error = refined_error;
//@end
