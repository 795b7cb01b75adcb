// Provides: fog_area: light of area lights that fog scatters; what fog leaves of it on its way.
// Needs: fog.cl, arealight.cl, structs.  Reads: HAVE_FOG.

HOT void fog_area(const Geometry *geometry, global const Frame *frame, global const Emitter *emitters, const Draws *draws, const uint path,
                  const Rays *rays, const Hit *mote, const int from_eye, real_n weight, real_n *misty) {
    real pick[LANES], first[LANES], second[LANES], from[3 * LANES], at[3 * LANES], light[3 * LANES], density[LANES], short_by[LANES];
    real_n u, v, unused, to_light[3], end[3], power[3];
    path_pair(draws, path, USE_FOG_PICK, &u, &unused);
    store_lanes(u, pick);
    path_pair(draws, path, USE_FOG_POINT, &u, &v);
    store_lanes(u, first);
    store_lanes(v, second);
    for (int a = 0; a < 3; a++) store_lanes(mote->point[a], from + a * LANES);
    arealight_draw(emitters, frame->emitter_count, frame->emitter_power, pick, first, second, from, at, light, density, short_by);
    const real_n chance = load_lanes(density);
    for (int a = 0; a < 3; a++) {
        end[a] = load_lanes(at + a * LANES);
        to_light[a] = end[a] - mote->point[a];
    }
    const real_n distance = sqrt(dot_n(to_light, to_light));
    for (int a = 0; a < 3; a++) to_light[a] /= distance;
    mask_n lit = mote->found & is_greater(chance, (real_n)0) & is_greater(weight, (real_n)0);
    if (!any_lane(lit)) return;
    real_n amount = fog_phase(frame->fog_asymmetry, dot_n(to_light, rays->direction));
    for (int a = 0; a < 3; a++) power[a] = choose(lit, load_lanes(light + a * LANES) / chance, (real_n)0);
    Hit towards = *mote;
    for (int a = 0; a < 3; a++) towards.geometric[a] = to_light[a];
    const Hit *hit = &towards;
    //@ arealight_visible
    //@ fog_lit
    amount = choose(lit, amount, (real_n)0);
    for (int a = 0; a < 3; a++) misty[a] += amount * power[a];
}

//@hook arealight_visible
    if (HAVE_FOG)
        for (int a = 0; a < 3; a++) power[a] *= exp(-geometry->fog_density * distance);
//@end
//@hook fog_lights
                if (frame->emitter_count > 0) {
                    int from_eye = 1;
                    //@ light_origin
                    fog_area(&geometry, frame, emitters, &draws, path, &rays, &mote, from_eye, weight, misty);
                }
//@end
