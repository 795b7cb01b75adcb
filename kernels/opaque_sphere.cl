// Provides: the opacity of spheres; spheres in the way of light, each met up to twice.
// Needs: opaque.cl, sphere.cl.  Reads: nothing.

// Multiplies `left` by what each sphere lets through of the rays in `wanted`: at both its roots within (t_min, t_max), in float64. A ray that starts
// on a sphere meets that one at its second root only; one that ends on it (t_min > 0) leaves out the root at its end.
static __attribute__((noinline)) void opaque_spheres(const Geometry *geometry, const Rays *rays, mask_n wanted, real_n *left) {
    lane_int active[LANES], skip[LANES], slot[LANES];
    real o[3][LANES], d[3][LANES], t_min[LANES], t_max[LANES], root[2][LANES], where[3 * LANES], kept[LANES];
    store_lanes(rays->skip, skip);
    store_lanes(rays->t_min, t_min);
    store_lanes(abs_n(rays->t_max), t_max);
    for (int a = 0; a < 3; a++) {
        store_lanes(rays->origin[a], o[a]);
        store_lanes(rays->direction[a], d[a]);
    }
    for (int i = 0; i < geometry->sphere_count; i++) {
        global const Sphere *sphere = geometry->spheres + i;
        real_n f[3], nearest[3];
        for (int a = 0; a < 3; a++) f[a] = rays->origin[a] - sphere->center[a];
        const real_n along = -dot_n(f, rays->direction), size = dot_n(f, f) + sphere->radius * sphere->radius;
        for (int a = 0; a < 3; a++) nearest[a] = multiply_add(rays->direction[a], along, f[a]);
        // The square of the distance from the line is off by less than 16u of `size`.
        const mask_n near = wanted & is_greater(*left, (real_n)0) &
                            is_at_most(dot_n(nearest, nearest), sphere->radius * sphere->radius + (R(64.0) * UNIT_ROUNDOFF) * size);
        if (!any_lane(near)) continue;
        store_lanes(near, active);
        for (int k = 0; k < LANES; k++) {
            root[0][k] = root[1][k] = R(-1.0);
            if (!active[k]) continue;
            double from[3], foot[3], b = 0, unit = 0, rest = 0, square = 0;
            for (int a = 0; a < 3; a++) {
                from[a] = (double)o[a][k] - sphere->given[a];
                unit += (double)d[a][k] * d[a][k];
                b -= from[a] * d[a][k];
                square += from[a] * from[a];
            }
            b /= unit;
            for (int a = 0; a < 3; a++) foot[a] = from[a] + b * d[a][k], rest += foot[a] * foot[a];
            const double radius = sphere->given[3], chord = sqrt(fmax((radius * radius - rest) / unit, 0.0)), away = sqrt(square);
            const double q = b + (b < 0 ? -chord : chord), other = (away - radius) * (away + radius) / unit / q;
            double low = fmin(q, other), high = fmax(q, other);
            int first = radius * radius > rest, second = first;
            if (skip[k] == geometry->slot_count + i) {
                const int starts = t_min[k] == R(0.0);
                if (starts) high = 2 * b;
                first = !starts && fabs(low - t_max[k]) > fabs(high - t_max[k]);
                second = !first;
            }
            if (first && low > t_min[k] && low < t_max[k]) root[0][k] = (real)low;
            if (second && high > t_min[k] && high < t_max[k]) root[1][k] = (real)high;
        }
        for (int side = 0; side < 2; side++) {
            for (int k = 0; k < LANES; k++) {
                slot[k] = root[side][k] > R(0.0) ? geometry->slot_count + i : -1;
                for (int a = 0; a < 3; a++) where[a * LANES + k] = o[a][k] + root[side][k] * d[a][k];
            }
            opaque_at(geometry, slot, where, kept);
            *left *= R(1.0) - load_lanes(kept);
        }
    }
}

//@hook opaque_round
        if (slot[k] >= geometry->slot_count) number = geometry->spheres[slot[k] - geometry->slot_count].material;
//@end
//@hook opacity_round
    opaque_spheres(geometry, given, blocked, &left);
//@end
//@hook rays_members
    int flat_alone;  // spheres are left out
//@end
//@hook rays_begin
    rays->flat_alone = 0;
//@end
//@hook opacity_flat
    rays.flat_alone = 1;
//@end
//@hook sphere_begin
    if (rays->flat_alone) return;
//@end
