// Provides: Media (the dielectrics a ray is inside of), refraction_turn: Snell's law and total internal reflection.
// Needs: hit.cl, structs.  Reads: MEDIA_DEPTH (how many nested dielectrics a ray remembers).
typedef struct {
    lane_int object[MEDIA_DEPTH][LANES];
    real ior[MEDIA_DEPTH][LANES];
    lane_int count[LANES];
} Media;

static inline void media_begin(Media *media) {
    for (int k = 0; k < LANES; k++) media->count[k] = 0;
}

// Snell's law, ratio r = n1 / n2: d' = r d + (r c - sqrt(k)) n with c = -d.n and k = 1 - r^2 (1 - c^2), taken as (1 - r)(1 + r) + (r c)^2:
// no difference of nearly equal numbers but at the critical angle itself, and for r = 1 the root is c to the last bit, so d' is d.
// Gives 1, 0 for total reflection, -1 where n faces away.
inline int refraction_snell(const real *d, const real *n, real ratio, real *turned) {
    const real c = -(d[0] * n[0] + d[1] * n[1] + d[2] * n[2]), rest = (R(1.0) - ratio) * (R(1.0) + ratio) + (ratio * c) * (ratio * c);
    if (c <= R(0.0)) return -1;
    if (rest < R(0.0)) return 0;
    for (int a = 0; a < 3; a++) turned[a] = ratio * d[a] + (ratio * c - sqrt(rest)) * n[a];
    return 1;
}

// For each lane with Refract > 0: the refracted direction and the media behind the surface; its weight; or the weight that total
// internal reflection hands to the reflected ray. A hit on an object that the ray is inside of leaves it, any other enters.
static inline void refraction_turn(global const Material *materials, global const Surface *surfaces, int triangle_slots, int object_count,
                            const Rays *rays, const Hit *hit, const Media *before, real_n *direction, Media *after, real_n *weight,
                            real_n *reflected) {
    real d[3][LANES], n[3][LANES], g[3][LANES], through[LANES], back[LANES];
    lane_int found[LANES];
    store_lanes(hit->found, found);
    for (int a = 0; a < 3; a++) {
        store_lanes(rays->direction[a], d[a]);
        store_lanes(hit->normal[a], n[a]);
        store_lanes(hit->geometric[a], g[a]);
    }
    *after = *before;
    for (int k = 0; k < LANES; k++) {
        const real refract = found[k] ? materials[hit->material[k]].refract : R(0.0);
        through[k] = back[k] = R(0.0);
        if (!(refract > R(0.0))) continue;
        // The media on either side.
        const lane_int slot = hit->slot[k], object = slot < triangle_slots ? surfaces[slot].object : object_count + slot - triangle_slots;
        const int count = before->count[k];
        int at = -1;
        for (int m = 0; m < count; m++)
            if (before->object[m][k] == object) at = m;
        const real from = count > 0 ? before->ior[count - 1][k] : R(1.0);
        real to = materials[hit->material[k]].ior;
        if (at >= 0) {
            for (int m = at; m + 1 < count; m++) {
                after->object[m][k] = before->object[m + 1][k];
                after->ior[m][k] = before->ior[m + 1][k];
            }
            after->count[k] = count - 1;
            to = count > 1 ? after->ior[count - 2][k] : R(1.0);
        } else {
            // One object more than a ray remembers takes the newest one's place.
            const int top = min(count, MEDIA_DEPTH - 1);
            after->object[top][k] = object;
            after->ior[top][k] = to;
            after->count[k] = top + 1;
        }
        // About the shading normal, or about the true one where that would not lead behind the surface.
        const real incoming[3] = {d[0][k], d[1][k], d[2][k]}, shading[3] = {n[0][k], n[1][k], n[2][k]};
        const real surface[3] = {g[0][k], g[1][k], g[2][k]};
        real turned[3];
        int passes = refraction_snell(incoming, shading, from / to, turned);
        if (passes < 0 || (passes > 0 && turned[0] * surface[0] + turned[1] * surface[1] + turned[2] * surface[2] >= R(0.0)))
            passes = refraction_snell(incoming, surface, from / to, turned);
        if (passes <= 0) {
            back[k] = refract;
            continue;
        }
        through[k] = refract;
        for (int a = 0; a < 3; a++) d[a][k] = turned[a];
    }
    for (int a = 0; a < 3; a++) direction[a] = load_lanes(d[a]);
    normalize_n(direction);
    *weight = load_lanes(through);
    *reflected = load_lanes(back);
}

//@hook bounce_members
    Media media;
//@end
//@hook bounce_begin
    media_begin(&current.media);
//@end
//@hook bounce_weights
            real_n through[3], passed, internal;
            Media behind;
            refraction_turn(materials, surfaces, frame->triangle_slots, frame->object_count, &rays, &hit, &current.media, through, &behind,
                            &passed, &internal);
            //@counting count_rays(counters, COUNT_REFRACTED, is_greater(passed * weight, (real_n)0));
            //@counting count_rays(counters, COUNT_INTERNAL, is_greater(internal * weight, (real_n)0));
            bounce_push(&bounces, &hit, through, weight * passed, is_greater(passed * weight, (real_n)0), &current)->media = behind;
            reflected += internal;
//@end
