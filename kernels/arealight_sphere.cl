// Provides: the density with which points on round lights are drawn, as arealight_mis.cl asks for it.
// Needs: arealight_mis.cl, sphere.cl.  Reads: nothing.

//@hook arealight_chance
    const mask_n round = hit->found & is_at_least(load_lanes(hit->slot), (mask_n)geometry->slot_count);
    if (any_lane(round)) {
        real_n axis[3], radius;
        for (int a = 0; a < 3; a++) {
            gather(axis[a], geometry->spheres[hit->slot[k] < geometry->slot_count ? 0 : hit->slot[k] - geometry->slot_count].center[a]);
            axis[a] = rays->origin[a] - before * rays->direction[a] - axis[a];
        }
        gather(radius, geometry->spheres[hit->slot[k] < geometry->slot_count ? 0 : hit->slot[k] - geometry->slot_count].radius);
        const real_n away = sqrt(dot_n(axis, axis)), sine = min_n(radius / away, (real_n)1);
        const real_n cone = sine * sine / (R(1.0) + sqrt((R(1.0) - sine) * (R(1.0) + sine)));
        const mask_n outside = round & is_greater(away, radius * AREALIGHT_OUTSIDE);
        chance = choose(outside, part * R(2.0) * radius * radius / cone, chance);
    }
//@end
