// Provides: Rays, Hits; SHARED_NOTHING, SHARED_ORIGIN, SHARED_DIRECTION; rays_check, rays_invert, rays_prepare, ray_point.
// Needs: lanes.cl.  Reads: nothing.

// What the rays of a packet share, and those of others that records are made for.
#define SHARED_NOTHING 0
#define SHARED_ORIGIN 1     // geometry->shared_origin, which geometry->planes are seen from
#define SHARED_DIRECTION 2  // along which geometry->parallel are

// LANES rays. `active` lanes are traced; the others hold anything finite.
typedef struct {
    real_n origin[3];
    real_n direction[3];  // unit length to within 5u
    real_n inverse[3];    // 1 / direction, bounded by HUGE_INVERSE so that no product with a finite distance is NaN
    real_n t_min, t_max;  // hits lie strictly between; on the rung `exact` a t_max below 0 means that the plane of `skip` ends the ray, about -t_max away
    mask_n octant;        // bit a set: the direction's component a is negative
    real_n scale;         // |origin|, plus the extent of the scene where corners are rounded: what distances inherit errors from
    mask_n skip;          // a triangle slot each ray passes by (the one it starts on or ends at), or -1
    mask_n active;
    //@ rays_members
} Rays;

// The nearest hit so far: `t` starts as the far end of the ray, `slot` is -1 while nothing is hit.
typedef struct {
    real_n t;
    mask_n slot;
    //@ hits_members
} Hits;

// Fills `scale`; lanes with a NaN or an infinity become inactive: they hit nothing.
// `corner_extent` bounds the coordinates of the corners that distances are computed from in `real`; 0 for rays of a shared origin.
HOT void rays_check(Rays *rays, real corner_extent) {
    //@ rays_begin
    rays->scale = abs_n(rays->origin[0]) + abs_n(rays->origin[1]) + abs_n(rays->origin[2]) + (real_n)corner_extent;
    #pragma unroll
    for (int a = 0; a < 3; a++)
        rays->active &= is_at_most(abs_n(rays->direction[a]), (real_n)REAL_MAX) & is_at_most(abs_n(rays->origin[a]), (real_n)REAL_MAX);
}

// Fills `inverse` and `octant`, which kd-trees ask for; packets that go together do without.
HOT void rays_invert(Rays *rays) {
    rays->octant = NO_LANES;
    #pragma unroll
    for (int a = 0; a < 3; a++) {
        const real_n d = rays->direction[a];
        const mask_n negative = is_less(d, (real_n)0);
        const mask_n tiny = is_less(abs_n(d), (real_n)TINY_COMPONENT);
        rays->inverse[a] = choose(tiny, choose(negative, (real_n)-HUGE_INVERSE, (real_n)HUGE_INVERSE), R(1.0) / d);
        rays->octant |= negative & (mask_n)(1 << a);
    }
}

// All that follows from origin and direction.
HOT void rays_prepare(Rays *rays, real corner_extent) {
    rays_check(rays, corner_extent);
    rays_invert(rays);
}

HOT real_n ray_point(const Rays *rays, real_n t, int axis) { return multiply_add(rays->direction[axis], t, rays->origin[axis]); }
