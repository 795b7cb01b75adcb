// Provides: absorb_along: what the medium around each ray leaves of its light (Beer and Lambert).
// Needs: refraction.cl, hit.cl, throughput.cl.  Reads: nothing.
//
// `absorption` holds three numbers an object, in the order of their ids: coefficients of red, green, blue, per scene unit.
// A distance off by e changes what is left by the factor 1 - a e; the exponential itself is off by 3 units of the last place.

// The object that has the say around lane k: that of the highest rank; -1 outside of all.
static inline int absorb_object(const Media *inside, global const int *media, int k) {
    int highest = -1, object = -1;
    for (int m = 0; m < inside->count[k]; m++) {
        const int rank = media[MEDIA_RANKS + inside->object[m][k]];
        if (rank <= highest) continue;
        highest = rank;
        object = (int)inside->object[m][k];
    }
    return object;
}

// Multiplies `tint` by exp(-a t), t the way to the hit, infinite where there is none; where a is 0 nothing is lost at any length.
static __attribute__((noinline)) void absorb_along(const Media *inside, global const int *media, global const real *absorption,
                                                   const Rays *rays, const Hit *hit, real_n *tint) {
    int object[LANES], within = 0;
    for (int k = 0; k < LANES; k++) {
        object[k] = absorb_object(inside, media, k);
        within |= object[k] >= 0;
    }
    if (!within) return;
    real_n way[3];
    for (int a = 0; a < 3; a++) way[a] = hit->point[a] - rays->origin[a];
    const real_n t = choose(hit->found, max_n(dot_n(way, rays->direction), (real_n)0), (real_n)INFINITY);
    for (int a = 0; a < 3; a++) {
        real_n amount;
        gather(amount, object[k] < 0 ? R(0.0) : absorption[3 * object[k] + a]);
        const mask_n absorbs = is_greater(amount, (real_n)0);
        if (any_lane(absorbs)) tint[a] *= choose(absorbs, exp(-amount * t), (real_n)1);
    }
}

//@hook arrived
        absorb_along(&current.media, media, absorption, &rays, &hit, current.tint);
//@end
