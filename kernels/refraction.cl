// Provides: Media (the dielectrics a ray is inside of), refraction_turn: Snell's law, total internal reflection, walls that coincide.
// Needs: hit.cl, kdtree.cl, structs.  Reads: MEDIA_DEPTH (how many nested dielectrics a ray remembers).
//
// `media` holds whole numbers: how many mesh objects let light through; how many objects the eye is inside of (at most MEDIA_DEPTH);
// each of these as (object, material); then the rank of every object, -1 for those that let no light through.
#define MEDIA_RANKS (2 + 2 * MEDIA_DEPTH)

typedef struct {
    lane_int object[MEDIA_DEPTH][LANES];
    real ior[MEDIA_DEPTH][LANES];
    lane_int count[LANES];
} Media;

static inline void media_begin(Media *inside, global const int *media, global const Material *materials) {
    for (int k = 0; k < LANES; k++) {
        inside->count[k] = media[1];
        for (int m = 0; m < media[1]; m++) {
            inside->object[m][k] = media[2 + 2 * m];
            inside->ior[m][k] = materials[media[3 + 2 * m]].ior;
        }
    }
}

typedef struct {
    int from_eye;   // as in Bounce, which is declared later
} RayStart;

// The index around lane k: that of the object of the highest rank (Schmidt and Budge 2002), 1 outside of all.
static inline real media_index(const Media *inside, global const int *media, int k) {
    real ior = R(1.0);
    int highest = -1;
    for (int m = 0; m < inside->count[k]; m++) {
        const int rank = media[MEDIA_RANKS + inside->object[m][k]];
        if (rank <= highest) continue;
        highest = rank;
        ior = inside->ior[m][k];
    }
    return ior;
}

// Lane k goes through a wall of `object`: leaves it if it is inside, enters it otherwise. A ninth object replaces the newest.
static inline void media_cross(Media *inside, int k, lane_int object, real ior) {
    const int count = inside->count[k];
    int at = -1;
    for (int m = 0; m < count; m++)
        if (inside->object[m][k] == object) at = m;
    if (at >= 0) {
        for (int m = at; m + 1 < count; m++) {
            inside->object[m][k] = inside->object[m + 1][k];
            inside->ior[m][k] = inside->ior[m + 1][k];
        }
        inside->count[k] = count - 1;
        return;
    }
    const int place = count < MEDIA_DEPTH ? count : MEDIA_DEPTH - 1;
    inside->object[place][k] = object;
    inside->ior[place][k] = ior;
    inside->count[k] = place + 1;
}

// Walls of other objects at the very point of the hit, which is to say within the error by which the ray goes on from it: a ray
// through both ends of that error looks for them, object by object, and crosses each it finds.
static __attribute__((noinline)) void media_walls(const Geometry *geometry, global const Material *materials, global const Surface *surfaces,
                                                  global const int *media, real extent, const Rays *rays, const Hit *hit,
                                                  const RayStart *from, Media *inside) {
    real through[LANES];
    lane_int found[LANES], own[LANES];
    store_lanes(hit->found, found);
    for (int k = 0; k < LANES; k++) {
        through[k] = found[k] ? materials[hit->material[k]].refract : R(0.0);
        own[k] = hit->slot[k] < geometry->slot_count ? surfaces[hit->slot[k]].object : -1;
        //@ media_own
    }
    const mask_n active = is_greater(load_lanes(through), (real_n)0) & is_at_least(load_lanes(own), NO_LANES);
    real_n start[3] = {hit->point[0], hit->point[1], hit->point[2]}, error = hit->error;
    //@ bounce_start
    const real_n window = R(2.0) * error / max_n(-dot_n(rays->direction, hit->geometric), (real_n)R(1e-3));
    Rays probe = *rays;
    for (int a = 0; a < 3; a++) probe.origin[a] = choose(active, start[a] - window * rays->direction[a], (real_n)0);
    probe.t_min = (real_n)0;
    probe.t_max = R(2.0) * window;
    probe.skip = (mask_n)-1;
    probe.active = active;
    rays_prepare(&probe, extent);
    for (int b = 0; b < geometry->object_count; b++) {
        //@ media_wall
        const mask_n lanes = probe.active & ~is_equal(load_lanes(own), (mask_n)b);
        if (media[MEDIA_RANKS + b] < 0 || !any_lane(lanes)) continue;
        Hits hits;
        hits.t = probe.t_max;
        hits.slot = (mask_n)-1;
        //@ hits_begin
        kdtree_trace(geometry, geometry->objects + b, &probe, lanes, SHARED_NOTHING, 0, &hits);
        lane_int slot[LANES];
        store_lanes(choose(lanes, hits.slot, (mask_n)-1), slot);
        for (int k = 0; k < LANES; k++) {
            if (slot[k] < 0) continue;
            global const Material *wall = materials + surfaces[slot[k]].material;
            if (wall->refract > R(0.0)) media_cross(inside, k, b, wall->ior);
        }
    }
    //@ media_walls
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
// internal reflection hands to the reflected ray. `after` comes with the walls crossed that coincide with the one hit.
static inline void refraction_turn(global const Material *materials, global const Surface *surfaces, global const int *media,
                                   int triangle_slots, int object_count, const Rays *rays, const Hit *hit, const Media *before,
                                   real_n *direction, Media *after, real_n *weight, real_n *reflected) {
    real d[3][LANES], n[3][LANES], g[3][LANES], through[LANES], back[LANES];
    lane_int found[LANES];
    store_lanes(hit->found, found);
    for (int a = 0; a < 3; a++) {
        store_lanes(rays->direction[a], d[a]);
        store_lanes(hit->normal[a], n[a]);
        store_lanes(hit->geometric[a], g[a]);
    }
    for (int k = 0; k < LANES; k++) {
        const real refract = found[k] ? materials[hit->material[k]].refract : R(0.0);
        through[k] = back[k] = R(0.0);
        if (!(refract > R(0.0))) continue;
        // The media on either side.
        const lane_int slot = hit->slot[k], object = slot < triangle_slots ? surfaces[slot].object : object_count + slot - triangle_slots;
        //@ media_object
        media_cross(after, k, object, materials[hit->material[k]].ior);
        const real from = media_index(before, media, k), to = media_index(after, media, k);
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

//@ refraction_parts

//@hook bounce_members
    Media media;
//@end
//@hook bounce_begin
    media_begin(&current.media, media, materials);
//@end
//@hook bounce_weights
            real_n through[3], passed, internal;
            Media behind = current.media;
            const RayStart start = {current.from_eye};
            if (media[0] > 1) media_walls(&geometry, materials, surfaces, media, frame->extent, &rays, &hit, &start, &behind);
            refraction_turn(materials, surfaces, media, frame->triangle_slots, frame->object_count, &rays, &hit, &current.media, through,
                            &behind, &passed, &internal);
            //@ refraction_turned
            //@ refraction_weights
            //@counting count_rays(counters, COUNT_REFRACTED, is_greater(passed * weight, (real_n)0));
            //@counting count_rays(counters, COUNT_INTERNAL, is_greater(internal * weight, (real_n)0));
            //@ refraction_sent
            bounce_push(&geometry, &rays, &bounces, &hit, through, weight * passed, is_greater(passed * weight, (real_n)0), &current,
                        BRANCH_REFRACTED)->media = behind;
            reflected += internal;
//@end
