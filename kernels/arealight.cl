// Provides: arealight_draw: points on what shines; arealight_light: what hits get of their light.
// Needs: path.cl, scatter.cl, added.cl, reach.cl, structs.  Reads: nothing.
//
// A primitive is drawn in proportion to its area times its luminance, a point on a triangle evenly (Turk 1990: sqrt(u), v), on a sphere evenly
// over the cone under which it is seen (Shirley, Wang and Zimmerman 1996), or over its whole area from inside. `chance`, per solid angle, is
//     triangle   luminance / power * d^2 / cos at the light
//     sphere     area * luminance / power / (2 pi (1 - cos of the cone))
// with `power` the sum of area * luminance over all; `emitters[0]` holds it. All are taken relative to the local origin, rounded to `real`: off by
// 4u of their size.
#define AREALIGHT_LEAST_COS (R(64.0) * UNIT_ROUNDOFF)
#define AREALIGHT_OUTSIDE R(1.001)  // times the radius: nearer than that the cone is the half space, and its edge is no number

// The emitter that holds the place u of the sums of power, which rise to 1.
HOT int arealight_find(global const Emitter *emitters, const int count, const real u) {
    int low = 0, high = count - 1;
    while (low < high) {
        const int middle = (low + high) / 2;
        if (emitters[middle].sum <= u) low = middle + 1;
        else high = middle;
    }
    return low;
}

// Scalar work on each lane: `point` is where the light is drawn from, `normal` its unit normal there; 0 for `chance` where there is none.
static __attribute__((noinline)) void arealight_draw(global const Emitter *emitters, const int count, const real power, const real *pick,
                                                     const real *first, const real *second, const real *from, real *point, real *radiance,
                                                     real *chance, real *slack) {
    for (int k = 0; k < LANES; k++) {
        global const Emitter *emitter = emitters + arealight_find(emitters, count, pick[k]);
        real at[3], normal[3], to[3], square = 0, cosine = 0, least = AREALIGHT_LEAST_COS;
        chance[k] = emitter->luminance / power;
        if (emitter->radius > R(0.0)) {
            real distance = 0, axis[3];
            for (int a = 0; a < 3; a++) {
                axis[a] = from[a * LANES + k] - emitter->corner[a];
                distance += axis[a] * axis[a];
            }
            distance = sqrt(distance);
            const real radius = emitter->radius, turn = R(2.0) * second[k];
            const int outside = distance > radius * AREALIGHT_OUTSIDE;
            // 1 - cos of the cone seen from the sphere's own centre, towards the viewer, or the whole sphere.
            const real sine = radius / distance, cone = outside ? sine * sine / (R(1.0) + sqrt((R(1.0) - sine) * (R(1.0) + sine))) : R(2.0);
            // A direction within the cone, from the viewer; then the nearer point on the sphere along it.
            const real height = first[k] * cone;  // 1 - cos
            real c = R(1.0) - height, s = sqrt(max(height * (R(2.0) - height), R(0.0)));
            if (outside) {
                const real sin_seen = s, along = distance * c - sqrt(max((radius - distance * sin_seen) * (radius + distance * sin_seen), R(0.0)));
                // Seen from the centre, by the law of sines.
                s = min(along * sin_seen / radius, R(1.0));
                c = sqrt((R(1.0) - s) * (R(1.0) + s));
                chance[k] *= emitter->area / (R(6.28318530717958648) * cone);
            }
            // A frame about the axis (Duff and others 2017).
            const real n[3] = {axis[0] / distance, axis[1] / distance, axis[2] / distance};
            const real sign = copysign(R(1.0), n[2]), q = R(-1.0) / (sign + n[2]), b = n[0] * n[1] * q;
            const real t1[3] = {R(1.0) + sign * n[0] * n[0] * q, sign * b, -sign * n[0]}, t2[3] = {b, sign + n[1] * n[1] * q, -n[1]};
            const real cx = cospi(turn) * s, sx = sinpi(turn) * s;
            for (int a = 0; a < 3; a++) {
                normal[a] = cx * t1[a] + sx * t2[a] + c * n[a];
                at[a] = emitter->corner[a] + radius * normal[a];
            }
            for (int a = 0; a < 3; a++) to[a] = from[a * LANES + k] - at[a], square += to[a] * to[a];
            for (int a = 0; a < 3; a++) cosine += to[a] * normal[a];
            cosine = fabs(cosine) / sqrt(square);
            if (outside) least = R(-1.0);  // its limb is drawn as any point of the cone
            else chance[k] *= square / cosine;
        } else {
            const real root = sqrt(first[k]), one = root * (R(1.0) - second[k]), two = root * second[k];
            for (int a = 0; a < 3; a++) at[a] = emitter->corner[a] + one * emitter->e1[a] + two * emitter->e2[a];
            for (int a = 0; a < 3; a++) to[a] = from[a * LANES + k] - at[a], square += to[a] * to[a];
            for (int a = 0; a < 3; a++) cosine += to[a] * emitter->normal[a];
            cosine = fabs(cosine) / sqrt(square);
            chance[k] *= square / cosine;
        }
        // A light seen edge-on, or from where it stands, gives nothing.
        if (!(square > R(0.0)) || !(cosine > least)) chance[k] = R(0.0);
        // Off by `bound` across the light, the point is off by that over the cosine along the way. Where a way meets a sphere is known no better
        // than the discriminant, to 16u r d (sphere.cl), which is 8u d over the cosine.
        const real across = emitter->bound + (emitter->radius > R(0.0) ? R(32.0) * UNIT_ROUNDOFF * sqrt(square) : R(0.0));
        slack[k] = across / max(cosine, AREALIGHT_LEAST_COS);
        for (int a = 0; a < 3; a++) {
            point[a * LANES + k] = at[a];
            radiance[a * LANES + k] = emitter->radiance[a];
        }
    }
}

// What the hits get of the light of one point, drawn for each.
HOT void arealight_light(const Geometry *geometry, global const Frame *frame, global const Emitter *emitters, global const Material *materials,
                         const Draws *draws, const uint path, const Rays *rays, const Hit *hit, const int from_eye, const int goes_on,
                         real_n weight, Shade *shade) {
    real pick[LANES], first[LANES], second[LANES], from[3 * LANES], at[3 * LANES], light[3 * LANES], density[LANES], short_by[LANES];
    real_n u, v, unused;
    path_pair(draws, path, USE_LIGHT_PICK, &u, &unused);
    store_lanes(u, pick);
    path_pair(draws, path, USE_LIGHT_POINT, &u, &v);
    store_lanes(u, first);
    store_lanes(v, second);
    for (int a = 0; a < 3; a++) store_lanes(hit->point[a], from + a * LANES);
    arealight_draw(emitters, frame->emitter_count, frame->emitter_power, pick, first, second, from, at, light, density, short_by);
    const real_n chance = load_lanes(density);
    real_n to_light[3], power[3];
    for (int a = 0; a < 3; a++) to_light[a] = load_lanes(at + a * LANES) - hit->point[a];
    const real_n distance = sqrt(dot_n(to_light, to_light));
    for (int a = 0; a < 3; a++) to_light[a] /= distance;
    mask_n lit = hit->found & is_greater(chance, (real_n)0);
    real_n amount = choose(lit, scatter_phong(geometry, materials, rays, hit, to_light, chance, goes_on), (real_n)0);
    mask_n wanted = is_greater(amount * weight, (real_n)0);
    //@ scatter_lobes
    lit &= wanted;
    if (!any_lane(lit)) return;
    for (int a = 0; a < 3; a++) power[a] = choose(lit, load_lanes(light + a * LANES) / chance, (real_n)0);
    real_n end[3];
    for (int a = 0; a < 3; a++) end[a] = load_lanes(at + a * LANES);
    //@ arealight_visible
    //@ scatter_lit
    amount = choose(lit, amount, (real_n)0);
    for (int a = 0; a < 3; a++) shade->sum[a] += amount * power[a];
}

//@hook light
        if (frame->emitter_count > 0) {
            int from_eye = 1, goes_on = 0;
            //@ light_origin
            //@ light_draws
            arealight_light(&geometry, frame, emitters, materials, &draws, path, &rays, &hit, from_eye, goes_on, weight, &shade);
        }
        {
            // What the hits send out by themselves.
            real_n glow[3], share = (real_n)1;
            for (int a = 0; a < 3; a++) gather(glow[a], materials[hit.material[k]].emission[a]);
            //@ arealight_glow
            const mask_n shines = hit.found & is_greater(max_n(max_n(glow[0], glow[1]), glow[2]), (real_n)0);
            if (any_lane(shines)) {
                //@ arealight_share
                //@ arealight_found
                for (int a = 0; a < 3; a++) shade.added[a] += choose(shines, share * glow[a], (real_n)0);
            }
        }
//@end
