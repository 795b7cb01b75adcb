// Provides: Hit: what shading needs to know of the nearest hit of each ray; Shade: what it adds up; gather, gather_same, all_same, normalize_n, face_towards.
// Needs: lanes.cl, rays.cl.  Reads: nothing.

// Lane-wise reads: `expression` may use the lane number k. Unrolled: a load a lane is no slower than a gather instruction, and what lanes
// are picked from stays in registers.
#define gather(result, expression)                                                  \
    {                                                                               \
        real lane_[LANES];                                                          \
        _Pragma("unroll") for (int k = 0; k < LANES; k++) lane_[k] = (expression);  \
        result = load_lanes(lane_);                                                 \
    }

// The same where `same` says that all lanes read the same: packets that meet one surface are most, and one load is cheaper than many.
#define gather_same(same, result, expression)   \
    if (same) {                                 \
        const int k = 0;                        \
        result = (real_n)(real)(expression);    \
    } else                                      \
        gather(result, expression)

typedef struct {
    real_n point[3];      // on the surface to within `error`
    real_n geometric[3];  // unit normal of the surface itself, towards the viewer
    real_n normal[3];     // unit normal for shading, on the same side
    real_n error;         // bounds the distance from `point` to the surface along the normal, in scene units
    mask_n found;
    lane_int slot[LANES];      // what was hit; 0 in lanes that hit nothing
    lane_int material[LANES];
    int one_material;          // 1 only where all lanes have the same
    //@ hit_members
} Hit;

HOT int all_same(const lane_int *lane) { return !any_lane(~is_equal(load_lanes(lane), (mask_n)lane[0])); }

// The light that leaves the hits towards the viewer by itself.
typedef struct {
    real_n sum[3];  // what the surface's colour multiplies
    //@ shade_members
} Shade;

HOT void normalize_n(real_n *a) {
    const real_n scale = R(1.0) / sqrt(dot_n(a, a));
    #pragma unroll
    for (int i = 0; i < 3; i++) a[i] *= scale;
}

// Turns `a` to the side of `b`.
HOT void face_towards(real_n *a, const real_n *b, const int away) {
    const mask_n flip = away ? is_greater(dot_n(a, b), (real_n)0) : is_less(dot_n(a, b), (real_n)0);
    #pragma unroll
    for (int i = 0; i < 3; i++) a[i] = choose(flip, -a[i], a[i]);
}
